// The clock of the replay.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

class Player {
  constructor(time, onChange) {
    this.time = time;
    this.onChange = onChange;
    this.t = time[0];
    this.playing = false;
    this.speed = 1;
    this.last = null; // of the browser's clock when it was last looked at [ms]
  }

  get step() {
    return stepAt(this.time, this.t);
  }

  get end() {
    return this.time[this.time.length - 1];
  }

  go(t) {
    this.t = Math.min(this.end, Math.max(this.time[0], t));
    this.onChange();
  }

  goToStep(step) {
    this.go(this.time[Math.min(this.time.length - 1, Math.max(0, step))]);
  }

  // Whole steps; what plays is paused.
  move(steps) {
    this.playing = false;
    this.goToStep(this.step + steps);
  }

  toggle() {
    if (!this.playing && this.t >= this.end) this.t = this.time[0];
    this.playing = !this.playing;
    this.last = null;
    this.onChange();
  }

  faster(by) {
    const at = SPEEDS.indexOf(this.speed) + by;
    this.speed = SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at))];
    this.onChange();
  }

  // Go on with the browser's clock; a tab that slept does not jump.
  tick(now) {
    if (!this.playing) return;
    const passed = this.last === null ? 0 : Math.min(now - this.last, 250) / 1000;
    this.last = now;
    this.t += passed * this.speed;
    if (this.t >= this.end) {
      this.t = this.end;
      this.playing = false;
    }
    this.onChange();
  }
}
