// Which part of the plane a canvas shows; metres to pixels of the page and back.

const LEAST_SCALE = 0.2; // [px/m]
const MOST_SCALE = 120;

class Camera {
  constructor() {
    this.x = 0; // in the middle of the canvas [m]
    this.y = 0;
    this.scale = 6; // [px/m]
    this.width = 1; // of the canvas [px]
    this.height = 1;
  }

  toScreen(x, y) {
    return [
      this.width / 2 + (x - this.x) * this.scale,
      this.height / 2 - (y - this.y) * this.scale,
    ];
  }

  toWorld(px, py) {
    return [
      this.x + (px - this.width / 2) / this.scale,
      this.y - (py - this.height / 2) / this.scale,
    ];
  }

  // Zoom so that what is under a pixel stays there.
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.toWorld(px, py);
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, this.scale * factor));
    const [movedX, movedY] = this.toWorld(px, py);
    this.x += x - movedX;
    this.y += y - movedY;
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  fit(xs, ys, margin) {
    const low = [Math.min(...xs) - margin, Math.min(...ys) - margin];
    const high = [Math.max(...xs) + margin, Math.max(...ys) + margin];
    this.x = (low[0] + high[0]) / 2;
    this.y = (low[1] + high[1]) / 2;
    const scale = Math.min(
      this.width / (high[0] - low[0]),
      this.height / (high[1] - low[1]),
    );
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, scale));
  }
}
