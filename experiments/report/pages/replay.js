// What the page of a run and that of several runs share: one clock for a scene, its
// charts and the list of events, and the controls about them.

const FOLLOWED = 60; // metres about the ego that the view shows at first
const TURN_TIME = 0.8; // over which a camera with the heading up looks around [s]

// `page` says what differs:
//   time, events       of the clock's steps
//   scene, boxes       what is drawn, and its check boxes: id -> key
//   shown              what of it at first
//   egoAt(t)           whom the view follows
//   extent()           [xs, ys] of everything that is driven
//   makeChart(figure, number, onScrub)
//   onStep(step, charts), onResize(colours)
//   file               stem of the names of files
function startReplay(page) {
  const { time, events, scene, shown } = page;
  const camera = new Camera();
  const { canvas } = scene;
  const ruler = new Ruler(byId("measured"));
  let [dirty, stale] = [true, true]; // the scene; its size and colours, and the charts
  const touch = () => { dirty = true; };
  const player = new Player(time, touch);
  const goTo = (step) => {
    player.playing = false;
    player.goToStep(step);
  };
  const list = new EventList(byId("events"), byId("marks"), events, time, goTo);
  const charts = [...document.querySelectorAll("figure.chart")].map((figure, number) =>
    page.makeChart(figure, number, goTo));
  const slider = byId("time");
  slider.max = time.length - 1;
  byId("clock").style.minWidth = `${2 * player.end.toFixed(1).length + 7}ch`;

  function fitAll() {
    camera.fit(...page.extent().map((all) => all.filter(Number.isFinite)), 15);
    follow(false);
  }

  function follow(on) {
    shown.follow = on;
    byId("follow").checked = on;
    touch();
  }

  function resize() {
    const { width, height } = fitCanvas(canvas);
    [camera.width, camera.height] = [width, height];
    scene.colours = theme();
    for (const chart of charts) chart.draw(scene.colours);
    page.onResize(scene.colours);
    page.onStep(player.step, charts);
    touch();
  }

  let before = -1;
  function show() {
    if (shown.follow) {
      const ego = page.egoAt(player.t);
      [camera.x, camera.y] = [ego.x, ego.y];
      camera.angle = shown.turn ? smoothHeading(page.egoAt, player.t) - Math.PI / 2 : 0;
    }
    ruler.turn(Boolean(shown.measure), camera);
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
    page.onStep(step, charts);
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
    player, camera, shown, ruler, follow, fitAll, touch,
    toEvent: (way) => {
      const step = list.from(player.step, way);
      if (step !== null) goTo(step);
    },
  };
  wireButtons(controls, page.boxes);
  wireColour(controls);
  wireSaving(controls, page, charts);
  wireKeys(controls, page.boxes);
  wirePointer(canvas, scene, controls);
  wireSplitters();
  slider.addEventListener("input", () => goTo(Number(slider.value)));
  const refit = () => { stale = true; };
  window.addEventListener("resize", refit);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refit);
  new ResizeObserver(refit).observe(canvas);
  const { width, height } = fitCanvas(canvas);
  [camera.width, camera.height] = [width, height];
  camera.scale = Math.min(width, 2.2 * height) / (2 * FOLLOWED);
  const open = () => openAt(location.hash, player, page.boxes);
  open();
  window.addEventListener("hashchange", open);
  for (const link of document.querySelectorAll("a.moment")) {
    link.addEventListener("click", () => {
      openAt(link.hash, player, page.boxes); // also if the address is that one already
      canvas.scrollIntoView({ block: "nearest" });
    });
  }
  requestAnimationFrame(frame);
  return { player, camera, scene, shown, charts, ruler, events, ticks };
}

