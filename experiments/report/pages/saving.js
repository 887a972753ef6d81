// What a page can be asked for as a file, or as text on the clipboard.

function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function savePicture(canvas, name) {
  canvas.toBlob((blob) => save(name, blob), "image/png");
}

// Columns of all curves over time; an empty cell is a value that is not there.
function csvOf(time, curves) {
  const columns = curves.flatMap((curve) => curve.series.map((one) => {
    const name = one.name === curve.title ? one.name : `${curve.title}: ${one.name}`;
    return {
      name: curve.unit ? `${name} [${curve.unit}]` : name,
      values: one.time ? Array.from(time, (t) => valueAt(one, t)) : one.values,
    };
  }));
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const number = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(7))) : "");
  const rows = [["t [s]", ...columns.map(({ name }) => quoted(name))]];
  for (let i = 0; i < time.length; i += 1) {
    rows.push([number(time[i]), ...columns.map(({ values }) => number(values[i]))]);
  }
  return rows.map((row) => `${row.join(",")}\n`).join("");
}

// The value of a series that has times of its own; none after its end.
function valueAt({ time, values }, t) {
  return t > time[time.length - 1] + 1e-6 ? NaN : values[stepAt(time, t)];
}

// Record the scene while it plays; pressed again, or at the end, the film is saved.
function wireFilm(button, canvas, file, player) {
  let recorder = null;
  const stop = () => { if (recorder && recorder.state === "recording") recorder.stop(); };
  const begin = () => {
    const parts = [];
    recorder = new MediaRecorder(canvas.captureStream(30));
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      const { mimeType } = recorder;
      recorder = null;
      button.textContent = "film from here";
      button.setAttribute("aria-pressed", "false");
      save(`${file}.${mimeType.includes("mp4") ? "mp4" : "webm"}`, new Blob(parts, { type: mimeType }));
    });
    recorder.start();
    button.textContent = "end of the film";
    button.setAttribute("aria-pressed", "true");
    if (!player.playing) player.toggle();
    const watch = () => {
      if (recorder === null) return;
      if (player.playing) requestAnimationFrame(watch);
      else stop();
    };
    requestAnimationFrame(watch);
  };
  if (typeof MediaRecorder === "undefined" || !canvas.captureStream) button.hidden = true;
  button.addEventListener("click", () => (recorder === null ? begin() : stop()));
}

function escaped(text) {
  const signs = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };
  return text.replace(/[&<>"]/g, (sign) => signs[sign]);
}

// A chart as vectors: axes, ticks and lines as on the page, in its colours.
function svgOf(chart, title, colours) {
  const { width, height } = chart;
  const [left, right] = [CHART.left, width - CHART.right];
  const [top, bottom] = [CHART.top, height - CHART.bottom];
  const parts = [];
  const text = (x, y, words, anchor) => parts.push(
    `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}">${escaped(words)}</text>`,
  );
  const rows = ticks(chart.low, chart.high, 4);
  for (const value of rows) {
    const y = chart.py(value);
    parts.push(`<path d="M${left} ${y.toFixed(1)}H${right}" stroke="#e4e7ea"/>`);
    text(left - 5, y + 4, tickText(value, rows), "end");
  }
  const columns = ticks(0, chart.last, Math.max(2, Math.floor(width / 55)));
  for (const t of columns) text(chart.px(t), bottom + 14, tickText(t, columns), "middle");
  text(right, height + 12, "t [s]", "end");
  text(left, top - 12, title, "start");
  for (const { values, style, colour, dash, time = chart.time } of chart.curve.series) {
    const points = [];
    let open = false;
    for (let i = 0; i < values.length; i += 1) {
      if (Number.isFinite(values[i])) {
        const y = Math.min(bottom, Math.max(top, chart.py(values[i])));
        points.push(`${open ? "L" : "M"}${chart.px(time[i]).toFixed(1)} ${y.toFixed(1)}`);
      }
      open = Number.isFinite(values[i]);
    }
    const drawn = colour ? colours[colour] : { main: colours.line, second: colours.second, limit: colours.limit }[style];
    const gaps = dash ? dash.join(" ") : { main: "", second: "2 2", limit: "6 4" }[style];
    parts.push(`<path d="${points.join("")}" fill="none" stroke="${drawn}" stroke-width="1.4" stroke-dasharray="${gaps}"/>`);
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 -20 ${width} ${height + 40}" ` +
    `font-family="sans-serif" font-size="11">${parts.join("")}</svg>\n`;
}

// Put text on the clipboard; the button says whether it worked, then is itself again.
function copyText(button, text) {
  const before = button.dataset.name || button.textContent;
  button.dataset.name = before;
  const say = (words) => {
    button.textContent = words;
    setTimeout(() => { button.textContent = before; }, 1500);
  };
  if (!navigator.clipboard) {
    say("not allowed");
    return;
  }
  navigator.clipboard.writeText(text).then(() => say("copied"), () => say("not allowed"));
}
