// The s-T graph of a cycle: who is in the way when and where, and the chosen profile.

const GRAPH = { left: 38, right: 8, top: 18, bottom: 34 };

class SpeedGraph {
  constructor(canvas, graphs) {
    this.canvas = canvas;
    this.graphs = graphs;
  }

  // The lines of a step: the ego's profile, and an area for each vehicle.
  linesOf(step) {
    const g = this.graphs;
    const found = [];
    for (let k = g.start[step]; k < g.start[step + 1]; k += 1) {
      const knots = [];
      for (let i = g.knots[k]; i < g.knots[k + 1]; i += 1) {
        knots.push([g.t[i], g.lower[i], g.upper[i]]);
      }
      found.push({ id: g.ids[g.id[k]], after: g.after[k] === 1, knots });
    }
    return found;
  }

  draw(step, colours) {
    const lines = this.linesOf(step);
    const own = lines.find(({ id }) => id === "");
    const others = lines.filter(({ id }) => id !== "");
    const frame = new Frame(this.canvas, GRAPH);
    const t = own ? own.knots[own.knots.length - 1][0] : 1;
    const s = own ? own.knots[own.knots.length - 1][1] : 1;
    const c = frame.begin(colours, [0, t], [0, Math.max(1.35 * s, 20)]);
    frame.xAxis("t [s]");
    frame.yAxis("s [m]");
    c.save();
    c.beginPath();
    c.rect(GRAPH.left, GRAPH.top, frame.width - GRAPH.left - GRAPH.right,
      frame.height - GRAPH.top - GRAPH.bottom);
    c.clip();
    for (const { id, after, knots } of others) {
      c.beginPath();
      for (const [time, low] of knots) c.lineTo(frame.px(time), frame.py(low));
      for (const [time, , high] of [...knots].reverse()) {
        c.lineTo(frame.px(time), frame.py(high));
      }
      c.closePath();
      c.fillStyle = after ? colours.blocker : colours.limit;
      c.globalAlpha = 0.55;
      c.fill();
      c.globalAlpha = 1;
      c.strokeStyle = colours["vehicle-line"];
      c.setLineDash(after ? [] : [4, 3]);
      c.stroke();
      c.setLineDash([]);
      c.fillStyle = colours.text;
      c.textAlign = "left";
      c.textBaseline = "middle";
      const [time, low, high] = knots[0];
      const last = frame.width - GRAPH.right - c.measureText(id).width - 2;
      c.fillText(id, Math.min(frame.px(time) + 3, last), frame.py((low + high) / 2));
    }
    if (own) {
      c.beginPath();
      for (const [time, low] of own.knots) c.lineTo(frame.px(time), frame.py(low));
      c.strokeStyle = colours.plan;
      c.lineWidth = 2.5;
      c.stroke();
    }
    c.restore();
    const words = others.map(({ id, after }) => `${after ? "after" : "before"} ${id}`);
    this.canvas.setAttribute("aria-label", own
      ? `s-T graph: ${s.toFixed(0)} m in ${t.toFixed(1)} s; ${words.join(", ") || "no vehicle on the path"}`
      : "s-T graph: none in this cycle");
  }
}
