// The page of a run: scene, charts and facts follow one clock.

const byId = (id) => document.getElementById(id);
const FOLLOWED = 60; // metres about the ego that the view shows at first
const PAN = 60; // of one key press [px]
const MEASURED = 40; // texts of a row whose height is tried out, the longest

function start(data) {
  const run = readRun(data);
  const camera = new Camera();
  const canvas = byId("scene");
  const scene = new Scene(canvas, run);
  const shown = { follow: true, plan: true, candidates: false, ghost: false, names: false };
  let [dirty, stale] = [true, true]; // the scene; its size and colours, and the charts
  const player = new Player(run.time, () => { dirty = true; });
  const charts = [...document.querySelectorAll("figure.chart")].map(
    (figure, number) =>
      new Chart(figure, run.curves[number], run.time, (step) => {
        player.playing = false;
        player.goToStep(step);
      }),
  );
  const facts = new Facts(run, scene);
  const graph = run.graphs && new SpeedGraph(byId("graph"), run.graphs);
  const slider = byId("time");
  slider.max = run.time.length - 1;
  byId("clock").style.minWidth = `${2 * player.end.toFixed(1).length + 7}ch`;

  function fitAll() {
    const xs = Array.from(run.ego.x).filter(Number.isFinite);
    const ys = Array.from(run.ego.y).filter(Number.isFinite);
    camera.fit(xs, ys, 15);
    follow(false);
  }

  function follow(on) {
    shown.follow = on;
    byId("follow").checked = on;
    dirty = true;
  }

  function resize() {
    const { width, height } = fitCanvas(canvas);
    [camera.width, camera.height] = [width, height];
    scene.colours = theme();
    for (const chart of charts) chart.draw(scene.colours);
    facts.reserve();
    facts.recolour();
    if (graph) graph.draw(player.step, scene.colours);
    dirty = true;
  }

  function frame(now) {
    player.tick(now);
    if (stale) {
      stale = false;
      resize();
    }
    if (dirty) {
      dirty = false;
      show();
    }
    requestAnimationFrame(frame);
  }

  let before = -1;
  function show() {
    if (shown.follow) {
      const ego = scene.egoAt(player.t);
      [camera.x, camera.y] = [ego.x, ego.y];
    }
    scene.draw(camera, player.t, shown);
    byId("play").textContent = player.playing ? "Pause" : "Play";
    byId("speed").value = String(player.speed);
    const { step } = player;
    if (step === before) return;
    before = step;
    slider.value = step;
    const at = `${run.time[step].toFixed(1)} of ${player.end.toFixed(1)} s`;
    slider.setAttribute("aria-valuetext", at);
    byId("clock").textContent = at;
    for (const chart of charts) chart.move(step);
    facts.show(step, charts);
    if (graph) graph.draw(step, scene.colours);
  }

  const controls = { player, camera, shown, follow, fitAll, touch: () => { dirty = true; } };
  wireButtons(controls);
  wireKeys(controls);
  wirePointer(canvas, scene, controls);
  slider.addEventListener("input", () => {
    player.playing = false;
    player.goToStep(Number(slider.value));
  });
  window.addEventListener("resize", () => { stale = true; });
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => { stale = true; });
  const { width, height } = fitCanvas(canvas);
  [camera.width, camera.height] = [width, height];
  camera.scale = Math.min(width, 2.2 * height) / (2 * FOLLOWED);
  openAt(location.hash, player);
  requestAnimationFrame(frame);
  window.rearview = { run, player, camera, scene, shown, ticks }; // for the console
}

// A link may name a moment and what to show: report.html#t=25&show=candidates,names
function openAt(hash, player) {
  const asked = new URLSearchParams(hash.slice(1));
  const t = Number.parseFloat(asked.get("t"));
  if (Number.isFinite(t)) player.goToStep(stepAt(player.time, t + 1e-3));
  for (const id of (asked.get("show") || "").split(",")) {
    const box = ["plan", "candidates", "ghost", "names"].includes(id) && byId(id);
    if (box && !box.checked) box.click();
  }
}

function wireButtons({ player, camera, shown, follow, fitAll, touch }) {
  const actions = {
    play: () => player.toggle(),
    back: () => player.move(-1),
    on: () => player.move(1),
    first: () => player.move(-Infinity),
    "zoom-in": () => camera.zoom(1.5),
    "zoom-out": () => camera.zoom(1 / 1.5),
    whole: fitAll,
  };
  for (const [id, action] of Object.entries(actions)) {
    byId(id).addEventListener("click", () => {
      action();
      touch();
    });
  }
  byId("follow").addEventListener("change", () => follow(byId("follow").checked));
  for (const id of ["plan", "candidates", "ghost", "names"]) {
    const box = byId(id);
    if (!box) continue;
    shown[id] = box.checked; // a browser may have kept it from a visit before
    box.addEventListener("change", () => {
      shown[id] = box.checked;
      touch();
    });
  }
  byId("speed").addEventListener("change", () => {
    player.speed = Number(byId("speed").value);
  });
}

