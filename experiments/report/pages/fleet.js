// The page of a run with many egos: replay, choice of one to follow, time and space.

const byId = (id) => document.getElementById(id);
const CLICK = 4; // a pointer that moves farther drags [px]
const FOLLOWED = 60; // shown ahead of and behind who is followed [m]

function readFleet(data) {
  const run = unpackAll(data);
  run.plans = data.plans && unpackAll(data.plans);
  run.after = rowsAfter({ id: run.id, ids: run.ids, start: run.start });
  run.fastest = run.speed.reduce((most, value) => (value > most ? value : most), 1);
  return run;
}

// Egos first, by id; then all others.
function fillChoice(select, run) {
  const egos = new Set();
  for (let row = 0; row < run.id.length; row += 1) {
    if (run.group[row] !== HUMAN) egos.add(run.id[row]);
  }
  const all = run.ids.map((name, number) => ({ name, number, ego: egos.has(number) }));
  for (const [label, ego] of [["egos", true], ["SUMO's", false]]) {
    const group = document.createElement("optgroup");
    group.label = label;
    for (const one of all.filter((x) => x.ego === ego)) {
      group.append(new Option(one.name, one.number));
    }
    if (group.children.length) select.append(group);
  }
}

function start(data) {
  const run = readFleet(data);
  const canvas = byId("scene");
  const camera = new Camera();
  const scene = new FleetScene(canvas, run);
  const picture = new TimeSpace(byId("time-space"), run);
  const shown = { plans: byId("plans").checked, colour: byId("colour").value };
  let [chosen, dirty, ticks] = [-1, true, 0];
  const touch = () => { dirty = true; };
  const player = new Player(run.time, touch);

  function choose(vehicle) {
    chosen = vehicle;
    byId("who").value = String(vehicle);
    if (vehicle >= 0 && camera.scale < 2) camera.scale = camera.width / (2 * FOLLOWED);
    touch();
  }

  function fitAll() {
    choose(-1);
    camera.fit(...rangesOf(run), 20);
    touch();
  }

  function resize() {
    for (const one of [canvas, byId("time-space")]) fitCanvas(one);
    [camera.width, camera.height] = [canvas.clientWidth, canvas.clientHeight];
    scene.colours = theme();
    picture.paint(scene.colours);
    touch();
  }

  function show() {
    const step = player.step;
    const row = chosen < 0 ? -1 : scene.rowOf(step, chosen);
    if (row >= 0) [camera.x, camera.y] = scene.place(row, step, player.t);
    scene.draw(camera, player.t, shown, chosen);
    picture.draw(scene.colours, player.t, chosen);
    byId("time").value = step;
    byId("clock").textContent = `${player.t.toFixed(1)} s`;
    byId("play").textContent = player.playing ? "Pause" : "Play";
    byId("fact").textContent = fact(step, row);
  }

  function fact(step, row) {
    const count = run.start[step + 1] - run.start[step];
    if (chosen < 0) return `${count} vehicles`;
    if (row < 0) return `${run.ids[chosen]}: not on the road`;
    const group = run.group[row];
    const driver = group === HUMAN ? "SUMO's driver" : run.drivers[group];
    return `${run.ids[chosen]}: ${driver}, ${run.speed[row].toFixed(1)} m/s`;
  }

  function frame(now) {
    player.tick(now);
    if (dirty) {
      dirty = false;
      show();
    }
    ticks += 1;
    requestAnimationFrame(frame);
  }

  fillChoice(byId("who"), run);
  byId("time").max = run.time.length - 1;
  byId("fastest").textContent = run.fastest.toFixed(0);
  wire({ run, canvas, camera, scene, picture, player, shown, choose, fitAll, touch });
  new ResizeObserver(resize).observe(canvas);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", resize);
  resize();
  fitAll();
  requestAnimationFrame(frame);
  window.rearview = { // for the console
    run, player, camera, scene, choose, chosen: () => chosen, ticks: () => ticks };
}

// Least and largest x and y of all vehicles.
function rangesOf(run) {
  return [rangeOf(run.x), rangeOf(run.y)];
}

function wire({ run, canvas, camera, scene, picture, player, shown, choose, fitAll, touch }) {
  const buttons = {
    play: () => player.toggle(),
    first: () => player.move(-Infinity),
    back: () => player.move(-1),
    on: () => player.move(1),
    whole: fitAll,
    "zoom-in": () => camera.zoom(1.5),
    "zoom-out": () => camera.zoom(1 / 1.5),
  };
  for (const [id, action] of Object.entries(buttons)) {
    byId(id).addEventListener("click", () => {
      action();
      touch();
    });
  }
  byId("time").addEventListener("input", () => player.goToStep(Number(byId("time").value)));
  byId("speed").addEventListener("change", () => { player.speed = Number(byId("speed").value); });
  byId("who").addEventListener("change", () => choose(Number(byId("who").value)));
  byId("colour").addEventListener("change", () => {
    shown.colour = byId("colour").value;
    touch();
  });
  byId("plans").addEventListener("change", () => {
    shown.plans = byId("plans").checked;
    touch();
  });
  const place = (event, box = event.target.getBoundingClientRect()) => [
    event.clientX - box.left, event.clientY - box.top];
  let [from, dragged] = [null, false];
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    [from, dragged] = [place(event), false];
  });
  canvas.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const at = place(event);
    if (!dragged && Math.hypot(at[0] - from[0], at[1] - from[1]) < CLICK) return;
    if (!dragged) choose(-1);
    dragged = true;
    camera.pan(at[0] - from[0], at[1] - from[1]);
    from = at;
    touch();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (from !== null && !dragged) {
      const reach = 6 + 10 / camera.scale;
      choose(scene.nearest(player.t, ...camera.toWorld(...place(event)), reach));
    }
    from = null;
  });
  canvas.addEventListener("pointercancel", () => { from = null; });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(-event.deltaY / 400), ...place(event));
    touch();
  }, { passive: false });
  byId("time-space").addEventListener("click", (event) => {
    const { t, vehicle } = picture.at(...place(event));
    player.playing = false;
    player.go(t);
    choose(vehicle);
  });
  document.querySelectorAll("#events button").forEach((button, number) => {
    button.addEventListener("click", () => {
      const end = run.ends[number];
      player.playing = false;
      player.go(end.time);
      choose(run.ids.indexOf(end.id));
    });
  });
  const keys = {
    " ": () => player.toggle(), ArrowLeft: () => player.move(-1), ArrowRight: () => player.move(1),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !(event.key in keys)) return;
    if (/^(INPUT|SELECT|BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return;
    event.preventDefault();
    keys[event.key]();
    touch();
  });
}

if (byId("copy")) {
  byId("copy").addEventListener("click", () => {
    navigator.clipboard.writeText(byId("command").textContent);
  });
}
const content = JSON.parse(byId("data").textContent);
if (content !== null) start(content);
