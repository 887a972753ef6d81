// The page of several runs: scene, charts and events follow one clock.

const BOXES = { plan: "p", names: "n", measure: "m", apart: "b" };
const FOLLOWED = 60; // metres about the ego that the view shows at first

function start(data) {
  const runs = data.runs.map((one) => ({ ...readRun(one), label: one.label }));
  const { time } = runs.reduce((longest, run) =>
    (run.time[run.time.length - 1] > longest.time[longest.time.length - 1] ? run : longest));
  const camera = new Camera();
  const canvas = byId("scene");
  const scene = new OverlaidScene(canvas, runs);
  const shown = { follow: true, traffic: runs.map(() => true), followed: 0 };
  const ruler = new Ruler();
  let [dirty, stale] = [true, true];
  const player = new Player(time, () => { dirty = true; });
  const goTo = (step) => {
    player.playing = false;
    player.goToStep(step);
  };
  const stepOf = (t) => stepAt(time, t + 1e-4);
  const events = data.events.map((event) => ({
    ...event,
    step: stepOf(event.time),
    until: event.until === null ? null : stepOf(event.until),
  }));
  const list = new EventList(byId("events"), byId("marks"), events, time, goTo);
  const charts = [...document.querySelectorAll("figure.chart")].map((figure, number) => {
    const chart = new OverlaidChart(figure, overlaidCurve(runs, number), time, goTo);
    chart.mark(events.filter(({ gravity }) => gravity !== "note"), "");
    chart.readout.style.minWidth = "0"; // it has a line of its own
    return chart;
  });
  const slider = byId("time");
  slider.max = time.length - 1;
  byId("clock").style.minWidth = `${2 * player.end.toFixed(1).length + 7}ch`;

  function fitAll() {
    const all = (name) => runs.flatMap((run) => Array.from(run.ego[name]).filter(Number.isFinite));
    camera.fit(all("x"), all("y"), 15);
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
    dirty = true;
  }

  let before = -1;
  function show() {
    if (shown.follow) {
      const ego = scene.egoAt(player.t, shown.followed);
      [camera.x, camera.y] = [ego.x, ego.y];
    }
    ruler.on = Boolean(shown.measure);
    const ratio = scene.draw(camera, player.t, shown);
    ruler.draw(scene.context, camera, ratio, scene.colours);
    byId("play").textContent = player.playing ? "Pause" : "Play";
    byId("speed").value = String(player.speed);
    const { step } = player;
    if (step === before) return;
    before = step;
    slider.value = step;
    const at = `${time[step].toFixed(1)} of ${player.end.toFixed(1)} s`;
    slider.setAttribute("aria-valuetext", at);
    byId("clock").textContent = at;
    for (const chart of charts) chart.move(step);
    list.show(step);
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

  const controls = {
    player, camera, shown, ruler, follow, fitAll, touch: () => { dirty = true; },
    toEvent: (way) => {
      const step = list.from(player.step, way);
      if (step !== null) goTo(step);
    },
  };
  wireButtons(controls, BOXES);
  wireKeys(controls, BOXES);
  wirePointer(canvas, scene, controls);
  wireRuns(controls);
  wireFiles(player, scene, charts);
  slider.addEventListener("input", () => goTo(Number(slider.value)));
  window.addEventListener("resize", () => { stale = true; });
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => { stale = true; });
  const { width, height } = fitCanvas(canvas);
  [camera.width, camera.height] = [width, height];
  camera.scale = Math.min(width, 2.2 * height) / (2 * FOLLOWED);
  openAt(location.hash, player);
  window.addEventListener("hashchange", () => openAt(location.hash, player));
  for (const link of document.querySelectorAll("a.moment")) {
    link.addEventListener("click", () => openAt(link.hash, player));
  }
  new ResizeObserver(() => { stale = true; }).observe(canvas);
  requestAnimationFrame(frame);
  window.rearview = { runs, player, camera, scene, shown, charts, events }; // for the console
}

function openAt(hash, player) {
  const asked = new URLSearchParams(hash.slice(1));
  const t = Number.parseFloat(asked.get("t"));
  if (!Number.isFinite(t)) return;
  player.playing = false;
  player.goToStep(stepAt(player.time, t + 1e-3));
}

// Whose traffic is shown, and which ego the view follows.
function wireRuns({ shown, touch }) {
  for (const box of document.querySelectorAll("input[data-traffic]")) {
    const number = Number(box.dataset.traffic);
    shown.traffic[number] = box.checked;
    box.addEventListener("change", () => {
      shown.traffic[number] = box.checked;
      touch();
    });
  }
  byId("followed").addEventListener("change", () => {
    shown.followed = Number(byId("followed").value);
    touch();
  });
}

function wireFiles(player, scene, charts) {
  byId("link").addEventListener("click", () => {
    copyText(byId("link"), `${location.href.split("#")[0]}#t=${Number(player.t.toFixed(3))}`);
  });
  byId("png").addEventListener("click", () => savePicture(scene.canvas, "comparison.png"));
  byId("svg").addEventListener("click", () => {
    const chart = charts[Number(byId("chart-choice").value)];
    const { title, unit } = chart.curve;
    const svg = svgOf(chart, unit ? `${title} [${unit}]` : title, scene.colours);
    save("comparison.svg", new Blob([svg], { type: "image/svg+xml" }));
  });
}

start(JSON.parse(byId("data").textContent));
