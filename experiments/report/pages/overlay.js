// Several runs in one scene and in one chart: a colour and a dash for each.

const RUN_DASHES = [[], [7, 3], [2, 2], [8, 3, 2, 3], [1, 3], [12, 3], [4, 2, 1, 2], [3, 5]];
const PALE = 0.16; // of the area between the least and the largest curve
const TRAIL = 8; // of driven path shown behind an ego [s]

const colourOf = (number) => `series-${number % 6}`;

class OverlaidScene {
  constructor(canvas, runs) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.runs = runs;
    this.scenes = runs.map((run) => new Scene(canvas, run));
    const roads = runs.map((run) => JSON.stringify(run.road));
    this.roads = this.scenes.filter((_, k) => roads.indexOf(roads[k]) === k);
    this.frames = 0;
  }

  set colours(colours) {
    for (const scene of this.scenes) scene.colours = colours;
  }

  get colours() {
    return this.scenes[0].colours;
  }

  get fastest() {
    return Math.max(...this.scenes.map((scene) => scene.fastest));
  }

  egoAt(t, number) {
    return this.scenes[number].egoAt(t);
  }

  // All runs over each other, or one above the other with one camera.
  draw(camera, t, shown) {
    const ratio = this.scenes[0].begin(camera);
    for (const scene of this.scenes) scene.pixel = 1 / camera.scale;
    if (shown.apart) this.drawApart(camera, t, shown, ratio);
    else {
      camera.apply(this.context, ratio);
      for (const scene of this.roads) scene.drawRoad();
      this.scenes[0].drawSignals(stepAt(this.runs[0].time, t));
      this.runs.forEach((_, number) => this.drawTraffic(number, t, shown));
      this.runs.forEach((_, number) => this.drawDrive(number, t, shown));
      if (shown.names) this.drawNames(camera, ratio, t, shown);
    }
    this.scenes[0].drawScale(camera, ratio);
    this.frames += 1;
    return ratio;
  }

  drawApart(camera, t, shown, ratio) {
    const { context: c, runs } = this;
    const tall = camera.height / runs.length;
    runs.forEach((run, number) => {
      const scene = this.scenes[number];
      const ego = scene.egoAt(t);
      c.setTransform(ratio, 0, 0, ratio, 0, 0);
      c.save();
      c.beginPath();
      c.rect(0, number * tall, camera.width, tall);
      c.clip();
      const own = Object.assign(Object.create(camera), { x: camera.x, y: camera.y });
      if (shown.follow) [own.x, own.y] = [ego.x, ego.y];
      own.apply(c, ratio, camera.width / 2, (number + 0.5) * tall);
      scene.drawRoad();
      scene.drawSignals(stepAt(run.time, t));
      this.drawTraffic(number, t, shown);
      this.drawDrive(number, t, shown);
      c.restore();
      c.setTransform(ratio, 0, 0, ratio, 0, 0);
      c.fillStyle = this.colours[colourOf(number)];
      c.font = "12px system-ui, sans-serif";
      c.textAlign = "left";
      c.fillText(run.label, 10, number * tall + 17);
      c.strokeStyle = this.colours.muted;
      c.lineWidth = 1;
      c.beginPath();
      c.moveTo(0, number * tall);
      c.lineTo(camera.width, number * tall);
      c.stroke();
    });
  }

  // The vehicles of a run, their outlines in its colour.
  drawTraffic(number, t, shown) {
    if (!shown.traffic[number]) return;
    const { context: c, colours } = this;
    const scene = this.scenes[number];
    const bodies = scene.bodies(Math.min(t, scene.run.time[scene.run.time.length - 1]));
    c.lineWidth = 1.2 * scene.pixel;
    c.strokeStyle = colours[colourOf(number)];
    c.setLineDash(RUN_DASHES[number].map((length) => length * scene.pixel));
    for (const body of bodies) {
      scene.outline(body);
      c.fillStyle = scene.fillOf(body, shown.colour, this.fastest);
      c.globalAlpha = 0.55;
      c.fill();
      c.globalAlpha = 1;
      c.stroke();
    }
    c.setLineDash([]);
    for (const body of bodies) scene.drawLights(body);
  }

  // The ego of a run, the path it has driven, and its plan.
  drawDrive(number, t, shown) {
    const { context: c, colours } = this;
    const scene = this.scenes[number];
    const { run } = scene;
    const colour = colours[colourOf(number)];
    const step = stepAt(run.time, t);
    const { x, y } = run.ego;
    c.setLineDash([]);
    c.strokeStyle = colour;
    c.lineWidth = 1.4 * scene.pixel;
    scene.polyline(x, y, stepAt(run.time, t - TRAIL), step + 1);
    c.stroke();
    if (shown.plan) {
      const { start, x: planX, y: planY } = run.plans;
      scene.polyline(planX, planY, start[step], start[step + 1]);
      c.lineWidth = 2.5 * scene.pixel;
      c.setLineDash([5 * scene.pixel, 2 * scene.pixel]);
      c.stroke();
      c.setLineDash([]);
    }
    const ego = scene.egoAt(t);
    const ended = t > run.time[run.time.length - 1] + 1e-6;
    scene.outline(ego);
    c.fillStyle = colour;
    c.globalAlpha = ended ? 0.35 : 0.9;
    c.fill();
    c.globalAlpha = 1;
    c.strokeStyle = run.contacts(step) !== "" ? colours.red : colours.surface;
    c.lineWidth = (run.contacts(step) !== "" ? 3 : 1) * scene.pixel;
    c.stroke();
    scene.drawFront(ego, colours.surface);
    scene.drawLights(ego);
  }

  drawNames(camera, ratio, t, shown) {
    this.runs.forEach((run, number) => {
      if (!shown.traffic[number]) return;
      const scene = this.scenes[number];
      const ego = { ...scene.egoAt(t), id: run.label };
      scene.drawNames(camera, ratio, [...scene.bodies(t), ego], stepAt(run.time, t));
    });
  }

  bodyAt(t, x, y) {
    for (let number = 0; number < this.runs.length; number += 1) {
      const found = this.scenes[number].bodyAt(t, x, y);
      if (found) return { ...found, id: `${this.runs[number].label}: ${found.id}` };
    }
    return null;
  }
}

