/* A chain as a picture in space: links, joints, the base and the paths of the ends, on a canvas; dragging turns it. */

const CHAIN_HEIGHT = 0.62; // of the picture, as a share of its width; on a phone it is square
const FLAT = 0.03; // a motion lies in a plane if its extent across the plane is below this share of its largest extent
const STEEPEST = Math.PI / 2;

class ChainView {
  constructor(canvas, chain) {
    this.canvas = canvas;
    this.chain = chain;
    this.frame = 0;
    const carrying = new Set(chain.lines.map(([from]) => from));
    this.ends = chain.lines.map(([, to]) => to).filter((to) => !carrying.has(to));
    this.measure();
    this.turnAtFirst();
    this.resize();
    new ResizeObserver(() => this.resize()).observe(canvas);
    onAppearance(() => this.resize());
    this.listen();
  }

  /** A box around all the motion. */
  measure() {
    const all = this.chain.points.flat();
    const ranges = [0, 1, 2].map((c) => extent(all.map((p) => p[c])));
    this.middle = ranges.map(([low, high]) => (low + high) / 2);
    this.size3 = ranges.map(([low, high]) => high - low);
    this.radius = Math.max(...all.map((p) => Math.hypot(...p.map((x, c) => x - this.middle[c]))), 1e-9);
  }

  /** A motion in a plane is seen from its side, any other from above and aside. */
  turnAtFirst() {
    const [x, y, z] = this.size3;
    const flat = FLAT * Math.max(x, y, z);
    [this.azimuth, this.elevation] = z < flat ? [0, STEEPEST] : y < flat ? [0, 0] : x < flat ? [-STEEPEST, 0] : [-0.6, 0.4];
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!canvas.hasPointerCapture(event.pointerId)) return;
      this.azimuth += event.movementX * 0.008;
      this.elevation = Math.min(STEEPEST, Math.max(-STEEPEST, this.elevation + event.movementY * 0.008));
      this.draw(this.frame);
    });
  }

  resize() {
    const width = this.canvas.clientWidth;
    if (!(width > 0)) return;
    this.width = width;
    this.height = Math.round(width < 560 ? width : width * CHAIN_HEIGHT);
    this.canvas.style.height = `${this.height}px`;
    this.canvas.width = Math.round(width * devicePixelRatio);
    this.canvas.height = Math.round(this.height * devicePixelRatio);
    this.draw(this.frame);
  }

  /** The points at a whole or fractional sample. */
  at(position) {
    const { points } = this.chain;
    const i = Math.min(Math.max(Math.floor(position), 0), points.length - 1);
    const next = points[Math.min(i + 1, points.length - 1)];
    return points[i].map((p, k) => p.map((x, c) => x + (next[k][c] - x) * (position - i)));
  }

  /** Where a point of space is drawn, and how far from the eye it is. */
  projection() {
    const scale = (Math.min(this.width, this.height) / 2 / this.radius) * 0.9;
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const project = (p) => {
      const [x, y, z] = p.map((v, c) => v - this.middle[c]);
      const [across, away] = [x * ca - y * sa, x * sa + y * ca];
      return [this.width / 2 + across * scale, this.height / 2 - (z * ce + away * se) * scale, away * ce - z * se];
    };
    return { project, scale };
  }

  draw(position) {
    this.frame = position;
    if (!this.width) return;
    const points = this.at(position);
    if (!points.flat().every(Number.isFinite)) return;
    const ctx = this.canvas.getContext("2d");
    const { project, scale } = this.projection();
    ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    ctx.fillStyle = colour("--page");
    ctx.fillRect(0, 0, this.width, this.height);
    ctx.lineCap = ctx.lineJoin = "round";
    this.drawFloor(ctx, project);
    this.drawPaths(ctx, project, position);
    const seen = points.map(project);
    const width = Math.max(5, Math.min(this.width, this.height) / 60);
    drawBase(ctx, seen[0], width * 3, width);
    const lines = this.chain.lines.map((line, k) => ({ line, k, depth: seen[line[0]][2] + seen[line[1]][2] }));
    lines.sort((a, b) => b.depth - a.depth);
    for (const { line, k } of lines) {
      stroke(ctx, line.map((i) => seen[i].slice(0, 2)), width, colour(["--first", "--second", "--third", "--fourth"][k % 4]));
    }
    seen.slice(1).forEach((p, k) => {
      const isEnd = this.ends.includes(k + 1);
      disc(ctx, p, width * (isEnd ? 0.55 : 0.75), colour(isEnd ? "--ink" : "--card"), colour(isEnd ? "--card" : "--ink"));
    });
    this.drawScale(ctx, scale);
  }

  /** A grid through the lowest point; a plane seen from its edge has none. */
  drawFloor(ctx, project) {
    const flat = Math.abs(this.elevation) < 0.05;
    if (flat) return;
    const step = roundStep(this.radius / 3);
    const z = this.middle[2] - this.size3[2] / 2;
    const lines = (c) => {
      const [low, high] = [this.middle[c] - 1.3 * this.radius, this.middle[c] + 1.3 * this.radius];
      return { low, high, at: Array.from({ length: Math.floor((high - low) / step) + 1 }, (_, i) => (Math.ceil(low / step) + i) * step).filter((v) => v <= high) };
    };
    const [x, y] = [lines(0), lines(1)];
    ctx.globalAlpha = 0.55;
    for (const v of x.at) stroke(ctx, [[v, y.low, z], [v, y.high, z]].map((p) => project(p).slice(0, 2)), 1, colour("--line"));
    for (const v of y.at) stroke(ctx, [[x.low, v, z], [x.high, v, z]].map((p) => project(p).slice(0, 2)), 1, colour("--line"));
    ctx.globalAlpha = 1;
  }

  /** The paths of the ends, and of a free base, up to the present moment; what follows is faint. */
  drawPaths(ctx, project, position) {
    const { points, free_base: free } = this.chain;
    const now = Math.floor(position) + 1;
    for (const k of free ? [0, ...this.ends] : this.ends) {
      const path = points.map((p) => project(p[k]).slice(0, 2));
      const style = colour(k === 0 ? "--muted" : "--error");
      ctx.globalAlpha = 0.25;
      stroke(ctx, path, 1, style);
      ctx.globalAlpha = 0.8;
      stroke(ctx, path.slice(0, now), 2, style);
    }
    ctx.globalAlpha = 1;
  }

  drawScale(ctx, scale) {
    const length = roundStep(this.width / 6 / scale);
    const [left, bottom] = [14, this.height - 16];
    stroke(ctx, [[left, bottom], [left + length * scale, bottom]], 2, colour("--muted"));
    ctx.font = FONT;
    ctx.fillStyle = colour("--muted");
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.fillText(`${readable(length)} m`, left, bottom - 8);
  }
}
