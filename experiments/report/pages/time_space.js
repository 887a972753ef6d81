// Place over time of every vehicle, coloured by speed; painted once, pixel by pixel.

const TIME_SPACE_EDGES = { left: 52, right: 12, top: 22, bottom: 36 };

class TimeSpace {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.run = run;
    this.frame = new Frame(canvas, TIME_SPACE_EDGES);
    this.painted = document.createElement("canvas");
  }

  // Axes and all vehicles, into a canvas of their own.
  paint(colours) {
    const { run, frame, canvas } = this;
    const { time, way, speed, start } = run;
    const c = frame.begin(colours, [time[0], time[time.length - 1]], rangeOf(way));
    frame.xAxis("time [s]");
    frame.yAxis("place [m]");
    const image = c.createImageData(canvas.width, canvas.height);
    const ratio = canvas.width / frame.width;
    const size = Math.max(1, Math.round(ratio));
    const shades = Array.from({ length: 32 }, (_, k) =>
      heatColour(k / 31).back.match(/\d+/g).map(Number));
    for (let step = 0; step + 1 < start.length; step += 1) {
      const px = Math.round(frame.px(time[step]) * ratio);
      for (let row = start[step]; row < start[step + 1]; row += 1) {
        if (Number.isNaN(way[row])) continue;
        const py = Math.round(frame.py(way[row]) * ratio);
        const shade = shades[Math.min(31, Math.floor((31 * speed[row]) / run.fastest))];
        for (let dy = 0; dy < size; dy += 1) {
          for (let dx = 0; dx < size; dx += 1) {
            const at = 4 * ((py + dy) * canvas.width + px + dx);
            if (at < 0 || at + 3 >= image.data.length) continue;
            [image.data[at], image.data[at + 1], image.data[at + 2]] = shade;
            image.data[at + 3] = 255;
          }
        }
      }
    }
    [this.painted.width, this.painted.height] = [canvas.width, canvas.height];
    const painted = this.painted.getContext("2d");
    painted.putImageData(image, 0, 0);
    painted.globalCompositeOperation = "destination-over"; // axes below the vehicles
    painted.drawImage(canvas, 0, 0);
    this.ratio = ratio;
    this.lineOf = -2;
  }

  // The painted picture, the line of a vehicle, and the present.
  draw(colours, t, chosen) {
    const { frame, ratio } = this;
    const c = this.canvas.getContext("2d");
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, this.canvas.width, this.canvas.height);
    c.drawImage(this.painted, 0, 0);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (this.lineOf !== chosen) {
      this.line = chosen < 0 ? null : this.lineOfVehicle(chosen);
      this.lineOf = chosen;
    }
    if (this.line) {
      c.lineWidth = 2;
      c.strokeStyle = colours.plan;
      c.stroke(this.line);
    }
    c.lineWidth = 1;
    c.strokeStyle = colours.plan;
    const x = frame.px(t);
    frame.line(x, TIME_SPACE_EDGES.top, x, frame.height - TIME_SPACE_EDGES.bottom);
  }

  lineOfVehicle(chosen) {
    const { time, way, start, id } = this.run;
    const path = new Path2D();
    let last = NaN;
    for (let step = 0; step + 1 < start.length; step += 1) {
      for (let row = start[step]; row < start[step + 1]; row += 1) {
        if (id[row] !== chosen || Number.isNaN(way[row])) continue;
        const point = [this.frame.px(time[step]), this.frame.py(way[row])];
        // where a circle begins again the line does
        if (Math.abs(way[row] - last) < 100) path.lineTo(...point);
        else path.moveTo(...point);
        last = way[row];
      }
    }
    return path;
  }

  // The time at a pixel of the page, and the vehicle that is nearest there.
  at(px, py) {
    const { run, frame } = this;
    const inner = frame.width - TIME_SPACE_EDGES.left - TIME_SPACE_EDGES.right;
    const share = (px - TIME_SPACE_EDGES.left) / inner;
    const t = run.time[0] + share * (run.time[run.time.length - 1] - run.time[0]);
    const step = stepAt(run.time, t);
    let [nearest, far] = [-1, 8];
    for (let row = run.start[step]; row < run.start[step + 1]; row += 1) {
      const apart = Math.abs(frame.py(run.way[row]) - py);
      if (apart < far) [nearest, far] = [run.id[row], apart];
    }
    return { t, vehicle: nearest };
  }
}
