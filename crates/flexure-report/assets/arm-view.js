/* The arm as a picture: two links, joints, motor needles and the trail of the tip, on a canvas with equal scales. */

const TRAIL_PART = 0.12; // of the motion; the rest of the tip's path is drawn faintly

class ArmView {
  constructor(canvas, arm) {
    this.canvas = canvas;
    this.arm = arm;
    this.frame = 0;
    this.gain = this.deflectionGain();
    this.tips = arm.q[0].map((_, i) => this.points(i).tip);
    this.box = this.bounds();
    this.resize();
    new ResizeObserver(() => this.resize()).observe(canvas);
    onAppearance(() => this.resize());
  }

  /** Angles at a whole or fractional sample. */
  angles(position) {
    const { q, qm } = this.arm;
    return { q: q.map((s) => between(s, position)), qm: qm.map((s) => (s.length ? between(s, position) : null)) };
  }

  /** Shoulder, elbow and tip in metres. */
  points(position) {
    const [l1, l2] = this.arm.lengths;
    const { q } = this.angles(position);
    const elbow = [l1 * Math.cos(q[0]), l1 * Math.sin(q[0])];
    const tip = [elbow[0] + l2 * Math.cos(q[0] + q[1]), elbow[1] + l2 * Math.sin(q[0] + q[1])];
    return { elbow, tip };
  }

  /** By how much the needles exaggerate the deflection, so that one can see it: 1, 2, 5, 10, ... */
  deflectionGain() {
    const { q, qm } = this.arm;
    let largest = 0;
    for (const k of [0, 1]) qm[k].forEach((m, i) => { largest = Math.max(largest, Math.abs(m - q[k][i]) || 0); });
    const available = 0.5 / largest;
    if (!(largest > 0) || available < 2) return 1;
    const power = 10 ** Math.floor(Math.log10(Math.min(available, 1000)));
    return power * [5, 2, 1].find((f) => f * power <= available);
  }

  /** A square around all the motion and the shoulder. */
  bounds() {
    const all = [[0, 0], ...this.tips, ...this.arm.q[0].map((_, i) => this.points(i).elbow)];
    const [x, y] = [0, 1].map((c) => extent(all.map((p) => p[c])));
    const half = (Math.max(x[1] - x[0], y[1] - y[0], this.arm.lengths[0]) / 2) * 1.16;
    return { middle: [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2], half };
  }

  resize() {
    const size = this.canvas.clientWidth;
    if (!(size > 0)) return;
    this.canvas.width = this.canvas.height = Math.round(size * devicePixelRatio);
    this.size = size;
    this.draw(this.frame);
  }

  draw(position) {
    this.frame = position;
    const { elbow, tip } = this.points(position);
    if (![...elbow, ...tip].every(Number.isFinite) || !this.size) return;
    const ctx = this.canvas.getContext("2d");
    const scale = this.size / 2 / this.box.half;
    const at = ([x, y]) => [this.size / 2 + (x - this.box.middle[0]) * scale, this.size / 2 - (y - this.box.middle[1]) * scale];
    ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    ctx.fillStyle = colour("--page");
    ctx.fillRect(0, 0, this.size, this.size);
    ctx.lineCap = ctx.lineJoin = "round";
    this.drawGrid(ctx, at, scale);
    this.drawTrail(ctx, at, position);
    const [s, e, t] = [at([0, 0]), at(elbow), at(tip)];
    const { q, qm } = this.angles(position);
    const width = Math.max(7, this.size / 46);
    drawBase(ctx, s, width * 3.4, width);
    stroke(ctx, [s, e], width, colour("--first"));
    stroke(ctx, [e, t], width * 0.8, colour("--second"));
    if (qm[0] != null) this.drawNeedle(ctx, s, q[0], qm[0] - q[0], this.arm.lengths[0] * scale);
    if (qm[1] != null) this.drawNeedle(ctx, e, q[0] + q[1], qm[1] - q[1], this.arm.lengths[1] * scale);
    for (const joint of [s, e]) disc(ctx, joint, width * 0.8, colour("--card"), colour("--ink"));
    disc(ctx, t, width * 0.5, colour("--ink"), colour("--card"));
  }

