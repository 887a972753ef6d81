// What was decided in the step shown.

const MEASURED = 40; // texts of a row whose height is tried out, the longest

class Facts {
  constructor(run, scene) {
    this.run = run;
    this.scene = scene;
    this.step = 0;
    this.charts = [];
    this.checks = namesIn(run.cycles.removed.texts);
    this.terms = namesIn(run.cycles.costs.texts);
  }

  // Rows are as tall as their longest text in this run: what plays must not jump.
  reserve() {
    const { cycles, contacts } = this.run;
    const most = cycles.candidates.reduce((a, b) => Math.max(a, b), 0);
    const texts = {
      "fact-plan": ["no plan", ...cycles.status.texts.map(spaced)],
      "fact-reason": cycles.reason.texts,
      "fact-blocker": cycles.blocker.texts,
      "fact-nearest": [...cycles.nearest.texts, ...contacts.texts.map((t) => `touched: ${t}`)],
      "fact-candidates": [`${most}, ${most} feasible`],
    };
    for (const [id, all] of Object.entries(texts)) {
      const cell = byId(id);
      if (!cell) continue;
      const shown = cell.textContent;
      cell.style.height = "";
      let tallest = 0;
      const longest = [...all].sort((a, b) => b.length - a.length).slice(0, MEASURED);
      for (const text of ["–", ...longest]) {
        cell.textContent = text;
        tallest = Math.max(tallest, cell.getBoundingClientRect().height);
      }
      cell.style.height = `${Math.ceil(tallest)}px`;
      cell.textContent = shown;
    }
  }

  show(step, charts) {
    [this.step, this.charts] = [step, charts];
    const { cycles, ego } = this.run;
    const status = cycles.status(step);
    const at = ego.s[step];
    const touched = this.run.contacts(step);
    this.write("fact-s", Number.isFinite(at) ? `${at.toFixed(1)} m` : "off the path");
    this.write("fact-speed", `${ego.speed[step].toFixed(2)} m/s`);
    this.write("fact-plan", status === "" ? "no plan" : spaced(status));
    this.write("fact-reason", cycles.reason(step) || "–");
    this.write("fact-blocker", cycles.blocker(step) || "–");
    this.write("fact-nearest", touched ? `touched: ${touched}` : cycles.nearest(step) || "–");
    const all = cycles.candidates[step];
    this.write("fact-candidates", all ? `${all}, ${cycles.survivors[step]} feasible` : "–");
    if (byId("removed")) this.list("removed", this.removed(step));
    this.list("costs", this.costs(step));
  }

  write(id, text) {
    const cell = byId(id);
    if (cell) cell.textContent = text;
  }

  // The same rows in every step, or the page would jump.
  removed(step) {
    const text = this.run.cycles.removed(step);
    const counts = text ? JSON.parse(text) : {};
    const kept = this.run.cycles.survivors[step];
    return [["kept", kept], ...this.checks.map((name) => [name, counts[name] || 0])].map(
      ([name, count]) => ({
        name: spaced(name),
        value: String(count),
        look: this.run.candidates ? this.scene.look(name) : null,
      }),
    );
  }

  costs(step) {
    const text = this.run.cycles.costs(step);
    const costs = text ? JSON.parse(text) : {};
    return this.terms.map((name) => ({
      name: spaced(name),
      value: name in costs ? (costs[name] === null ? "not finite" : String(costs[name])) : "–",
      look: null,
    }));
  }

  list(id, lines) {
    const rows = lines.map(({ name, value, look }) => {
      const row = document.createElement("tr");
      const head = document.createElement("th");
      head.scope = "row";
      if (look) head.append(swatch(look));
      head.append(name);
      const cell = document.createElement("td");
      cell.textContent = value;
      row.append(head, cell);
      return row;
    });
    byId(id).replaceChildren(...rows);
  }
}

function spaced(name) {
  return name.replaceAll("_", " ");
}

// All keys of texts that hold objects as JSON, in the order of their first text.
function namesIn(texts) {
  const all = texts.flatMap((text) => (text ? Object.keys(JSON.parse(text)) : []));
  return [...new Set(all)];
}

// The line of a legend.
function swatch({ colour, dash }) {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("width", "26");
  svg.setAttribute("height", "8");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(space, "line");
  const look = { x1: 0, x2: 24, y1: 4, y2: 4, stroke: colour, "stroke-width": 2 };
  for (const [name, value] of Object.entries(look)) line.setAttribute(name, value);
  line.setAttribute("stroke-dasharray", dash.join(" "));
  svg.append(line);
  return svg;
}
