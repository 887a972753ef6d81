// The road and all vehicles at one moment, from above.

const HUMAN = 255; // code of a vehicle that SUMO drives

function lines(all, close) {
  const path = new Path2D();
  for (const points of all) {
    for (let i = 0; i < points.length; i += 2) {
      if (i === 0) path.moveTo(points[0], points[1]);
      else path.lineTo(points[i], points[i + 1]);
    }
    if (close) path.closePath();
  }
  return path;
}

class FleetScene {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.run = run;
    this.frames = 0; // drawn so far
    this.areas = lines(run.road.areas, true);
    this.kerbs = lines(run.road.kerbs, false);
    this.dashed = lines(run.road.dashed, false);
    this.shades = Array.from({ length: 32 }, (_, k) => heatColour(k / 31).back);
  }

  draw(camera, t, shown, chosen) {
    const { context: c, run, canvas } = this;
    const colours = this.colours;
    const ratio = canvas.width / camera.width;
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.fillStyle = colours.ground;
    c.fillRect(0, 0, canvas.width, canvas.height);
    camera.apply(c, ratio);
    const pixel = 1 / camera.scale;
    c.fillStyle = colours.asphalt;
    c.fill(this.areas, "nonzero");
    c.lineWidth = pixel;
    c.strokeStyle = colours.kerb;
    c.stroke(this.kerbs);
    if (camera.scale > 1) {
      c.strokeStyle = colours.marking;
      c.setLineDash([3, 6]);
      c.stroke(this.dashed);
      c.setLineDash([]);
    }
    const step = stepAt(run.time, t);
    if (shown.plans && run.plans) this.drawPlans(step, pixel);
    this.drawVehicles(step, t, pixel, shown.colour, chosen);
    this.frames += 1;
  }

  drawPlans(step, pixel) {
    const { context: c, run, colours } = this;
    const { start, x1, y1, x2, y2, x3, y3 } = run.plans;
    c.beginPath();
    for (let row = start[step]; row < start[step + 1]; row += 1) {
      const own = this.rowOf(step, run.plans.id[row]);
      if (own < 0 || Number.isNaN(x1[row])) continue;
      c.moveTo(run.x[own], run.y[own]);
      c.lineTo(x1[row], y1[row]);
      c.lineTo(x2[row], y2[row]);
      c.lineTo(x3[row], y3[row]);
    }
    c.strokeStyle = colours.plan;
    c.lineWidth = Math.max(0.3, 1.5 * pixel);
    c.stroke();
  }

  // The row of a vehicle in a step, -1 if it is not there; looked up once a step.
  rowOf(step, vehicle) {
    if (this.rowsOf !== step) {
      this.rowsOf = step;
      this.rows = new Map();
      for (let row = this.run.start[step]; row < this.run.start[step + 1]; row += 1) {
        this.rows.set(this.run.id[row], row);
      }
    }
    const found = this.rows.get(vehicle);
    return found === undefined ? -1 : found;
  }

  // x, y, heading of a row at a time between its step and the next.
  place(row, step, t) {
    const { run } = this;
    const next = run.after[row];
    if (next < 0 || step + 1 >= run.time.length) {
      return [run.x[row], run.y[row], run.heading[row]];
    }
    const share = (t - run.time[step]) / (run.time[step + 1] - run.time[step]);
    const between = (values) => values[row] + share * (values[next] - values[row]);
    return [between(run.x), between(run.y), between(run.heading)];
  }

  drawVehicles(step, t, pixel, colour, chosen) {
    const { context: c, run, colours } = this;
    const least = 3 * pixel; // that is seen from afar
    for (let row = run.start[step]; row < run.start[step + 1]; row += 1) {
      const vehicle = run.id[row];
      const [x, y, heading] = this.place(row, step, t);
      const [length, width] = [
        Math.max(run.length[vehicle], least), Math.max(run.width[vehicle], least)];
      const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
      const corner = (a, b) => [
        x + a * length * cos - b * width * sin, y + a * length * sin + b * width * cos];
      c.beginPath();
      c.moveTo(...corner(0.5, 0.5));
      c.lineTo(...corner(0.5, -0.5));
      c.lineTo(...corner(-0.5, -0.5));
      c.lineTo(...corner(-0.5, 0.5));
      c.closePath();
      c.fillStyle = this.colourOf(row, colour);
      c.fill();
      c.lineWidth = vehicle === chosen ? 3 * pixel : pixel;
      c.strokeStyle = vehicle === chosen ? colours.blocker : colours["vehicle-line"];
      c.stroke();
    }
  }

  colourOf(row, colour) {
    const { run, colours } = this;
    if (colour === "speed") {
      return this.shades[Math.min(31, Math.floor((31 * run.speed[row]) / run.fastest))];
    }
    const group = run.group[row];
    return group === HUMAN ? colours.vehicle : colours[`series-${group % 4}`];
  }

  // The vehicle nearest to a place in metres, -1 if none is within a reach.
  nearest(t, x, y, reach) {
    const { run } = this;
    const step = stepAt(run.time, t);
    let [found, far] = [-1, reach];
    for (let row = run.start[step]; row < run.start[step + 1]; row += 1) {
      const [px, py] = this.place(row, step, t);
      const apart = Math.hypot(px - x, py - y);
      if (apart < far) [found, far] = [run.id[row], apart];
    }
    return found;
  }
}
