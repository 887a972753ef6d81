// The pictures of a sweep: distributions, heat map, scatter, planning times.

const ROW = 36; // of a distribution [px]
const NARROW = 600; // a plot less wide has the names above its rows [px]
const BINS = 24; // of a histogram
const MOST_CELLS = 12; // of a heat map along one axis; more values are put into bins

function quantile(sorted, share) {
  const at = share * (sorted.length - 1);
  const low = Math.floor(at);
  const high = Math.ceil(at);
  return sorted[low] + (at - low) * (sorted[high] - sorted[low]);
}

function fiveNumbers(values) {
  const sorted = Float64Array.from(values).sort();
  return [0, 0.25, 0.5, 0.75, 1].map((share) => quantile(sorted, share));
}

// A number between -1 and 1 that looks random and is always the same.
function scatterOf(number) {
  const x = Math.sin(number * 127.1 + 11.7) * 43758.5453;
  return 2 * (x - Math.floor(x)) - 1;
}

function named(metric) {
  return metric.unit ? `${metric.label} [${metric.unit}]` : metric.label;
}

// Signs differ in form and colour; the form alone would do.
function drawSign(c, number, x, y, r) {
  c.beginPath();
  const kind = number % 6;
  if (kind === 0) c.arc(x, y, r, 0, 2 * Math.PI);
  else if (kind === 1) c.rect(x - r, y - r, 2 * r, 2 * r);
  else {
    const corners = { 2: 3, 3: 4, 4: 3, 5: 5 }[kind];
    const turn = kind === 4 ? Math.PI / 2 : -Math.PI / 2;
    for (let k = 0; k < corners; k += 1) {
      const angle = turn + (2 * Math.PI * k) / corners;
      const place = [x + 1.3 * r * Math.cos(angle), y + 1.3 * r * Math.sin(angle)];
      if (k === 0) c.moveTo(...place);
      else c.lineTo(...place);
    }
    c.closePath();
  }
  c.fill();
  c.stroke();
}

// The quantile of 0.975 of Student's t (Hill, CACM 13 (1970) 619, to 1 % from n = 3 on).
function studentT(freedom) {
  const exact = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262];
  if (freedom <= exact.length) return exact[freedom - 1];
  const z = 1.959964;
  const g1 = (z ** 3 + z) / 4;
  const g2 = (5 * z ** 5 + 16 * z ** 3 + 3 * z) / 96;
  return z + g1 / freedom + g2 / freedom ** 2;
}

// Mean and ends of its interval; no ends of a single value.
function meanOf(values) {
  const n = values.length;
  const mean = values.reduce((a, b) => a + b, 0) / n;
  if (n < 2) return { n, mean, low: NaN, high: NaN };
  const variance = values.reduce((sum, v) => sum + (v - mean) ** 2, 0) / (n - 1);
  const half = studentT(n - 1) * Math.sqrt(variance / n);
  return { n, mean, low: mean - half, high: mean + half };
}

// Rows with a mean, its interval, and the single values if they are to be shown.
function drawMeans(canvas, title, groups, colours, { dots = false, zero = false } = {}) {
  const longest = Math.max(...groups.map(({ name }) => name.length), 1);
  const narrow = canvas.clientWidth < NARROW;
  const left = narrow ? 14 : Math.min(canvas.clientWidth * 0.36, 14 + 6.4 * longest);
  const tall = (dots ? ROW : 24) + (narrow ? 16 : 0);
  canvas.style.height = `${groups.length * tall + 46}px`;
  const frame = new Frame(canvas, { left, right: 14, top: 6, bottom: 36 });
  const shown = groups.flatMap(({ stat, values }) =>
    [stat.mean, stat.low, stat.high, ...(dots ? values : [])]).filter(Number.isFinite);
  const [low, high] = rangeOf(zero ? [0, ...shown] : shown);
  const room = 0.04 * (high - low);
  const c = frame.begin(colours, [low - room, high + room], [0, groups.length]);
  frame.xAxis(title);
  if (zero) {
    c.strokeStyle = colours.muted;
    frame.line(frame.px(0), 6, frame.px(0), frame.height - 36);
  }
  groups.forEach(({ name, label, stat, values }, number) => {
    const y = frame.py(groups.length - number - 0.5) + (narrow ? 8 : 0);
    c.fillStyle = colours.text;
    c.textAlign = narrow ? "left" : "right";
    c.textBaseline = "middle";
    if (narrow) c.fillText(name, 2, y - 18);
    else writeFitting(c, name, left - 8, y, left - 10);
    const colour = colours[`series-${label % 6}`];
    if (dots) {
      c.fillStyle = colour;
      c.globalAlpha = Math.max(0.2, Math.min(0.7, 60 / values.length));
      values.forEach((value, k) => {
        c.beginPath();
        c.arc(frame.px(value), y + 10 * scatterOf(k), 2, 0, 2 * Math.PI);
        c.fill();
      });
      c.globalAlpha = 1;
    }
    c.strokeStyle = dots ? colours.text : colour;
    c.lineWidth = 2.5;
    if (Number.isFinite(stat.low)) frame.line(frame.px(stat.low), y, frame.px(stat.high), y);
    c.fillStyle = colour;
    c.strokeStyle = dots ? colours.text : colours.surface;
    c.lineWidth = 1;
    if (Number.isFinite(stat.mean)) drawSign(c, label, frame.px(stat.mean), y, 5);
  });
}