// One curve of several runs; the area between them is what differs.
class OverlaidChart extends Chart {
  // Values of all runs that have one at a time: the steps of the longest are the axis.
  band() {
    const { series } = this.curve;
    const own = series.filter(({ style }) => style === "main");
    return Array.from(this.time, (t) => {
      let [low, high, count] = [Infinity, -Infinity, 0];
      for (const series of own) {
        const value = valueAt(series, t);
        if (!Number.isFinite(value)) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
        count += 1;
      }
      return count > 1 ? [low, high] : null;
    });
  }

  drawPhases(c, colours) {
    super.drawPhases(c, colours);
    if (this.between === undefined) this.between = this.band();
    c.save();
    c.beginPath();
    c.rect(CHART.left, CHART.top, this.width - CHART.left - CHART.right,
      this.height - CHART.top - CHART.bottom);
    c.clip();
    c.fillStyle = colours.accent;
    c.globalAlpha = PALE;
    this.between.forEach((ends, i) => {
      if (ends === null || i + 1 >= this.time.length) return;
      const x = this.px(this.time[i]);
      const [top, bottom] = [this.py(ends[1]), this.py(ends[0])];
      c.fillRect(x, top, this.px(this.time[i + 1]) - x, bottom - top);
    });
    c.globalAlpha = 1;
    c.restore();
  }

  write() {
    const step = this.hovered === null ? this.shown : this.hovered;
    const t = this.time[step];
    const values = this.curve.series.filter(({ style }) => style === "main").map(
      (one) => {
        const value = valueAt(one, t);
        return Number.isNaN(value) ? "–" : this.textOf(value);
      });
    const at = this.hovered === null ? "" : `t = ${t.toFixed(1)}: `;
    this.readout.textContent = at + values.join(" · ");
  }
}

// The same curve of all runs as one: their first series, and the limits of the first.
function overlaidCurve(runs, number) {
  const curves = runs.map((run) => run.curves[number]);
  const ends = (name, of) => {
    const values = curves.map((curve) => curve[name]);
    return values.includes(null) ? null : of(...values);
  };
  return {
    ...curves[0],
    low: ends("low", Math.min),
    high: ends("high", Math.max),
    series: [
      ...runs.map(({ time }, k) => ({
        ...curves[k].series[0], name: runs[k].label, style: "main", time,
        colour: colourOf(k), dash: RUN_DASHES[k],
      })),
      ...curves[0].series.filter(({ style }) => style === "limit").map((series) =>
        ({ ...series, time: runs[0].time })),
    ],
  };
}
