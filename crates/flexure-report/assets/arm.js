/* Playing the arm's motion: button, slider, speed, and the plots beside it with a line at the present moment. */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const WATCHABLE = 30; // seconds that a motion should at most take at the speed it starts with
const PLOTS_HEIGHT = 480; // of all the plots beside the picture together, without their legend and time axis
const FIRST_SIGHT = 0.35; // where the picture stands before anything is played, as a part of the motion

class Player {
  constructor(arm) {
    this.arm = arm;
    this.last = arm.q[0].length - 1;
    this.view = new ArmView(byId("arm-canvas"), arm);
    this.slider = byId("arm-time");
    this.button = byId("arm-play");
    this.speed = byId("arm-speed");
    this.seconds = /^s(ec.*)?$/.test(arm.time.unit);
    this.readout = this.makeReadout();
    this.plots = plotArm(arm, (t) => this.seek((t - arm.time.start) / arm.time.step));
    this.slider.max = this.last;
    this.fillSpeeds();
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    document.addEventListener("visibilitychange", () => document.hidden && this.pause());
    if (this.view.gain > 1) byId("arm-gain").textContent = `, drawn ${this.view.gain} times as large`;
    this.seek(Math.round(this.last * FIRST_SIGHT));
  }

  /** Samples a second of real time at speed 1: without a sample time, 60 samples pass in a second. */
  get rate() {
    return this.seconds ? 1 / this.arm.time.step : 60;
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
    const t = this.arm.time.start + this.position * this.arm.time.step;
    this.view.draw(this.position);
    this.slider.value = this.position;
    const decimals = Math.min(3, Math.max(0, Math.ceil(-Math.log10(this.arm.time.step))));
    const clock = `${t.toFixed(decimals)} ${this.arm.time.unit}`.trim().replace("-", "−");
    byId("arm-clock").textContent = clock;
    this.slider.setAttribute("aria-valuetext", clock);
    for (const show of this.readout) show(this.position);
    this.plots.mark(t);
  }

  /** One line a quantity below the picture; each entry updates its number. */
  makeReadout() {
    const { q, qm, tau } = this.arm;
    const degrees = (rad) => `${((rad * 180) / Math.PI).toFixed(1)}°`;
    const lines = [0, 1].flatMap((k) => [
      [["shoulder", "elbow"][k], (i) => degrees(between(q[k], i)), true],
      ["deflection", (i) => `${(1000 * (between(qm[k], i) - between(q[k], i))).toFixed(1)} mrad`, qm[k].length],
      ["torque", (i) => `${readable(tau[k][Math.floor(i)] ?? NaN, 3)} N m`, tau[k].length],
    ]);
    return lines.filter(([, , there]) => there).map(([name, value]) => {
      const row = document.createElement("span");
      const number = document.createElement("b");
      row.append(name, number);
      byId("arm-readout").append(row);
      return (i) => {
        number.textContent = value(i).replace("-", "−");
      };
    });
  }
}

/** The angles, deflections and torques; returns how to mark a moment in all of them. */
function plotArm(arm, seek) {
  const grid = { start: arm.time.start, step: arm.time.step, count: arm.q[0].length };
  const at = gridValues(grid);
  const group = gridGroup("arm", grid);
  const unit = arm.time.unit ? `${arm.time.name} (${arm.time.unit})` : arm.time.name;
  const joints = ["shoulder", "elbow"];
  const pair = (lists) => joints.map((name, k) => [name, lists[k], ["--first", "--second"][k]]).filter(([, list]) => list.length);
  const deflection = arm.q.map((q, k) => arm.qm[k].map((m, i) => (m == null || q[i] == null ? null : m - q[i])));
  const panels = [["angle (rad)", pair(arm.q)], ["deflection (rad)", pair(deflection)], ["torque (N m)", pair(arm.tau)]].filter(([, p]) => p.length);
  const heads = panels.map(([label, lists], i) => {
    const last = i + 1 === panels.length;
    const box = document.createElement("div");
    box.className = "plot";
    box.setAttribute("role", "img");
    box.setAttribute("aria-label", `${label} of the joints over time`);
    box.dataset.height = Math.round(PLOTS_HEIGHT / panels.length) + (last ? 34 : 0) + (i ? 0 : LEGEND_HEIGHT);
    byId("arm-plots").append(box);
    const u = chart(box, {
      at,
      group,
      x: { label: unit, ticks: last },
      y: { label },
      series: lists.map(([name, , colourName], k) => line(name, colourName, { width: 1.6, dash: k ? [7, 3] : undefined })),
      data: lists.map(([, list]) => list),
      legend: i === 0,
    });
    return playhead(u, seek);
  });
  let moment = at[0];
  const mark = (t) => {
    moment = t;
    for (const head of heads) head(t);
  };
  group.onWindow(() => queueMicrotask(() => mark(moment)));
  onAppearance(() => queueMicrotask(() => mark(moment)));
  return { mark };
}

/** A line over a plot at a moment, and seeking by a click; returns how to move the line. */
function playhead(u, seek) {
  const head = document.createElement("div");
  head.className = "playhead";
  u.over.append(head);
  u.over.addEventListener("click", (event) => {
    const t = u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x");
    if (!(u.select.width > 0)) seek(t);
  });
  let moment = null;
  const move = (t) => {
    moment = t;
    const left = u.valToPos(t, "x");
    const shown = left >= 0 && left <= u.over.clientWidth;
    head.style.transform = `translateX(${left - 1}px)`;
    head.style.visibility = shown ? "visible" : "hidden";
  };
  (u.hooks.setSize ??= []).push(() => moment != null && move(moment));
  return move;
}