function drawDistribution(canvas, metric, groups, colours) {
  const longest = Math.max(...groups.map(({ name }) => name.length));
  const narrow = canvas.clientWidth < NARROW;
  const left = narrow ? 14 : Math.min(canvas.clientWidth * 0.36, 14 + 6.4 * longest);
  const tall = narrow ? ROW + 16 : ROW;
  canvas.style.height = `${groups.length * tall + 46}px`;
  const frame = new Frame(canvas, { left, right: 14, top: 6, bottom: 36 });
  const [low, high] = rangeOf(groups.flatMap(({ rows }) => rows.map((row) => metric.values[row])));
  const room = 0.03 * (high - low);
  const c = frame.begin(colours, [low - room, high + room], [0, groups.length]);
  frame.xAxis(named(metric));
  groups.forEach((group, number) => {
    const y = frame.py(groups.length - number - 0.5) + (narrow ? 8 : 0);
    c.fillStyle = colours.text;
    c.textAlign = narrow ? "left" : "right";
    c.textBaseline = "middle";
    if (narrow) c.fillText(group.name, 2, y - 20);
    else writeFitting(c, group.name, left - 8, y, left - 10);
    if (group.rows.length === 0) return;
    const colour = colours[`series-${group.label % 6}`];
    c.fillStyle = colour;
    c.globalAlpha = Math.max(0.15, Math.min(0.7, 60 / group.rows.length));
    for (const row of group.rows) {
      c.beginPath();
      c.arc(frame.px(metric.values[row]), y + 11 * scatterOf(row), 2, 0, 2 * Math.PI);
      c.fill();
    }
    c.globalAlpha = 1;
    const five = group.five.map((value) => frame.px(value));
    c.strokeStyle = colours.text;
    c.lineWidth = 1.2;
    frame.line(five[0], y, five[1], y);
    frame.line(five[3], y, five[4], y);
    c.strokeRect(five[1], y - 8, Math.max(five[3] - five[1], 0.5), 16);
    c.lineWidth = 2.5;
    frame.line(five[2], y - 8, five[2], y + 8);
    c.lineWidth = 1;
  });
}

// Write text that ends at x, shortened to what fits.
function writeFitting(c, text, x, y, width) {
  let shown = text;
  while (shown.length > 1 && c.measureText(shown).width > width) {
    shown = shown === text ? `${text.slice(0, -2)}…` : `${shown.slice(0, -2)}…`;
  }
  c.fillText(shown, x, y);
}

// The values of an axis as cells: names, and for each run the number of its cell.
function cellsOf(axis) {
  if (axis.texts) {
    return { names: axis.texts, cell: Array.from(axis.codes) };
  }
  const different = [...new Set(axis.values)].sort((a, b) => a - b);
  const number = (value) => String(Number(value.toPrecision(5)));
  if (different.length <= MOST_CELLS) {
    const place = new Map(different.map((value, k) => [value, k]));
    return {
      names: different.map(number),
      cell: Array.from(axis.values, (value) => place.get(value)),
    };
  }
  const [low, high] = [different[0], different[different.length - 1]];
  const bins = 8;
  const edge = (k) => low + ((high - low) * k) / bins;
  const short = (value) => String(Number(value.toPrecision(3)));
  return {
    names: Array.from({ length: bins }, (_, k) => `${short(edge(k))} – ${short(edge(k + 1))}`),
    cell: Array.from(axis.values, (value) =>
      Math.min(bins - 1, Math.floor(((value - low) / (high - low)) * bins))),
  };
}

