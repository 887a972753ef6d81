// Buttons and keys of a replay. `boxes` are its check boxes: id -> key.

const byId = (id) => document.getElementById(id);
const PAN = 60; // of one key press [px]

function wireButtons({ player, camera, shown, follow, fitAll, toEvent, touch }, boxes) {
  const actions = {
    play: () => player.toggle(),
    back: () => player.move(-1),
    on: () => player.move(1),
    first: () => player.move(-Infinity),
    "zoom-in": () => camera.zoom(1.5),
    "zoom-out": () => camera.zoom(1 / 1.5),
    whole: fitAll,
    "event-before": () => toEvent(-1),
    "event-after": () => toEvent(1),
  };
  for (const [id, action] of Object.entries(actions)) {
    byId(id).addEventListener("click", () => {
      action();
      touch();
    });
  }
  byId("follow").addEventListener("change", () => follow(byId("follow").checked));
  for (const id of Object.keys(boxes)) {
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

function wireKeys({ player, camera, shown, ruler, follow, fitAll, toEvent, touch }, boxes) {
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
    Enter: () => ruler.put(camera),
    0: fitAll,
    w: pan(0, PAN),
    s: pan(0, -PAN),
    a: pan(PAN, 0),
    d: pan(-PAN, 0),
    f: () => follow(!shown.follow),
    l: () => byId("link").click(),
    ",": () => toEvent(-1),
    ".": () => toEvent(1),
  };
  for (const [id, key] of Object.entries(boxes)) keys[key] = flip(id);
  const own = { INPUT: true, SELECT: true, TEXTAREA: true };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { target } = event;
    const letter = event.key.length === 1 && event.key !== " ";
    const box = target.type === "checkbox";
    if (own[target.tagName] && !(box && event.key !== " ") && !letter) return;
    if (target.tagName === "SELECT") return;
    if (/^( |Enter)$/.test(event.key) && /^(BUTTON|SUMMARY|A)$/.test(target.tagName)) return;
    if (event.key === "Enter" && !shown.measure) return;
    const turned = event.shiftKey && event.key.startsWith("Arrow");
    const action = keys[turned ? `Shift+${event.key}` : event.key];
    if (!action) return;
    event.preventDefault();
    action();
    touch();
  });
}
