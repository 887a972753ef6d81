// What all charts share: sizes, scales, ticks.

// Round numbers between two values, about so many.
function ticks(low, high, about) {
  const raw = (high - low) / about;
  if (!(raw > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(raw));
  const steps = [10, 5, 2, 1, 0.5].map((k) => k * power);
  let found = [];
  for (const step of steps.slice(steps.findLastIndex((k) => k >= raw))) {
    found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
      found.push(k * step);
    }
    if (found.length > 2) break; // one label is no scale
  }
  return found;
}

function tickText(value, all) {
  const step = all.length > 1 ? all[1] - all[0] : 1;
  const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
  return value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");
}

// Size a canvas to its box on the page, sharp on any screen.
function fitCanvas(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.max(1, Math.round(height * ratio));
  return { width, height, ratio };
}

// Least and largest of the numbers that are there, [0, 1] of none.
function rangeOf(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (!Number.isFinite(low)) return [0, 1];
  if (low === high) {
    const room = Math.abs(low) * 0.1 || 1;
    return [low - room, high + room];
  }
  return [low, high];
}

// A canvas with two axes. Ticks of the vertical one are numbers, or names of rows.
class Frame {
  constructor(canvas, edges) {
    this.canvas = canvas;
    this.edges = edges; // room for what is written: left, right, top, bottom [px]
  }

  begin(colours, xRange, yRange) {
    const { width, height, ratio } = fitCanvas(this.canvas);
    const c = this.canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    Object.assign(this, { width, height, c, colours, xRange, yRange });
    c.font = "11px system-ui, sans-serif";
    c.lineWidth = 1;
    return c;
  }

  px(x) {
    const { left, right } = this.edges;
    const share = (x - this.xRange[0]) / (this.xRange[1] - this.xRange[0]);
    return left + share * (this.width - left - right);
  }

  py(y) {
    const { top, bottom } = this.edges;
    const share = (y - this.yRange[0]) / (this.yRange[1] - this.yRange[0]);
    return this.height - bottom - share * (this.height - top - bottom);
  }

  line(x0, y0, x1, y1) {
    this.c.beginPath();
    this.c.moveTo(x0, y0);
    this.c.lineTo(x1, y1);
    this.c.stroke();
  }

  xAxis(title, write = null, values = null) {
    const { c, colours, edges } = this;
    const all = values || ticks(...this.xRange, Math.max(2, Math.floor(this.width / 90)));
    const y = this.height - edges.bottom;
    c.textAlign = "center";
    c.textBaseline = "top";
    for (const value of all) {
      const x = Math.round(this.px(value)) + 0.5;
      c.strokeStyle = colours.grid;
      this.line(x, edges.top, x, y);
      c.fillStyle = colours.muted;
      c.fillText(write ? write(value) : tickText(value, all), x, y + 4);
    }
    c.textAlign = "right";
    c.fillStyle = colours.text;
    c.fillText(title, this.width - edges.right, y + 18);
  }

  yAxis(title) {
    const { c, colours, edges } = this;
    const all = ticks(...this.yRange, 5);
    c.textAlign = "right";
    c.textBaseline = "middle";
    for (const value of all) {
      const y = Math.round(this.py(value)) + 0.5;
      c.strokeStyle = colours.grid;
      this.line(edges.left, y, this.width - edges.right, y);
      c.fillStyle = colours.muted;
      c.fillText(tickText(value, all), edges.left - 6, y);
    }
    c.textAlign = "left";
    c.textBaseline = "top";
    c.fillStyle = colours.text;
    c.fillText(title, 2, 2);
  }
}

// Blue to yellow through grey-green (cividis); told apart with any colour vision.
function heatColour(share) {
  const stops = [
    [0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 182, 98],
    [254, 232, 56],
  ];
  const at = Math.min(1, Math.max(0, share)) * (stops.length - 1);
  const k = Math.min(stops.length - 2, Math.floor(at));
  const mixed = stops[k].map((v, i) => Math.round(v + (at - k) * (stops[k + 1][i] - v)));
  const light = 0.299 * mixed[0] + 0.587 * mixed[1] + 0.114 * mixed[2];
  return { back: `rgb(${mixed.join(" ")})`, fore: light > 118 ? "#000000" : "#ffffff" };
}