function cell(kind, text, scope) {
  const made = document.createElement(kind);
  made.textContent = text;
  if (scope) made.scope = scope;
  return made;
}

function fillHeatMap(table, metric, xAxis, yAxis, rows) {
  const [x, y] = [cellsOf(xAxis), cellsOf(yAxis)];
  const sums = y.names.map(() => x.names.map(() => [0, 0]));
  rows.forEach((row) => {
    const value = metric.values[row];
    if (!Number.isFinite(value)) return;
    const sum = sums[y.cell[row]][x.cell[row]];
    sum[0] += value;
    sum[1] += 1;
  });
  const means = sums.map((line) => line.map(([sum, n]) => (n ? sum / n : NaN)));
  const [low, high] = rangeOf(means.flat());
  const written = (value) =>
    metric.rate ? `${(100 * value).toFixed(0)} %` : value.toFixed(metric.digits);
  const head = document.createElement("tr");
  head.append(cell("th", `${yAxis.name} ↓ ${xAxis.name} →`, "col"));
  head.append(...x.names.map((name) => cell("th", name, "col")));
  const lines = means.map((line, k) => {
    const tr = document.createElement("tr");
    tr.append(cell("th", y.names[k], "row"));
    line.forEach((mean, j) => {
      const td = cell("td", Number.isFinite(mean) ? written(mean) : "–");
      if (Number.isFinite(mean)) {
        const { back, fore } = heatColour((mean - low) / (high - low));
        td.style.background = back;
        td.style.color = fore;
        td.title = `${sums[k][j][1]} runs`;
      }
      tr.append(td);
    });
    return tr;
  });
  table.replaceChildren(head, ...lines);
}

class Scatter {
  constructor(canvas, hint, sweep, onChoose) {
    Object.assign(this, { canvas, hint, sweep, onChoose });
    this.chosen = null;
    this.points = [];
    const under = (event) => {
      const box = canvas.getBoundingClientRect();
      return this.nearest(event.clientX - box.left, event.clientY - box.top);
    };
    canvas.addEventListener("pointermove", (event) => this.hover(under(event)));
    canvas.addEventListener("pointerleave", () => this.hover(null));
    canvas.addEventListener("click", (event) => this.choose(under(event)));
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  set(x, y) {
    [this.x, this.y] = [x, y];
  }

  draw(colours) {
    this.colours = colours;
    const { x, y, sweep } = this;
    const frame = new Frame(this.canvas, { left: 52, right: 14, top: 22, bottom: 36 });
    const wide = ([low, high]) => [low - 0.04 * (high - low), high + 0.04 * (high - low)];
    const of = ({ values }) => sweep.rows.map((row) => values[row]).filter(Number.isFinite);
    const c = frame.begin(colours, wide(rangeOf(of(x))), wide(rangeOf(of(y))));
    frame.xAxis(named(x));
    frame.yAxis(named(y));
    this.points = [];
    this.lacking = 0;
    for (const row of sweep.rows) {
      const [there, too] = [x.values[row], y.values[row]].map(Number.isFinite);
      if (!there || !too) this.lacking += 1;
      if (!there && !too) continue;
      const px = there ? frame.px(x.values[row]) : 58 + 4 * scatterOf(row); // at the border, hollow
      const py = too ? frame.py(y.values[row]) : frame.height - 42 + 4 * scatterOf(row);
      const label = sweep.labelCode[row];
      const colour = colours[`series-${label % 6}`];
      this.points.push({ row, px, py });
      c.fillStyle = there && too ? colour : colours.surface;
      c.strokeStyle = there && too ? colours.surface : colour;
      c.lineWidth = there && too ? 0.6 : 1.4;
      drawSign(c, label, px, py, 3.6);
    }
    this.points.sort((one, other) => one.px - other.px || one.row - other.row);
    const marked = this.points.find(({ row }) => row === this.chosen);
    if (marked) {
      c.strokeStyle = colours.text;
      c.lineWidth = 2;
      c.beginPath();
      c.arc(marked.px, marked.py, 9, 0, 2 * Math.PI);
      c.stroke();
    }
  }

  nearest(px, py) {
    let [best, least] = [null, 14];
    for (const point of this.points) {
      const distance = Math.hypot(point.px - px, point.py - py);
      if (distance < least) [best, least] = [point, distance];
    }
    return best;
  }

  hover(point) {
    this.hint.hidden = point === null;
    if (point === null) return;
    const { x, y, sweep } = this;
    const value = (metric) =>
      (Number.isFinite(metric.values[point.row])
        ? `${metric.label} ${metric.values[point.row].toFixed(metric.digits)} ${metric.unit}`.trim()
        : `no ${metric.label}`);
    this.hint.textContent = `${sweep.where(point.row)}: ${value(x)}, ${value(y)}`;
    const left = Math.min(point.px + 12, this.canvas.clientWidth - this.hint.offsetWidth - 4);
    this.hint.style.left = `${Math.max(2, left)}px`;
    this.hint.style.top = `${Math.max(2, point.py - this.hint.offsetHeight - 10)}px`;
  }

  choose(point) {
    if (point === null) return;
    this.chosen = point.row;
    this.onChoose(point.row);
    this.draw(this.colours);
  }

  key(event) {
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!by || this.points.length === 0) return;
    event.preventDefault();
    const now = this.points.findIndex(({ row }) => row === this.chosen);
    const next = now < 0 ? 0 : Math.min(this.points.length - 1, Math.max(0, now + by));
    this.choose(this.points[next]);
    this.hover(this.points[next]);
  }
}

