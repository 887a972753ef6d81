// One value over time, drawn once; the cursor is an element that moves over it.
//
// Drawn here and not by a library: the smallest that knows charts of this kind is of
// several hundred kilobytes and draws everything again for each place of the cursor.

const CHART = { left: 46, right: 10, top: 8, bottom: 20 };

class Chart {
  constructor(figure, curve, time, onScrub) {
    this.curve = curve;
    this.time = time;
    this.canvas = figure.querySelector("canvas");
    this.readout = figure.querySelector("output");
    this.cursor = figure.querySelector(".cursor");
    this.box = figure.querySelector(".chart-box");
    this.hovered = null;
    this.shown = 0;
    this.events = [];
    this.phases = "";
    this.range();
    const lengths = Array.from(curve.series[0].values, (value) => this.textOf(value).length);
    const longest = lengths.reduce((a, b) => Math.max(a, b), 4);
    this.readout.style.minWidth = `${longest}ch`; // what stands beside it stays
    let scrubbing = false;
    const stepUnder = (event) => {
      const x = event.clientX - this.box.getBoundingClientRect().left;
      return this.nearest(x);
    };
    this.box.addEventListener("pointerdown", (event) => {
      scrubbing = true;
      this.box.setPointerCapture(event.pointerId);
      onScrub(stepUnder(event));
    });
    this.box.addEventListener("pointermove", (event) => {
      this.hovered = stepUnder(event);
      if (scrubbing) onScrub(this.hovered);
      this.write();
    });
    for (const name of ["pointerup", "pointercancel"]) {
      this.box.addEventListener(name, () => { scrubbing = false; });
    }
    this.box.addEventListener("pointerleave", () => {
      this.hovered = null;
      this.write();
    });
  }

  // What is marked in the background: events, and the letters of a signal.
  mark(events, phases) {
    this.events = events;
    this.phases = phases;
  }

