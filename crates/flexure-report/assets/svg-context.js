/* A canvas that writes SVG: what uPlot and this page's hooks draw with, in place of the browser's, while a plot is saved. */

const tenth = (v) => Math.round(v * 100) / 100;

/** Stands for Path2D. */
class SvgPath {
  constructor(other) {
    this.d = other?.d ?? "";
  }

  moveTo(x, y) {
    this.d += `M${tenth(x)} ${tenth(y)}`;
  }

  lineTo(x, y) {
    this.d += `${this.d ? "L" : "M"}${tenth(x)} ${tenth(y)}`;
  }

  bezierCurveTo(...numbers) {
    this.d += `C${numbers.map(tenth).join(" ")}`;
  }

  rect(x, y, width, height) {
    this.d += `M${tenth(x)} ${tenth(y)}h${tenth(width)}v${tenth(height)}h${tenth(-width)}Z`;
  }

  /** A circle or a part of one. */
  arc(x, y, r, start, end) {
    const point = (angle) => `${tenth(x + r * Math.cos(angle))} ${tenth(y + r * Math.sin(angle))}`;
    const half = (from, to) => `A${tenth(r)} ${tenth(r)} 0 ${Math.abs(to - from) > Math.PI ? 1 : 0} ${to > from ? 1 : 0} ${point(to)}`;
    const middle = (start + end) / 2;
    this.d += `${this.d ? "L" : "M"}${point(start)}${half(start, middle)}${half(middle, end)}`;
  }

  closePath() {
    this.d += "Z";
  }
}

/** What `save` keeps. */
const SVG_STATE = {
  strokeStyle: "#000", fillStyle: "#000", lineWidth: 1, lineJoin: "miter", lineCap: "butt", globalAlpha: 1,
  font: FONT, textAlign: "start", textBaseline: "alphabetic", dash: [], matrix: [1, 0, 0, 1, 0, 0], clipped: "",
};
const ANCHORS = { left: "start", start: "start", center: "middle", right: "end", end: "end" };
/** How far below its anchor a text's base line is, in sizes of the font. */
const BASELINES = { top: 0.8, hanging: 0.8, middle: 0.35, alphabetic: 0, bottom: -0.2 };
const measuring = document.createElement("canvas").getContext("2d");

/** Stands for a canvas's 2D context; what was drawn is in `parts`. */
class SvgContext extends SvgPath {
  static clips = 0;

  constructor(canvas) {
    super();
    Object.assign(this, SVG_STATE, { canvas, parts: [], stack: [] });
  }

  save() {
    this.stack.push(Object.fromEntries(Object.keys(SVG_STATE).map((name) => [name, this[name]])));
  }

  restore() {
    Object.assign(this, this.stack.pop());
  }

  translate(x, y) {
    const [a, b, c, d, e, f] = this.matrix;
    this.matrix = [a, b, c, d, e + a * x + c * y, f + b * x + d * y];
  }

  rotate(angle) {
    const [a, b, c, d, e, f] = this.matrix;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    this.matrix = [a * cos + c * sin, b * cos + d * sin, c * cos - a * sin, d * cos - b * sin, e, f];
  }

  setLineDash(dash) {
    this.dash = dash;
  }

  measureText(text) {
    measuring.font = this.font;
    return measuring.measureText(text);
  }

  beginPath() {
    this.d = "";
  }

  clearRect() {}

  clip(path = this) {
    SvgContext.clips += 1;
    const id = `clip-${SvgContext.clips}`;
    this.parts.push(`<clipPath id="${id}"${this.clipped}><path d="${path.d}"${this.transform()}/></clipPath>`);
    this.clipped = ` clip-path="url(#${id})"`;
  }

  stroke(path = this) {
    if (!path.d || !(this.lineWidth > 0) || this.strokeStyle === "transparent") return;
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.draw(`<path d="${path.d}" fill="none"${paint("stroke", this.strokeStyle)} stroke-width="${tenth(this.lineWidth)}" stroke-linejoin="${this.lineJoin}" stroke-linecap="${this.lineCap}"${dash}`);
  }

  fill(path = this) {
    if (path.d && this.fillStyle !== "transparent") this.draw(`<path d="${path.d}"${paint("fill", this.fillStyle)}`);
  }

  fillRect(...sides) {
    const path = new SvgPath();
    path.rect(...sides);
    this.fill(path);
  }

  fillText(text, x, y) {
    const size = Number(this.font.match(/([\d.]+)px/)?.[1] ?? 12);
    const base = y + (BASELINES[this.textBaseline] ?? 0) * size;
    const weight = /bold|[6-9]00/.test(this.font) ? ' font-weight="bold"' : "";
    this.draw(`<text x="${tenth(x)}" y="${tenth(base)}" font-size="${tenth(size)}"${weight} text-anchor="${ANCHORS[this.textAlign]}"${paint("fill", this.fillStyle)}`, escaped(text));
  }

  drawImage(image, x, y, width, height) {
    this.draw(`<image x="${tenth(x)}" y="${tenth(y)}" width="${tenth(width)}" height="${tenth(height)}" preserveAspectRatio="none" href="${image.toDataURL()}"`);
  }

  transform() {
    return this.matrix.join(" ") === "1 0 0 1 0 0" ? "" : ` transform="matrix(${this.matrix.map((v) => Math.round(v * 1e4) / 1e4).join(" ")})"`;
  }

  /** Writes an element inside the clip of now; its start has no end yet. */
  draw(start, content = "") {
    const opacity = this.globalAlpha < 1 ? ` opacity="${tenth(this.globalAlpha)}"` : "";
    const name = start.slice(1, start.indexOf(" "));
    const element = `${start}${opacity}${this.transform()}>${content}</${name}>`;
    this.parts.push(this.clipped ? `<g${this.clipped}>${element}</g>` : element);
  }
}

const escaped = (text) => String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");

/** A colour as an attribute; what is transparent as an opacity beside it, as not all programs know #rrggbbaa. */
function paint(name, value) {
  const [, rgb, alpha] = String(value).match(/^(#[\da-f]{6})([\da-f]{2})$/i) ?? [null, value, null];
  return ` ${name}="${rgb}"${alpha ? ` ${name}-opacity="${tenth(parseInt(alpha, 16) / 255)}"` : ""}`;
}

/** What `draw` draws on canvases that it makes, at once or in its microtasks, as parts of an SVG; scaled to CSS pixels. */
async function recorded(draw) {
  const canvas = HTMLCanvasElement.prototype;
  const { getContext } = canvas;
  const browsers = window.Path2D;
  let context = null;
  canvas.getContext = function () {
    context = new SvgContext(this);
    return context;
  };
  window.Path2D = SvgPath;
  try {
    const made = draw();
    // uPlot draws in a microtask of its own.
    for (let turn = 0; turn < 5; turn += 1) await null;
    made?.destroy?.();
  } finally {
    canvas.getContext = getContext;
    window.Path2D = browsers;
  }
  return `<g transform="scale(${1 / devicePixelRatio})">${context.parts.join("")}</g>`;
}