  drawGrid(ctx, at, scale) {
    const step = roundStep(this.size / 5 / scale);
    const { middle, half } = this.box;
    ctx.lineWidth = 1;
    ctx.strokeStyle = colour("--line");
    ctx.globalAlpha = 0.6;
    ctx.beginPath();
    for (const c of [0, 1]) {
      for (let v = Math.ceil((middle[c] - half) / step) * step; v <= middle[c] + half; v += step) {
        const p = at(c === 0 ? [v, 0] : [0, v])[c];
        ctx.moveTo(...(c === 0 ? [p, 0] : [0, p]));
        ctx.lineTo(...(c === 0 ? [p, this.size] : [this.size, p]));
      }
    }
    ctx.stroke();
    ctx.globalAlpha = 1;
    const [left, bottom] = [14, this.size - 16];
    stroke(ctx, [[left, bottom], [left + step * scale, bottom]], 2, colour("--muted"));
    ctx.font = FONT;
    ctx.fillStyle = colour("--muted");
    ctx.fillText(`${readable(step)} m`, left, bottom - 8);
  }

  drawTrail(ctx, at, position) {
    ctx.strokeStyle = colour("--error");
    ctx.lineWidth = 1;
    ctx.globalAlpha = 0.3;
    ctx.beginPath();
    for (const tip of this.tips) ctx.lineTo(...at(tip));
    ctx.stroke();
    const last = Math.floor(position);
    const length = Math.max(40, Math.round(this.tips.length * TRAIL_PART));
    const first = Math.max(0, last - length);
    const chunk = Math.max(1, Math.floor(length / 48));
    ctx.lineWidth = 2.5;
    for (let i = first; i < last; i += chunk) {
      ctx.globalAlpha = 0.85 * ((i - first + chunk) / length);
      ctx.beginPath();
      for (let j = i; j <= Math.min(i + chunk, last); j++) ctx.lineTo(...at(this.tips[j]));
      ctx.stroke();
    }
    ctx.globalAlpha = 1;
  }

  /** Where the motor stands, the deflection exaggerated by the gain, and the wedge up to the link. */
  drawNeedle(ctx, [x, y], direction, deflection, length) {
    const angle = direction + this.gain * deflection;
    const r = length * 0.42;
    ctx.fillStyle = colour("--third");
    ctx.globalAlpha = 0.28;
    ctx.beginPath();
    ctx.moveTo(x, y);
    ctx.arc(x, y, r * 0.86, -direction, -angle, angle > direction);
    ctx.fill();
    ctx.globalAlpha = 1;
    const end = [x + r * Math.cos(angle), y - r * Math.sin(angle)];
    stroke(ctx, [[x, y], end], 2.5, colour("--third"));
    disc(ctx, end, 3.5, colour("--third"), colour("--card"));
  }
}

/** The largest of 1, 2 and 5 times a power of ten that is at most `most`. */
function roundStep(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * [5, 2, 1].find((f) => f * power <= most);
}

/** A series at a fractional index, linearly between its samples. */
function between(list, position) {
  const i = Math.min(Math.max(Math.floor(position), 0), list.length - 1);
  const j = Math.min(i + 1, list.length - 1);
  const [a, b] = [list[i] ?? NaN, list[j] ?? NaN];
  return a + (b - a) * (position - i || 0);
}

function stroke(ctx, points, width, style) {
  ctx.strokeStyle = style;
  ctx.lineWidth = width;
  ctx.beginPath();
  for (const p of points) ctx.lineTo(...p);
  ctx.stroke();
}

/** The base: a box with round corners, for lines of this width. */
function drawBase(ctx, [x, y], side, width) {
  ctx.fillStyle = colour("--line");
  ctx.strokeStyle = colour("--muted");
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.roundRect(x - side / 2, y - side / 2, side, side, width * 0.6);
  ctx.fill();
  ctx.stroke();
}

function disc(ctx, [x, y], radius, fill, edge) {
  ctx.fillStyle = fill;
  ctx.strokeStyle = edge;
  ctx.lineWidth = 2;
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  ctx.fill();
  ctx.stroke();
}
