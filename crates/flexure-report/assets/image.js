/* A card's plots as one picture: always light, on white, with the heading and the legend. */

const PICTURE_MARGIN = 12;
const PICTURE_FONT = FONT.slice(FONT.indexOf("px ") + 3).replaceAll('"', "'");

/** Runs `make` while the colours are light; it may only wait for microtasks, so that nobody sees the change. */
async function inLight(make) {
  const dark = root.classList.contains("dark");
  root.classList.remove("dark");
  colours = new Map();
  try {
    return await make();
  } finally {
    root.classList.toggle("dark", dark);
    colours = new Map();
  }
}

/** The picture as the text of an SVG file with its size. */
function cardPicture(heading, plots) {
  return inLight(async () => {
    const parts = [];
    let width = 0;
    let y = PICTURE_MARGIN + 18;
    const add = (content, x, top) => parts.push(`<g transform="translate(${x} ${top})">${content}</g>`);
    add(`<text font-size="15" font-weight="600" fill="${colour("--ink")}">${escaped(heading)}</text>`, PICTURE_MARGIN, y);
    y += 10;
    for (const plot of plots) {
      const drawn = plot.u ? await drawnPlot(plot) : drawnSvg(plot.svg());
      add(drawn.content, PICTURE_MARGIN, y);
      y += drawn.height + 6;
      width = Math.max(width, drawn.width);
    }
    const size = { width: Math.ceil(width + 2 * PICTURE_MARGIN), height: Math.ceil(y + PICTURE_MARGIN) };
    const box = document.createElement("div");
    box.innerHTML = `<svg viewBox="0 0 ${size.width} ${size.height}" width="${size.width}" height="${size.height}" font-family="${PICTURE_FONT}"><rect width="100%" height="100%" fill="${colour("--card")}"/>${parts.join("")}</svg>`;
    return { ...size, text: new XMLSerializer().serializeToString(box.firstChild) };
  });
}

/** A plot as it is shown now: its window, and the curves that are not switched off. */
async function drawnPlot({ u, spec }) {
  const legend = spec.legend === false ? { content: "", height: 0 } : drawnLegend(u);
  const { min, max } = u.scales.x;
  const side = u.axes[1].size(u, [], 1, 0);
  const options = plotOptions({ ...spec, group: undefined, x: { ...spec.x, range: () => [min, max] }, legend: false }, u.width, u.height);
  options.axes[1].size = typeof side === "number" ? side : AXIS_WIDTH;
  options.series = options.series.map((s, i) => (i === 0 ? s : { ...s, show: u.series[i].show }));
  options.cursor = { show: false };
  const host = document.createElement("div");
  const content = await recorded(() => new uPlot(options, [spec.at, ...spec.data], host));
  return {
    content: `${legend.content}<g transform="translate(0 ${legend.height})">${content}</g>`,
    width: u.width,
    height: legend.height + u.height,
  };
}

/** The legend in lines no wider than the plot. */
function drawnLegend(u) {
  const parts = [];
  let [x, y] = [0, 14];
  for (const series of u.series.slice(1)) {
    if (!series.show || series.class?.includes("unlisted")) continue;
    measuring.font = FONT;
    const needs = 26 + measuring.measureText(series.label).width + 18;
    if (x > 0 && x + needs > u.width) [x, y] = [0, y + 18];
    parts.push(`<g transform="translate(${x} ${y})">${legendMark(series)}<text x="26" font-size="12" fill="${colour("--muted")}">${escaped(series.label)}</text></g>`);
    x += needs;
  }
  return { content: parts.join(""), height: parts.length ? y + 8 : 0 };
}

function legendMark({ areaName, colourName, dash, class: kind }) {
  if (areaName) return `<rect y="-9" width="20" height="10"${paint("fill", colour(areaName))}/>`;
  if (kind?.includes("dots")) return `<circle cx="10" cy="-4" r="3.5"${paint("fill", colour(colourName))}/>`;
  const dashes = dash ? ` stroke-dasharray="${dash.join(" ")}"` : "";
  return `<path d="M0 -4h20" stroke-width="2.5"${paint("stroke", colour(colourName))}${dashes}/>`;
}

/** A drawing of the page with its style sheet's colours and sizes written into it. */
function drawnSvg(svg) {
  const { width, height } = svg.getBoundingClientRect();
  const copy = svg.cloneNode(true);
  const [own, copied] = [svg, copy].map((e) => [...e.querySelectorAll("*")]);
  own.forEach((element, i) => {
    const style = getComputedStyle(element);
    for (const name of ["fill", "stroke", "stroke-width", "font-size", "font-weight", "font-style", "font-family", "text-anchor"]) copied[i].setAttribute(name, style.getPropertyValue(name));
    copied[i].removeAttribute("class");
  });
  const [, , w, h] = svg.getAttribute("viewBox").split(/\s+/).map(Number);
  return { content: `<svg viewBox="0 0 ${w} ${h}" width="${width}" height="${height}">${copy.innerHTML}</svg>`, width, height };
}

/** The picture as a file of pixels, two for one on the screen. */
async function pixels({ text, width, height }) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [2 * width, 2 * height];
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}