// Histograms over a logarithmic axis, one above the other, with the step's length.
function drawHistograms(canvas, metric, groups, deadlines, colours) {
  const height = 74;
  canvas.style.height = `${groups.length * height + 44}px`;
  const frame = new Frame(canvas, { left: 40, right: 14, top: 4, bottom: 36 });
  const positive = Array.from(metric.values).filter((value) => value > 0);
  const [least, most] = rangeOf([...positive, ...deadlines]);
  const low = Math.log10(Math.max(least, 1e-4)) - 0.1;
  const high = Math.log10(Math.max(most, 1e-3)) + 0.1;
  const c = frame.begin(colours, [low, high], [0, groups.length]);
  const round = [];
  for (let k = Math.floor(low); k <= high; k += 1) {
    for (const digit of [1, 2, 5]) round.push(k + Math.log10(digit));
  }
  const inside = round.filter((value) => value >= low && value <= high);
  const shown = inside.length > 12 ? inside.filter((value) => Number.isInteger(value)) : inside;
  const written = (value) => String(Number((10 ** value).toPrecision(1)));
  frame.xAxis(`${named(metric)}, logarithmic`, written, shown);
  groups.forEach((group, number) => {
    const base = frame.py(groups.length - number - 1) - 1;
    const counts = new Array(BINS).fill(0);
    for (const row of group.rows) {
      const value = metric.values[row];
      if (!(value > 0)) continue;
      const share = (Math.log10(value) - low) / (high - low);
      counts[Math.min(BINS - 1, Math.max(0, Math.floor(share * BINS)))] += 1;
    }
    const top = Math.max(...counts, 1);
    const width = (frame.width - 54) / BINS;
    c.fillStyle = colours[`series-${group.label % 6}`];
    counts.forEach((count, k) => {
      const tall = (count / top) * (height - 26);
      c.fillRect(40 + k * width + 0.5, base - tall, width - 1, tall);
    });
    c.strokeStyle = colours.grid;
    frame.line(40, base + 0.5, frame.width - 14, base + 0.5);
    c.fillStyle = colours.muted;
    c.textAlign = "right";
    c.textBaseline = "middle";
    c.fillText(String(top), 34, base - height + 26);
    c.fillText("0", 34, base);
    c.fillStyle = colours.text;
    c.textAlign = "left";
    c.fillText(group.name, 44, base - height + 12);
  });
  c.strokeStyle = colours.plan;
  c.setLineDash([6, 4]);
  c.lineWidth = 1.5;
  for (const deadline of deadlines) {
    const x = frame.px(Math.log10(deadline));
    frame.line(x, 4, x, frame.height - 36);
  }
  c.setLineDash([]);
}
