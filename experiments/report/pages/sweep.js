// The page of a sweep: what is chosen decides what is drawn.

const byId = (id) => document.getElementById(id);
const FIRST = { scatter: ["travel_time_s", "min_clearance_m"], one: "travel_time_s" };

function readSweep(data) {
  const axes = data.axes.map((axis) =>
    axis.texts ? { ...axis, codes: unpack(axis.codes) } : { ...axis, values: unpack(axis.values) });
  const [status, reason] = [unpackTexts(data.status), unpackTexts(data.reason)];
  const value = (axis, row) =>
    axis.texts ? axis.texts[axis.codes[row]] : String(Number(axis.values[row].toPrecision(5)));
  return {
    ids: data.ids,
    places: data.places,
    status,
    reason,
    labels: data.label.texts,
    labelCode: unpack(data.label.codes),
    axes,
    metrics: data.metrics.map((metric) => ({ ...metric, values: unpack(metric.values) })),
    deadline: unpack(data.deadline),
    rows: data.ids.map((_, row) => row), // those that are looked at
    value,
    where: (row) => axes.flatMap((axis, k) => // a planner's own settings are in its label
      (axis.own ? [] : [(k < 2 ? "" : `${axis.name} `) + value(axis, row)])).join(", "),
  };
}

// Runs by scenario and planner; by planner alone where there is one scenario.
function groupsOf(sweep, byScenario) {
  const scenario = sweep.axes[0];
  const found = new Map();
  for (const row of sweep.rows) {
    const label = sweep.labelCode[row];
    const several = byScenario && scenario.texts.length > 1;
    const name = several
      ? `${scenario.texts[scenario.codes[row]]} · ${sweep.labels[label]}`
      : sweep.labels[label];
    if (!found.has(name)) {
      found.set(name, { name, label, scenario: several ? scenario.codes[row] : 0, rows: [] });
    }
    found.get(name).rows.push(row);
  }
  return [...found.values()].sort((a, b) => a.scenario - b.scenario || a.label - b.label);
}

// What two runs share that are a pair: everything but the planner and its own settings.
function pairKeys(sweep) {
  const others = sweep.axes.filter((axis, k) => k !== 1 && !axis.own);
  return sweep.ids.map((_, row) => others.map((axis) => sweep.value(axis, row)).join("\n"));
}

function options(select, names, first) {
  select.replaceChildren(...names.map(([value, text]) => {
    const option = document.createElement("option");
    option.value = value;
    option.textContent = text;
    return option;
  }));
  if (names.some(([value]) => value === first)) select.value = first;
}