function wireKeys({ player, camera, shown, follow, fitAll, touch }) {
  const flip = (id) => () => {
    if (byId(id)) byId(id).click();
  };
  const pan = (dx, dy) => () => {
    follow(false);
    camera.pan(dx, dy);
  };
  const second = Math.max(1, Math.round(1 / (player.time[1] - player.time[0] || 1)));
  const keys = {
    " ": () => player.toggle(),
    ArrowLeft: () => player.move(-1),
    ArrowRight: () => player.move(1),
    "Shift+ArrowLeft": () => player.move(-second),
    "Shift+ArrowRight": () => player.move(second),
    Home: () => player.move(-Infinity),
    End: () => player.move(Infinity),
    "[": () => player.faster(-1),
    "]": () => player.faster(1),
    "+": () => camera.zoom(1.25),
    "=": () => camera.zoom(1.25),
    "-": () => camera.zoom(1 / 1.25),
    0: fitAll,
    w: pan(0, PAN),
    s: pan(0, -PAN),
    a: pan(PAN, 0),
    d: pan(-PAN, 0),
    f: () => follow(!shown.follow),
    p: flip("plan"),
    c: flip("candidates"),
    g: flip("ghost"),
    n: flip("names"),
  };
  const own = { INPUT: true, SELECT: true, TEXTAREA: true };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { target } = event;
    const letter = event.key.length === 1 && event.key !== " ";
    const box = target.type === "checkbox";
    if (own[target.tagName] && !(box && event.key !== " ") && !letter) return;
    if (target.tagName === "SELECT") return;
    if (event.key === " " && /^(BUTTON|SUMMARY|A)$/.test(target.tagName)) return;
    const turned = event.shiftKey && event.key.startsWith("Arrow");
    const action = keys[turned ? `Shift+${event.key}` : event.key];
    if (!action) return;
    event.preventDefault();
    action();
    touch();
  });
}

// Drag to pan, wheel or two fingers to zoom, rest on a body to see what it is.
function wirePointer(canvas, scene, { player, camera, follow, touch }) {
  const fingers = new Map();
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = () => {
    const [one, other] = [...fingers.values()];
    return Math.hypot(one[0] - other[0], one[1] - other[1]);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, place(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const at = place(event);
    const was = fingers.get(event.pointerId);
    if (!was) {
      hint(scene, camera, player.t, at);
      return;
    }
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, at);
    if (fingers.size === 2) camera.zoom(spread() / Math.max(before, 1));
    else if (Math.hypot(at[0] - was[0], at[1] - was[1]) > 0) {
      follow(false);
      camera.pan(at[0] - was[0], at[1] - was[1]);
    }
    touch();
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("pointerleave", () => { byId("hint").hidden = true; });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const at = byId("follow").checked ? [camera.width / 2, camera.height / 2] : place(event);
    camera.zoom(Math.exp(-event.deltaY / 400), ...at);
    touch();
  }, { passive: false });
}

function hint(scene, camera, t, at) {
  const box = byId("hint");
  const body = scene.bodyAt(t, ...camera.toWorld(...at));
  box.hidden = body === null;
  if (body === null) return;
  const size = body.length ? `, ${body.length.toFixed(1)} × ${body.width.toFixed(1)} m` : "";
  const speed = body.speed === undefined ? "" : `: ${body.speed.toFixed(1)} m/s`;
  box.textContent = body.id + speed + size;
  const left = Math.min(at[0] + 14, camera.width - box.offsetWidth - 4);
  box.style.left = `${Math.max(4, left)}px`;
  box.style.top = `${Math.min(at[1] + 14, camera.height - box.offsetHeight - 4)}px`;
}

// What was decided in the step shown.
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

  recolour() {
    if (this.charts.length) this.show(this.step, this.charts);
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

function wireCopy() {
  const button = byId("copy");
  if (!button) return;
  button.addEventListener("click", () => {
    const done = () => { button.textContent = "copied"; };
    const failed = () => { button.textContent = "select it and copy"; };
    if (navigator.clipboard) {
      navigator.clipboard.writeText(byId("command").textContent).then(done, failed);
    } else failed();
  });
}

wireCopy();
const run = JSON.parse(byId("data").textContent);
if (run !== null) start(run);