// A link may name a moment and what to show: report.html#t=25&show=candidates,names
function openAt(hash, player, boxes) {
  const asked = new URLSearchParams(hash.slice(1));
  const t = Number.parseFloat(asked.get("t"));
  if (Number.isFinite(t)) {
    player.playing = false;
    player.goToStep(stepAt(player.time, t + 1e-3));
  }
  for (const id of (asked.get("show") || "").split(",")) {
    const box = id in boxes && byId(id);
    if (box && !box.checked) box.click();
  }
}

// The address of this page at this moment, with what is shown.
function linkTo(player, boxes) {
  const on = Object.keys(boxes).filter((id) => byId(id) && byId(id).checked && id !== "plan");
  const show = on.length ? `&show=${on.join(",")}` : "";
  return `${location.href.split("#")[0]}#t=${Number(player.t.toFixed(3))}${show}`;
}

// The mean direction of an ego about a time: a camera that turns with it is calm.
function smoothHeading(egoAt, t) {
  let [x, y] = [0, 0];
  for (let k = -4; k <= 4; k += 1) {
    const { heading } = egoAt(Math.max(0, t + (k * TURN_TIME) / 4));
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
  const apply = () => {
    shown.colour = byId("colour").value;
    for (const { value } of byId("colour").options) {
      byId(`legend-${value}`).hidden = value !== shown.colour;
    }
    touch();
  };
  byId("colour").addEventListener("change", apply);
  apply();
}

function wireSaving({ player }, { scene, boxes, file, time }, charts) {
  const put = (kind, content, type) => save(`${file}.${kind}`, new Blob([content], { type }));
  byId("link").addEventListener("click", () => copyText(byId("link"), linkTo(player, boxes)));
  byId("png").addEventListener("click", () => savePicture(scene.canvas, `${file}.png`));
  byId("csv").addEventListener("click", () =>
    put("csv", csvOf(time, charts.map(({ curve }) => curve)), "text/csv"));
  byId("svg").addEventListener("click", () => {
    const chart = charts[Number(byId("chart-choice").value)];
    const { title, unit } = chart.curve;
    put("svg", svgOf(chart, unit ? `${title} [${unit}]` : title, scene.colours), "image/svg+xml");
  });
  wireFilm(byId("film"), scene.canvas, file, player);
}

// Bars between panels: dragged, or moved by the arrow keys; a double click undoes it.
function wireSplitters() {
  const box = document.querySelector(".scene-box");
  const stage = document.querySelector(".stage");
  const splitters = [
    ["taller", "y", (by) => {
      const height = Math.max(160, box.offsetHeight + by);
      box.style.height = `${height}px`;
      return height;
    }, () => { box.style.height = ""; }],
    ["wider", "x", (by) => {
      const side = stage.querySelector(".events").offsetWidth - by;
      const width = Math.min(stage.clientWidth / 2, Math.max(160, side));
      stage.style.setProperty("--side", `${width}px`);
      return width;
    }, () => { stage.style.removeProperty("--side"); }],
  ];
  for (const [id, axis, move, undo] of splitters) {
    const bar = byId(id);
    const by = (pixels) => bar.setAttribute("aria-valuenow", String(Math.round(move(pixels))));
    by(0);
    undo();
    const place = (event) => (axis === "y" ? event.clientY : event.clientX);
    let last = null;
    bar.addEventListener("pointerdown", (event) => {
      bar.setPointerCapture(event.pointerId);
      last = place(event);
    });
    bar.addEventListener("pointermove", (event) => {
      if (last === null) return;
      by(place(event) - last);
      last = place(event);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      bar.addEventListener(name, () => { last = null; });
    }
    bar.addEventListener("dblclick", undo);
    const [less, more] = axis === "y" ? ["ArrowUp", "ArrowDown"] : ["ArrowLeft", "ArrowRight"];
    bar.addEventListener("keydown", (event) => {
      const way = { [less]: -1, [more]: 1 }[event.key];
      if (!way) return;
      event.preventDefault();
      event.stopPropagation(); // these keys step through time elsewhere
      by(20 * way);
    });
  }
}