  range() {
    let [low, high] = [Infinity, -Infinity];
    for (const { values } of this.curve.series) {
      for (const value of values) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (!Number.isFinite(low)) [low, high] = [0, 1];
    if (this.curve.low !== null) low = this.curve.low;
    if (this.curve.high !== null) high = this.curve.high;
    const least = 10 ** -this.curve.digits; // a flat line is no noise
    if (high - low < 4 * least) [low, high] = [low - 2 * least, high + 2 * least];
    const room = 0.06 * (high - low);
    this.low = this.curve.low === null ? low - room : low;
    this.high = high + room;
    this.last = Math.max(this.time[this.time.length - 1], 1e-3);
  }

  px(t) {
    return CHART.left + (t / this.last) * (this.width - CHART.left - CHART.right);
  }

  py(value) {
    const height = this.height - CHART.top - CHART.bottom;
    return CHART.top + (1 - (value - this.low) / (this.high - this.low)) * height;
  }

  nearest(px) {
    const share = (px - CHART.left) / (this.width - CHART.left - CHART.right);
    const t = Math.min(1, Math.max(0, share)) * this.last;
    const step = stepAt(this.time, t);
    const next = Math.min(step + 1, this.time.length - 1);
    return this.time[next] - t < t - this.time[step] ? next : step;
  }

  draw(colours) {
    const { width, height, ratio } = fitCanvas(this.canvas);
    [this.width, this.height] = [width, height];
    const c = this.canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    this.drawGrid(c, colours);
    this.drawEvents(c, colours);
    this.drawPhases(c, colours);
    c.save();
    c.beginPath();
    c.rect(CHART.left, CHART.top - 1, width - CHART.left - CHART.right + 1,
      height - CHART.top - CHART.bottom + 2);
    c.clip();
    for (const series of [...this.curve.series].reverse()) {
      this.drawSeries(c, series, colours);
    }
    c.restore();
    this.move(this.shown);
  }

  drawGrid(c, colours) {
    c.font = "11px system-ui, sans-serif";
    c.lineWidth = 1;
    c.strokeStyle = colours.grid;
    c.fillStyle = colours.muted;
    c.textBaseline = "middle";
    c.textAlign = "right";
    const rows = ticks(this.low, this.high, 4);
    for (const value of rows) {
      const y = Math.round(this.py(value)) + 0.5;
      c.beginPath();
      c.moveTo(CHART.left, y);
      c.lineTo(this.width - CHART.right, y);
      c.stroke();
      c.fillText(tickText(value, rows), CHART.left - 6, y);
    }
    c.textBaseline = "top";
    c.textAlign = "center";
    const columns = ticks(0, this.last, Math.max(2, Math.floor(this.width / 55)));
    for (const t of columns) {
      const x = Math.round(this.px(t)) + 0.5;
      c.beginPath();
      c.moveTo(x, CHART.top);
      c.lineTo(x, this.height - CHART.bottom);
      c.stroke();
      const room = x < this.width - 34;
      if (room) c.fillText(tickText(t, columns), x, this.height - CHART.bottom + 5);
    }
    c.textAlign = "right";
    c.fillText("t [s]", this.width - 2, this.height - CHART.bottom + 5);
  }

  // Bad events and warnings as stretches, all others as ticks at the upper edge.
  drawEvents(c, colours) {
    const bottom = this.height - CHART.bottom;
    for (const { step, until, gravity } of this.events) {
      const from = this.px(this.time[step]);
      const to = until === null ? from : this.px(this.time[until]);
      const colour = { bad: colours.red, warning: colours.amber }[gravity] || colours.limit;
      c.fillStyle = colour;
      c.globalAlpha = 0.18;
      if (gravity !== "note") c.fillRect(from - 0.5, CHART.top, Math.max(to - from, 1.5), bottom - CHART.top);
      c.globalAlpha = 1;
      c.fillRect(from - 0.75, CHART.top - 4, 1.5, 4);
    }
  }

  // The phase of the signal ahead as a strip on the time axis.
  drawPhases(c, colours) {
    const of = { r: "red", u: "red", y: "amber", Y: "amber", g: "green", G: "green" };
    const y = this.height - CHART.bottom;
    let begin = 0;
    for (let i = 1; i <= this.phases.length; i += 1) {
      if (i < this.phases.length && this.phases[i] === this.phases[begin]) continue;
      const name = of[this.phases[begin]];
      const last = this.time[Math.min(i, this.time.length - 1)];
      const from = this.px(this.time[begin]);
      c.fillStyle = colours[name] || "transparent";
      if (name) c.fillRect(from, y, this.px(last) - from, 3);
      begin = i;
    }
  }

  drawSeries(c, { values, style, colour, dash, time = this.time }, colours) {
    const look = {
      main: [colours.line, 1.6, []],
      second: [colours.second, 1.6, [2, 2]],
      limit: [colours.limit, 1.2, [6, 4]],
    }[style];
    [c.strokeStyle, c.lineWidth] = look;
    if (colour) c.strokeStyle = colours[colour];
    c.setLineDash(dash || look[2]);
    c.beginPath();
    let open = false;
    for (let i = 0; i < values.length; i += 1) {
      if (!Number.isFinite(values[i])) {
        open = false;
        continue;
      }
      const [x, y] = [this.px(time[i]), this.py(values[i])];
      if (open) c.lineTo(x, y);
      else c.moveTo(x, y);
      const alone = !open && !Number.isFinite(values[i + 1]);
      if (alone) c.lineTo(x + 1.5, y); // a value between two that are not there
      open = true;
    }
    c.stroke();
    c.setLineDash([]);
    if (style !== "limit") this.markClipped(c, values, time);
  }

  // A triangle at the edge for each stretch of values beyond the axis.
  markClipped(c, values, time) {
    c.fillStyle = c.strokeStyle;
    let before = 0;
    for (let i = 0; i < values.length; i += 1) {
      const side = values[i] > this.high ? 1 : values[i] < this.low ? -1 : 0;
      const goesOn = side === before;
      before = side;
      if (side === 0 || goesOn) continue;
      const x = this.px(time[i]);
      const y = side > 0 ? CHART.top : this.height - CHART.bottom;
      c.beginPath();
      c.moveTo(x, y);
      c.lineTo(x - 4, y + 7 * side);
      c.lineTo(x + 4, y + 7 * side);
      c.fill();
    }
  }

  move(step) {
    this.shown = step;
    this.cursor.style.transform = `translateX(${this.px(this.time[step])}px)`;
    this.write();
  }

  write() {
    const step = this.hovered === null ? this.shown : this.hovered;
    const value = this.curve.series[0].values[step];
    const at = this.hovered === null ? "" : `t = ${this.time[step].toFixed(1)}: `;
    this.readout.textContent = at + this.textOf(value);
  }

  // From a thousand on, digits behind the point are noise.
  textOf(value) {
    if (!Number.isFinite(value)) return "none";
    const digits = Math.abs(value) < 1000 ? this.curve.digits : 0;
    return value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
  }
}
