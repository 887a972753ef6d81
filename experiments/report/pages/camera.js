// Which part of the plane a canvas shows; metres to pixels of the page and back.

const LEAST_SCALE = 0.2; // [px/m]
const MOST_SCALE = 120;

class Camera {
  constructor() {
    this.x = 0; // in the middle of the canvas [m]
    this.y = 0;
    this.scale = 6; // [px/m]
    this.angle = 0; // of the direction that points to the right [rad]
    this.width = 1; // of the canvas [px]
    this.height = 1;
  }

  toScreen(x, y) {
    const [cos, sin] = [Math.cos(this.angle), Math.sin(this.angle)];
    const [dx, dy] = [x - this.x, y - this.y];
    return [
      this.width / 2 + (dx * cos + dy * sin) * this.scale,
      this.height / 2 - (dy * cos - dx * sin) * this.scale,
    ];
  }

  toWorld(px, py) {
    const [cos, sin] = [Math.cos(this.angle), Math.sin(this.angle)];
    const along = (px - this.width / 2) / this.scale;
    const up = -(py - this.height / 2) / this.scale;
    return [this.x + along * cos - up * sin, this.y + along * sin + up * cos];
  }

  // Let a context draw in metres; `ratio` is pixels of the canvas per pixel of the page.
  apply(context, ratio, middleX = this.width / 2, middleY = this.height / 2) {
    const scale = this.scale * ratio;
    const [cos, sin] = [Math.cos(this.angle) * scale, Math.sin(this.angle) * scale];
    context.setTransform(
      cos, sin, sin, -cos,
      ratio * middleX - this.x * cos - this.y * sin,
      ratio * middleY - this.x * sin + this.y * cos,
    );
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
    const [cos, sin] = [Math.cos(this.angle), Math.sin(this.angle)];
    this.x -= (dx * cos + dy * sin) / this.scale;
    this.y -= (dx * sin - dy * cos) / this.scale;
  }

  fit(xs, ys, margin) {
    const low = [Math.min(...xs) - margin, Math.min(...ys) - margin];
    const high = [Math.max(...xs) + margin, Math.max(...ys) + margin];
    this.angle = 0;
    this.x = (low[0] + high[0]) / 2;
    this.y = (low[1] + high[1]) / 2;
    const scale = Math.min(
      this.width / (high[0] - low[0]),
      this.height / (high[1] - low[1]),
    );
    this.scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, scale));
  }
}
