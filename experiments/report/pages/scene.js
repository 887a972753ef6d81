// The road and everything on it at one moment, from above.

const KEPT = "kept";
const BRAKE_LIGHT = -0.5; // acceleration below which lights are on [m/s²]
const HARD_BRAKING = -3; // [m/s²]
const SIZES = [3, 6.5]; // lengths that part two-wheelers, cars, lorries and buses [m]
const SIDES = { right: 1, left: 2 }; // bits of an indicator
// Kinds that say more than the length does, as SUMO calls them: [two wheels, -, lorry or
// bus, on foot].
const KINDS = [
  ["bicycle", "moped", "motorcycle", "scooter"], ["taxi", "evehicle"],
  ["truck", "trailer", "bus", "coach", "delivery", "emergency", "army"],
  ["pedestrian", "wheelchair"],
];
const VERDICT_DASHES = [[], [6, 3], [2, 3], [8, 3, 2, 3], [1, 2], [10, 4]];

function pathOf(lines, close) {
  const path = new Path2D();
  for (const points of lines) {
    for (let i = 0; i < points.length; i += 2) {
      if (i === 0) path.moveTo(points[0], points[1]);
      else path.lineTo(points[i], points[i + 1]);
    }
    if (close) path.closePath();
  }
  return path;
}

// 0 two wheels, 1 car, 2 lorry or bus, 3 on foot: by its kind, or else by its length.
function typeOf({ kind, length }) {
  const number = KINDS.findIndex((kinds) => kinds.includes(kind));
  return number >= 0 ? number : SIZES.findLastIndex((size) => length >= size) + 1;
}