function start(data) {
  const sweep = readSweep(data);
  let colours = theme();
  const metricNames = sweep.metrics.map((metric) => [metric.name, named(metric)]);
  const metric = (id) => sweep.metrics.find(({ name }) => name === byId(id).value);
  const axis = (id) => sweep.axes[Number(byId(id).value)];

  const there = ({ rows, ...group }, values) => {
    const kept = rows.filter((row) => Number.isFinite(values[row]));
    const five = kept.length ? fiveNumbers(kept.map((row) => values[row])) : [];
    return { ...group, rows: kept, five };
  };

  function distribution() {
    const chosen = metric("distribution-metric");
    const groups = groupsOf(sweep, true).map((group) => there(group, chosen.values));
    drawDistribution(byId("distribution"), chosen, groups, colours);
    byId("distribution-rows").replaceChildren(...groups.map((group) => {
      const tr = document.createElement("tr");
      tr.append(cell("th", group.name, "row"), cell("td", String(group.rows.length)));
      tr.append(...group.five.map((value) => cell("td", value.toFixed(chosen.digits))));
      return tr;
    }));
    const words = groups.filter(({ rows }) => rows.length).map((group) =>
      `${group.name} median ${group.five[2].toFixed(chosen.digits)}`);
    byId("distribution").setAttribute("aria-label",
      `Distribution of ${named(chosen)}: ${words.join(", ")}`);
  }

  const keys = pairKeys(sweep);

  function means() {
    const chosen = metric("means-metric");
    const scale = chosen.rate ? 100 : 1;
    const groups = groupsOf(sweep, true).map(({ rows, ...group }) => {
      const values = rows.map((row) => scale * chosen.values[row]).filter(Number.isFinite);
      return { ...group, values, stat: meanOf(values) };
    }).filter(({ values }) => values.length);
    drawMeans(byId("means"), titled(chosen), groups, colours);
    const words = groups.map(({ name, stat }) =>
      `${name} ${stat.mean.toFixed(chosen.digits)} of ${stat.n}`);
    byId("means").setAttribute("aria-label", `Mean ${titled(chosen)}: ${words.join(", ")}`);
  }

  function pairs() {
    const chosen = metric("pairs-metric");
    const base = Number(byId("pairs-base").value);
    const scale = chosen.rate ? 100 : 1;
    const first = new Map();
    for (const row of sweep.rows) {
      if (sweep.labelCode[row] === base) first.set(keys[row], chosen.values[row]);
    }
    const groups = groupsOf(sweep, true).filter(({ label }) => label !== base).map(
      ({ rows, ...group }) => {
        const values = rows.map((row) => scale * (chosen.values[row] - first.get(keys[row])))
          .filter(Number.isFinite);
        return { ...group, values, stat: meanOf(values) };
      }).filter(({ values }) => values.length);
    drawMeans(byId("pairs"), `${titled(chosen)}: minus ${sweep.labels[base]}`, groups, colours,
      { dots: true, zero: true });
    const words = groups.map(({ name, stat }) =>
      `${name} ${stat.mean.toFixed(chosen.digits)} of ${stat.n} pairs`);
    byId("pairs").setAttribute("aria-label",
      `Mean difference of ${titled(chosen)} from ${sweep.labels[base]}: ${words.join(", ") || "no pairs"}`);
  }

  function heatMap() {
    fillHeatMap(byId("heat"), metric("heat-metric"), axis("heat-x"), axis("heat-y"), sweep.rows);
  }

  const scatter = new Scatter(byId("scatter"), byId("scatter-hint"), sweep, choose);

  function drawScatter() {
    scatter.set(metric("scatter-x"), metric("scatter-y"));
    scatter.draw(colours);
    byId("lacking").textContent = scatter.lacking
      ? `${scatter.lacking} without a value, at the border` : "";
    byId("scatter").setAttribute("aria-label",
      `${named(scatter.y)} over ${named(scatter.x)}, ${scatter.points.length} runs; ` +
      "arrow keys move between runs");
  }

  function planning() {
    const chosen = metric("planning-metric");
    if (!chosen) return;
    const groups = groupsOf(sweep, true).map((group) => there(group, chosen.values));
    const deadlines = [...new Set(sweep.deadline)];
    drawHistograms(byId("planning"), chosen, groups, deadlines, colours);
    byId("planning-words").replaceChildren(...groups.map((group) => {
      const late = group.rows.filter((row) => chosen.values[row] > sweep.deadline[row]);
      const item = document.createElement("li");
      item.textContent =
        `${group.name}: above the step in ${late.length} of ${group.rows.length} runs`;
      return item;
    }));
    byId("planning").setAttribute("aria-label",
      `Histograms of ${named(chosen)} over the runs; the list counts the runs above the step`);
  }

  let before = null;
  function choose(row) {
    byId("nobody").hidden = true;
    byId("chosen").hidden = false;
    byId("chosen-where").textContent = sweep.where(row);
    byId("chosen-outcome").textContent =
      `${sweep.status(row).replaceAll("_", " ")}: ${sweep.reason(row)}`;
    byId("chosen-id").textContent = sweep.ids[row];
    const link = byId("chosen-link");
    link.href = sweep.places[row];
    link.textContent = sweep.places[row].endsWith(".html") ? "open page" : "open folder";
    byId("chosen-command").textContent = `${byId("rerun").dataset.command} ${sweep.ids[row]}`;
    const overlay = (rows) =>
      [byId("overlay").dataset.command, ...rows.map((one) => sweep.ids[one])].join(" ");
    const same = keys.flatMap((key, other) => (key === keys[row] ? [other] : []));
    const order = [...same].sort((a, b) => sweep.labelCode[a] - sweep.labelCode[b]);
    byId("overlay").hidden = byId("overlay-command").hidden = same.length < 2;
    byId("overlay-command").textContent = overlay(order);
    byId("overlay-two").hidden = before === null || before === row;
    if (before !== null) byId("overlay-two-command").textContent = overlay([before, row]);
    before = row;
  }

  const parts = { means, pairs, distribution, heat: heatMap, scatter: drawScatter, planning };
  const drawAll = () => {
    colours = theme();
    for (const draw of Object.values(parts)) draw();
  };

  for (const name of ["means", "pairs", "distribution"]) {
    options(byId(`${name}-metric`), metricNames, FIRST.one);
  }
  options(byId("pairs-base"), sweep.labels.map((label, k) => [String(k), label]), "0");
  byId("pairs-part").hidden = sweep.labels.length < 2;
  options(byId("heat-metric"), metricNames, FIRST.one);
  options(byId("scatter-x"), metricNames, FIRST.scatter[0]);
  options(byId("scatter-y"), metricNames, FIRST.scatter[1]);
  const times = metricNames.filter(([name]) => name.startsWith("planning_ms"));
  options(byId("planning-metric"), times, "planning_ms_p99");
  byId("planning-part").hidden = times.length === 0;
  const axisNames = sweep.axes.map(({ name }, k) => [String(k), name]);
  const varied = sweep.axes.flatMap((one, k) =>
    (one.texts ? one.texts.length : new Set(one.values).size) > 1 ? [String(k)] : []);
  const inner = varied.filter((k) => Number(k) > 1);
  const meant = varied.filter((k) => sweep.axes[Number(k)].name !== "seed");
  byId("heat-part").hidden = meant.length < 2; // one axis is what the means show
  wireFilters(sweep, varied.filter((k) => Number(k) !== sweep.axes.length - 1), () => drawAll());
  const places = [...inner.filter((k) => meant.includes(k)), ...meant];
  options(byId("heat-x"), axisNames, places[0] || "0");
  options(byId("heat-y"), axisNames,
    meant.find((k) => k === "1" && k !== byId("heat-x").value)
      || meant.find((k) => k !== byId("heat-x").value) || "1");
  for (const [name, draw] of Object.entries(parts)) {
    for (const select of document.querySelectorAll(`select[id^="${name}-"]`)) {
      select.addEventListener("change", draw);
    }
  }
  drawAll();
  let waiting = false;
  const later = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      drawAll();
    });
  };
  window.addEventListener("resize", later);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", later);
  drawKey(sweep, colours);
  window.rearview = { sweep, scatter, studentT }; // for the console
}

