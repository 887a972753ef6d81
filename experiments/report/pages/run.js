// The page of a run: scene, charts and facts follow one clock.

const FOLLOWED = 60; // metres about the ego that the view shows at first
const TURN_TIME = 0.8; // over which a camera with the heading up looks around [s]
const BOXES = {
  plan: "p", candidates: "c", ghost: "g", names: "n", measure: "m", turn: "u",
};

function start(data) {
  const run = readRun(data);
  const camera = new Camera();
  const canvas = byId("scene");
  const scene = new Scene(canvas, run);
  const shown = { follow: true, colour: "plain" };
  const ruler = new Ruler();
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
  const list = new EventList(byId("events"), byId("marks"), run.events, run.time, (step) => {
    player.playing = false;
    player.goToStep(step);
  });
  for (const chart of charts) chart.mark(run.events, phasesOf(run));
  byId("fastest").textContent = scene.fastest.toFixed(0);
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
      camera.angle = shown.turn ? smoothHeading(scene, player.t) - Math.PI / 2 : 0;
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
    const at = `${run.time[step].toFixed(1)} of ${player.end.toFixed(1)} s`;
    slider.setAttribute("aria-valuetext", at);
    byId("clock").textContent = at;
    for (const chart of charts) chart.move(step);
    facts.show(step, charts);
    list.show(step);
    if (graph) graph.draw(step, scene.colours);
  }

  const controls = {
    player, camera, shown, ruler, follow, fitAll, touch: () => { dirty = true; },
    toEvent: (way) => {
      const step = list.from(player.step, way);
      if (step === null) return;
      player.playing = false;
      player.goToStep(step);
    },
  };
  wireButtons(controls, BOXES);
  wireColour(controls);
  wireSaving(controls, run, scene, charts);
  wireKeys(controls, BOXES);
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
  window.addEventListener("hashchange", () => openAt(location.hash, player));
  for (const link of document.querySelectorAll("a.moment")) {
    link.addEventListener("click", () => {
      openAt(link.hash, player); // also if the address is that one already
      canvas.scrollIntoView({ block: "nearest" });
    });
  }
  new ResizeObserver(() => { stale = true; }).observe(canvas);
  requestAnimationFrame(frame);
  window.rearview = { run, player, camera, scene, shown, charts, ruler, ticks }; // for the console
}

// A link may name a moment and what to show: report.html#t=25&show=candidates,names
function openAt(hash, player) {
  const asked = new URLSearchParams(hash.slice(1));
  const t = Number.parseFloat(asked.get("t"));
  if (Number.isFinite(t)) player.goToStep(stepAt(player.time, t + 1e-3));
  for (const id of (asked.get("show") || "").split(",")) {
    const box = id in BOXES && byId(id);
    if (box && !box.checked) box.click();
  }
}

// The address of this page at this moment, with what is shown.
function linkTo(player) {
  const on = Object.keys(BOXES).filter((id) => byId(id) && byId(id).checked && id !== "plan");
  const show = on.length ? `&show=${on.join(",")}` : "";
  return `${location.href.split("#")[0]}#t=${Number(player.t.toFixed(3))}${show}`;
}

// The mean direction of the ego about a time: a camera that turns with it is calm.
function smoothHeading(scene, t) {
  let [x, y] = [0, 0];
  for (let k = -4; k <= 4; k += 1) {
    const { heading } = scene.egoAt(Math.max(0, t + (k * TURN_TIME) / 4));
    x += Math.cos(heading);
    y += Math.sin(heading);
  }
  return Math.atan2(y, x);
}

// The letter of the signal ahead in each step; "" on a road without signals.
function phasesOf({ signals, time }) {
  if (signals.length === 0) return "";
  return Array.from(time, (_, step) =>
    (signals.find(({ letters }) => letters[step] !== " ") || signals[0]).letters[step]).join("");
}

function wireColour({ shown, touch }) {
  byId("colour").addEventListener("change", () => {
    shown.colour = byId("colour").value;
    for (const { value } of byId("colour").options) {
      byId(`legend-${value}`).hidden = value !== shown.colour;
    }
    touch();
  });
}

function wireSaving({ player }, run, scene, charts) {
  const [name] = document.title.split(":");
  const file = (kind) => `${name.replace(/[^\w]+/g, "_")}.${kind}`;
  byId("link").addEventListener("click", () => copyText(byId("link"), linkTo(player)));
  byId("png").addEventListener("click", () => savePicture(scene.canvas, file("png")));
  byId("csv").addEventListener("click", () => {
    save(file("csv"), new Blob([csvOf(run.time, run.curves)], { type: "text/csv" }));
  });
  byId("svg").addEventListener("click", () => {
    const chart = charts[Number(byId("chart-choice").value)];
    const { title, unit } = chart.curve;
    const svg = svgOf(chart, unit ? `${title} [${unit}]` : title, scene.colours);
    save(file("svg"), new Blob([svg], { type: "image/svg+xml" }));
  });
}

if (byId("copy")) {
  byId("copy").addEventListener("click", () => {
    copyText(byId("copy"), byId("command").textContent);
  });
}
const run = JSON.parse(byId("data").textContent);
if (run !== null) start(run);
