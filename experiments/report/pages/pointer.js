// What a pointer does over the scene: pan, zoom, measure, rest on a body.

// Drag to pan (or to measure), wheel or two fingers to zoom, rest to see what a body is.
function wirePointer(canvas, scene, { player, camera, ruler, follow, touch }) {
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
    if (ruler.on) ruler.begin(camera.toWorld(...place(event)));
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
    else if (ruler.on) ruler.end(camera.toWorld(...at));
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

// A distance between two places, drawn over the scene. By hand it is dragged; by keys its
// ends are where the middle of the view is.
class Ruler {
  constructor(output) {
    this.output = output;
    this.on = false;
    this.ends = null;
    this.open = false; // whether the middle of the view is its second end
  }

  // Whether it is measured at all; without a drag, a cross says where an end would be.
  turn(on, camera) {
    this.on = on;
    if (!on) [this.ends, this.open] = [null, false];
    if (this.open) this.ends[1] = [camera.x, camera.y];
    this.output.hidden = !on || !this.ends;
    if (!this.output.hidden) this.output.textContent = `${this.length.toFixed(2)} m`;
  }

  get length() {
    const [[x0, y0], [x1, y1]] = this.ends;
    return Math.hypot(x1 - x0, y1 - y0);
  }

  // Put the first end, or the second one, where the view's middle is.
  put({ x, y }) {
    if (!this.on) return;
    if (this.open) this.open = false;
    else {
      this.ends = [[x, y], [x, y]];
      this.open = true;
    }
  }

  begin(place) {
    this.ends = [place, place];
    this.open = false;
  }

  end(place) {
    if (this.ends) this.ends[1] = place;
  }

  draw(c, camera, ratio, colours) {
    if (!this.on) return;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.setLineDash([]);
    c.strokeStyle = colours.accent;
    c.lineWidth = 1;
    const [x, y] = [camera.width / 2, camera.height / 2];
    c.beginPath();
    for (const [dx, dy] of [[10, 0], [0, 10]]) {
      c.moveTo(x - dx, y - dy);
      c.lineTo(x + dx, y + dy);
    }
    c.stroke();
    if (!this.ends) return;
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(...camera.toScreen(...this.ends[0]));
    c.lineTo(...camera.toScreen(...this.ends[1]));
    c.stroke();
  }
}
