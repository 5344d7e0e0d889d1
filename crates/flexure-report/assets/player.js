/* Playing a motion: button, slider and speed; the picture and what else shows the present moment follow. */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const WATCHABLE = 30; // seconds that a motion should at most take at the speed it starts with
const FIRST_SIGHT = 0.35; // where the picture stands before anything is played, as a part of the motion

class Player {
  /** Plays a motion whose last sample is `last`: `show` is called with a whole or fractional sample and with its time. */
  constructor(time, last, show) {
    Object.assign(this, { time, last, show });
    this.slider = byId("arm-time");
    this.button = byId("arm-play");
    this.speed = byId("arm-speed");
    this.seconds = /^s(ec.*)?$/.test(time.unit);
    this.slider.max = this.last;
    this.fillSpeeds();
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    document.addEventListener("visibilitychange", () => document.hidden && this.pause());
    this.seek(Math.round(this.last * FIRST_SIGHT));
  }

  /** Samples a second of real time at speed 1: without a sample time, 60 samples pass in a second. */
  get rate() {
    return this.seconds ? 1 / this.time.step : 60;
  }

  fillSpeeds() {
    const start = SPEEDS.find((s) => s >= 1 && this.last / this.rate / s <= WATCHABLE) ?? SPEEDS.at(-1);
    for (const s of SPEEDS) this.speed.add(new Option(`${s}×`, s, s === start, s === start));
  }

  play() {
    if (this.position >= this.last) this.seek(0);
    this.playing = true;
    this.showState();
    let before = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      // A tab that was away must not make the arm jump.
      const passed = Math.min(Math.max(now - before, 0), 100) / 1000;
      before = now;
      this.seek(this.position + passed * Number(this.speed.value) * this.rate);
      if (this.position >= this.last) this.pause();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    this.showState();
  }

  showState() {
    this.button.setAttribute("aria-pressed", String(Boolean(this.playing)));
    this.button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  /** Shows the motion at a whole or fractional sample. */
  seek(position) {
    this.position = Math.min(Math.max(position, 0), this.last);
    const { start, step, unit } = this.time;
    const t = start + this.position * step;
    this.slider.value = this.position;
    const decimals = Math.min(3, Math.max(0, Math.ceil(-Math.log10(step))));
    const clock = `${t.toFixed(decimals)} ${unit}`.trim().replace("-", "−");
    byId("arm-clock").textContent = clock;
    this.slider.setAttribute("aria-valuetext", clock);
    this.show(this.position, t);
  }

  /** Shows the motion at a time. */
  seekTime(t) {
    this.seek((t - this.time.start) / this.time.step);
  }
}