function titled(metric) {
  return metric.rate ? `${metric.label} [%]` : named(metric);
}

// A choice for each axis that varies: which runs everything below is about.
function wireFilters(sweep, varied, redraw) {
  const chosen = new Map();
  const apply = () => {
    const tests = [...chosen].filter(([, name]) => name !== "");
    const all = sweep.ids.map((_, row) => row);
    const kept = all.filter((row) =>
      tests.every(([k, name]) => sweep.cells[k].names[sweep.cells[k].cell[row]] === name));
    sweep.rows = kept;
    byId("filtered").textContent = kept.length === all.length
      ? `all ${all.length} runs` : `${kept.length} of ${all.length} runs`;
  };
  sweep.cells = Object.fromEntries(varied.map((k) => [k, cellsOf(sweep.axes[Number(k)])]));
  byId("filters").replaceChildren(...varied.map((k) => {
    const label = document.createElement("label");
    const select = document.createElement("select");
    select.id = `filter-${k}`;
    options(select, [["", "all"], ...sweep.cells[k].names.map((name) => [name, name])], "");
    select.addEventListener("change", () => {
      chosen.set(k, select.value);
      apply();
      redraw();
    });
    label.append(`${sweep.axes[Number(k)].name} `, select);
    return label;
  }));
  byId("filter-part").hidden = varied.length === 0;
  apply();
}

function drawKey(sweep, colours) {
  byId("key").replaceChildren(...sweep.labels.map((label, number) => {
    const item = document.createElement("span");
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [28, 28];
    canvas.style.width = "14px";
    canvas.style.height = "14px";
    canvas.setAttribute("aria-hidden", "true");
    const c = canvas.getContext("2d");
    c.setTransform(2, 0, 0, 2, 0, 0);
    c.fillStyle = colours[`series-${number % 6}`];
    c.strokeStyle = colours.surface;
    drawSign(c, number, 7, 7, 4);
    item.append(canvas, ` ${label}`);
    return item;
  }));
}

const found = JSON.parse(byId("data").textContent);
if (found !== null) start(found);