class Scene {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.run = run;
    this.colours = theme();
    this.frames = 0; // drawn so far
    const { road } = run;
    this.areas = road.areas.map((area) => pathOf([area], true));
    this.kerbs = pathOf(road.kerbs, false);
    this.dashed = pathOf(road.dashed, false);
    this.edges = pathOf(road.edges, false);
    this.reference = pathOf([road.reference], false);
    this.obstacles = run.obstacles.map(({ outline }) => pathOf([outline], true));
    this.verdicts = run.candidates
      ? run.candidates.verdicts.filter((verdict) => verdict !== KEPT)
      : [];
  }

  draw(camera, t, shown) {
    const step = stepAt(this.run.time, t);
    const ratio = this.begin(camera);
    camera.apply(this.context, ratio);
    this.drawRoad();
    this.drawSignals(step);
    if (shown.candidates) this.drawCandidates(step);
    const bodies = this.bodies(t);
    const believed = shown.believed ? this.believed(step) : null;
    this.drawVehicles(bodies, this.run.cycles.blocker(step), shown.colour, believed);
    if (believed) this.drawBelieved(believed);
    if (shown.plan) this.drawPlan(step);
    if (shown.ghost) this.drawGhost(step);
    const ego = this.egoAt(t);
    this.drawEgo(ego, this.run.contacts(step) !== "");
    if (shown.names) this.drawNames(camera, ratio, bodies, step);
    this.drawScale(camera, ratio);
    this.frames += 1;
    return ratio;
  }

  // Clear the canvas; the ratio is pixels of the canvas per pixel of the page.
  begin(camera) {
    const { context: c } = this;
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.fillStyle = this.colours.ground;
    c.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.pixel = 1 / camera.scale; // a pixel of the page in metres
    return this.canvas.width / camera.width;
  }

  drawRoad() {
    const { context: c, colours, pixel } = this;
    c.setLineDash([]);
    c.fillStyle = colours.asphalt;
    c.strokeStyle = colours.asphalt;
    c.lineWidth = pixel;
    for (const area of this.areas) {
      c.fill(area);
      c.stroke(area); // closes the hair between neighbouring areas
    }
    this.stroke(this.kerbs, colours.kerb, 1);
    this.stroke(this.dashed, colours.marking, 1.5, [3, 6]);
    this.stroke(this.edges, colours.edge, 1.5);
    this.stroke(this.reference, colours.reference, 1, [1, 2]);
    c.setLineDash([]);
    c.fillStyle = colours.obstacle;
    for (const obstacle of this.obstacles) c.fill(obstacle);
  }

  stroke(path, colour, width, dash = []) {
    const { context: c } = this;
    c.setLineDash(dash);
    c.strokeStyle = colour;
    c.lineWidth = width * this.pixel;
    c.stroke(path);
  }

  drawSignals(step) {
    const { context: c, colours } = this;
    const of = { r: "red", u: "red", y: "amber", Y: "amber", g: "green", G: "green" };
    c.setLineDash([]);
    c.lineWidth = Math.max(0.5, 3 * this.pixel);
    for (const { line, letters } of this.run.signals) {
      c.strokeStyle = colours[of[letters[step]] || "muted"];
      c.beginPath();
      c.moveTo(line[0], line[1]);
      c.lineTo(line[2], line[3]);
      c.stroke();
    }
  }

  // Every vehicle at a time, between its places of two steps.
  bodies(t) {
    const { time, vehicles: v } = this.run;
    const step = stepAt(time, t);
    const span = step + 1 < time.length ? time[step + 1] - time[step] : 1;
    const share = Math.min(1, Math.max(0, (t - time[step]) / span));
    const found = [];
    for (let row = v.start[step]; row < v.start[step + 1]; row += 1) {
      const next = share > 1e-6 ? v.after[row] : -1;
      const at = (values) =>
        next < 0 ? values[row] : values[row] + share * (values[next] - values[row]);
      let turn = next < 0 ? 0 : v.heading[next] - v.heading[row];
      turn = Math.atan2(Math.sin(turn), Math.cos(turn));
      found.push({
        id: v.ids[v.id[row]],
        kind: v.kinds[v.id[row]],
        indicator: v.indicator[row],
        x: at(v.x),
        y: at(v.y),
        heading: v.heading[row] + share * turn,
        speed: at(v.speed),
        acceleration: v.acceleration[row],
        length: v.length[row],
        width: v.width[row],
      });
    }
    return found;
  }

  egoAt(t) {
    const { time, ego } = this.run;
    const step = stepAt(time, t);
    const next = Math.min(step + 1, time.length - 1);
    const span = next > step ? time[next] - time[step] : 1;
    const share = next > step ? Math.min(1, Math.max(0, (t - time[step]) / span)) : 0;
    const at = (values) => values[step] + share * (values[next] - values[step]);
    return {
      id: "ego",
      x: at(ego.x),
      y: at(ego.y),
      heading: at(ego.heading),
      speed: at(ego.speed),
      acceleration: ego.acceleration[step],
      indicator: ego.indicator[step],
      length: ego.length,
      width: ego.width,
    };
  }

  outline({ x, y, heading, length, width }) {
    const { context: c } = this;
    const along = [(Math.cos(heading) * length) / 2, (Math.sin(heading) * length) / 2];
    const aside = [(-Math.sin(heading) * width) / 2, (Math.cos(heading) * width) / 2];
    c.beginPath();
    c.moveTo(x + along[0] + aside[0], y + along[1] + aside[1]);
    c.lineTo(x - along[0] + aside[0], y - along[1] + aside[1]);
    c.lineTo(x - along[0] - aside[0], y - along[1] - aside[1]);
    c.lineTo(x + along[0] - aside[0], y + along[1] - aside[1]);
    c.closePath();
  }

  // A windscreen: a bar that says where the front is.
  drawFront({ x, y, heading, length, width }, colour) {
    const { context: c } = this;
    const at = length * 0.25;
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    c.strokeStyle = colour;
    c.lineWidth = Math.max(0.25, this.pixel);
    c.beginPath();
    c.moveTo(x + at * cos - 0.35 * width * sin, y + at * sin + 0.35 * width * cos);
    c.lineTo(x + at * cos + 0.35 * width * sin, y + at * sin - 0.35 * width * cos);
    c.stroke();
  }

  // Two bars at the rear while a body brakes; amber corners of the side it indicates.
  drawLights({ x, y, heading, length, width, acceleration, indicator }) {
    const { context: c } = this;
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    const place = (along, aside) => [x + along * cos - aside * sin, y + along * sin + aside * cos];
    const bar = (along, from, to) => {
      c.moveTo(...place(along, from * width));
      c.lineTo(...place(along, to * width));
    };
    if (acceleration < BRAKE_LIGHT) {
      c.strokeStyle = this.colours.red;
      c.lineWidth = Math.max(0.35, 2 * this.pixel);
      c.beginPath();
      bar(-length / 2, 0.5, 0.2);
      bar(-length / 2, -0.2, -0.5);
      c.stroke();
    }
    if (!indicator) return;
    c.strokeStyle = this.colours.indicator;
    c.lineWidth = Math.max(0.5, 3 * this.pixel);
    c.beginPath();
    for (const [bit, side] of [[SIDES.left, 1], [SIDES.right, -1]]) {
      if (!(indicator & bit)) continue;
      bar(length / 2, 0.55 * side, 0.25 * side);
      bar(-length / 2, 0.55 * side, 0.25 * side);
    }
    c.stroke();
  }

  // What a body is filled with, if not plainly: by speed, braking, or type.
  fillOf(body, by, fastest = this.fastest) {
    if (by === "speed") return heatColour(body.speed / fastest).back;
    if (by === "braking") {
      const { colours } = this;
      const hard = body.acceleration < HARD_BRAKING;
      if (hard) return colours.red;
      if (body.acceleration < BRAKE_LIGHT) return colours.amber;
      return body.acceleration > -BRAKE_LIGHT ? colours.green : colours.vehicle;
    }
    if (by === "type") return this.colours[`series-${typeOf(body)}`];
    return this.colours.vehicle;
  }

  get fastest() {
    if (this.top === undefined) {
      this.top = this.run.vehicles.speed.reduce((a, b) => Math.max(a, b), 1);
    }
    return this.top;
  }

  // Those that the ego does not believe in are pale, if its beliefs are to be shown.
  drawVehicles(bodies, blocker, by, believed) {
    const { context: c, colours } = this;
    const known = believed && new Set(believed.map(({ id }) => id));
    c.setLineDash([]);
    for (const body of bodies) {
      const blocks = blocker !== "" && body.id === blocker;
      c.globalAlpha = known && !known.has(body.id) ? 0.35 : 1;
      this.outline(body);
      c.fillStyle = blocks ? colours.blocker : this.fillOf(body, by);
      c.fill();
      c.strokeStyle = colours["vehicle-line"];
      c.lineWidth = (blocks ? 2.5 : 1) * this.pixel;
      c.stroke();
      this.drawFront(body, colours["vehicle-line"]);
      this.drawLights(body);
    }
    c.globalAlpha = 1;
  }

  // What the ego believes of the others in a step: places, headings and sizes.
  believed(step) {
    const b = this.run.believed;
    if (!b) return null;
    const found = [];
    for (let row = b.start[step]; row < b.start[step + 1]; row += 1) {
      found.push({
        id: b.ids[b.id[row]],
        x: b.x[row],
        y: b.y[row],
        heading: b.heading[row],
        length: b.length[row],
        width: b.width[row],
      });
    }
    return found;
  }

  drawBelieved(bodies) {
    const { context: c, colours } = this;
    c.setLineDash([3 * this.pixel, 2 * this.pixel]);
    c.strokeStyle = colours.second;
    c.lineWidth = 1.8 * this.pixel;
    for (const body of bodies) {
      this.outline(body);
      c.stroke();
    }
    c.setLineDash([]);
  }

  drawEgo(ego, touched) {
    const { context: c, colours } = this;
    c.setLineDash([]);
    this.outline(ego);
    c.fillStyle = colours.ego;
    c.fill();
    if (touched) {
      c.strokeStyle = colours.red;
      c.lineWidth = 3 * this.pixel;
      c.stroke();
    }
    this.drawFront(ego, colours.surface);
    this.drawLights(ego);
  }

  drawGhost(step) {
    const { x, y, heading } = this.run.ghost;
    if (!Number.isFinite(x[step])) return;
    const { length, width } = this.run.ego;
    this.outline({ x: x[step], y: y[step], heading: heading[step], length, width });
    const { context: c, colours } = this;
    c.setLineDash([3 * this.pixel, 3 * this.pixel]);
    c.strokeStyle = colours.ghost;
    c.lineWidth = 2 * this.pixel;
    c.stroke();
  }

  polyline(x, y, first, last) {
    const { context: c } = this;
    c.beginPath();
    for (let i = first; i < last; i += 1) {
      if (i === first) c.moveTo(x[i], y[i]);
      else c.lineTo(x[i], y[i]);
    }
  }

  drawPlan(step) {
    const { start, x, y } = this.run.plans;
    const { context: c, colours } = this;
    c.setLineDash([]);
    this.polyline(x, y, start[step], start[step + 1]);
    c.strokeStyle = colours.plan;
    c.lineWidth = 2.5 * this.pixel;
    c.stroke();
  }

  // Colour and dashes of a verdict; the same in the legend.
  look(verdict) {
    if (verdict === KEPT) return { colour: this.colours.kept, dash: VERDICT_DASHES[0] };
    const number = this.verdicts.indexOf(verdict);
    if (number < 0) return null;
    return {
      colour: this.colours[`removed-${number % 6}`],
      dash: VERDICT_DASHES[1 + (number % (VERDICT_DASHES.length - 1))],
    };
  }

  drawCandidates(step) {
    const all = this.run.candidates;
    if (!all) return;
    const { context: c } = this;
    const ofStep = [all.start[step], all.start[step + 1]];
    for (let k = ofStep[1] - 1; k >= ofStep[0]; k -= 1) {
      const { colour, dash } = this.look(all.verdicts[all.verdict[k]]);
      this.polyline(all.x, all.y, all.points[k], all.points[k + 1]);
      c.setLineDash(dash.map((length) => length * this.pixel));
      c.strokeStyle = colour;
      c.lineWidth = this.pixel;
      c.stroke();
    }
    c.setLineDash([]);
  }

  // What lies under a place in metres; null if nothing does.
  bodyAt(t, x, y) {
    const inside = (body) => {
      const [dx, dy] = [x - body.x, y - body.y];
      const [cos, sin] = [Math.cos(body.heading), Math.sin(body.heading)];
      return (
        Math.abs(dx * cos + dy * sin) <= body.length / 2 + 0.3 &&
        Math.abs(dy * cos - dx * sin) <= body.width / 2 + 0.3
      );
    };
    const found = [this.egoAt(t), ...this.bodies(t)].find(inside);
    if (found) return found;
    const c = this.context;
    c.save();
    c.setTransform(1, 0, 0, 1, 0, 0);
    const number = this.obstacles.findIndex((path) => c.isPointInPath(path, x, y));
    c.restore();
    return number < 0 ? null : { id: this.run.obstacles[number].id };
  }

  drawNames(camera, ratio, bodies, step) {
    const { context: c, colours } = this;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "center";
    c.lineWidth = 3;
    c.setLineDash([]);
    const write = (text, x, y) => {
      const [px, py] = camera.toScreen(x, y);
      c.strokeStyle = colours.ground;
      c.strokeText(text, px, py - 8);
      c.fillStyle = colours.text;
      c.fillText(text, px, py - 8);
    };
    for (const { id, x, y } of bodies) write(id, x, y);
    for (const { id, line, letters } of this.run.signals) {
      write(`${id} ${letters[step]}`, (line[0] + line[2]) / 2, (line[1] + line[3]) / 2);
    }
    for (const { id, outline } of this.run.obstacles) write(id, outline[0], outline[1]);
  }

  drawScale(camera, ratio) {
    const { context: c, colours } = this;
    const lengths = [1, 2, 5, 10, 20, 50, 100, 200, 500];
    const length = lengths.findLast((one) => one * camera.scale <= 120) || 1;
    const [x, y] = [12, camera.height - 12];
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.setLineDash([]);
    c.strokeStyle = colours.text;
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(x, y - 5);
    c.lineTo(x, y);
    c.lineTo(x + length * camera.scale, y);
    c.lineTo(x + length * camera.scale, y - 5);
    c.stroke();
    c.font = "12px system-ui, sans-serif";
    c.textAlign = "left";
    c.fillStyle = colours.text;
    c.fillText(`${length} m`, x + 6, y - 6);
  }
}
