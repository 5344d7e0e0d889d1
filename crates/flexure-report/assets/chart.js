/* One way to make a plot: uPlot with this page's axes, colours, legend and sizes. */

const charts = []; // what a reader can save: plots, and drawings that are SVG already
const drawings = [];
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", Arial, sans-serif';
const AXIS_WIDTH = 54; // of ordinary tick labels, the same in all plots, so that plots below one another line up
const LABEL_WIDTH = 20; // of the text beside them
const LEGEND_HEIGHT = 26;
const SMALLEST_LABEL = 0.7; // of the text below a narrow plot, as a share of its usual size
const WHOLE_STEPS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000]; // for ticks at whole numbers

/** A series: `colour` names a style sheet colour; `area` fills below, `unlisted` keeps it out of the legend, where `dots` gives it a round mark; `points` is true or their size. */
function line(label, colourName, { width = 2, dash, area, unlisted, dots, points = false, scale, hidden } = {}) {
  return {
    label,
    colourName,
    scale: scale ?? "y",
    pxAlign: 0,
    dash,
    width: hidden ? 0 : width,
    class: [area && "area", unlisted && "unlisted", dots && "dots"].filter(Boolean).join(" ") || undefined,
    stroke: () => (hidden ? "transparent" : colour(colourName)),
    fill: area && !hidden ? () => colour(area) : undefined,
    areaName: area,
    points: points ? { show: true, size: points === true ? 6 : points, fill: () => colour(colourName), stroke: () => colour(colourName) } : { show: false },
    value: (u, v) => readable(v, 5),
  };
}

const withUnit = (text, label) => text && text + unitOf(label).replace(/[()]/g, "");

/** What the legend says of a series, with the unit of the ordinates if they are its own. */
function valueWithUnit(series, label) {
  const value = series.value;
  return series.scale === "y" ? (...args) => withUnit(value(...args), label) : value;
}

/** A series that a hook draws, not uPlot. */
function drawn(label, colourName, options) {
  return { ...line(label, colourName, options), paths: () => null };
}

function axis(scale, label, { log, ticks = true, step } = {}, group) {
  const vertical = scale !== "x";
  return {
    scale,
    label: vertical ? label : ticks && label ? (u) => fitted(u, label) : undefined,
    labelFont: FONT,
    font: FONT,
    labelSize: LABEL_WIDTH,
    labelGap: vertical ? 2 : 0,
    size: vertical ? (u, labels, i) => sideWidth(u, labels ?? [], u.axes[i], group) : ticks ? 30 : 8,
    gap: 5,
    side: vertical ? 3 : 2,
    stroke: () => colour("--muted"),
    grid: { stroke: () => colour("--grid"), width: 1 },
    ticks: { show: ticks || vertical, stroke: () => colour("--line"), width: 1, size: 5 },
    space: vertical ? (u, i, low, high, available) => (available < 100 ? 14 : available < 150 ? 20 : 28) : step ? 36 : 62,
    ...(step && { incrs: step }),
    ...(log && { splits: logSplits, filter: (u, splits) => splits }),
    values: !vertical && !ticks ? (u, splits) => splits.map(() => "") : log ? logLabels : tickLabels,
  };
}

/** The text below a plot, which uPlot is about to write, in a smaller font where it would not fit. */
function fitted(u, text) {
  const { ctx, bbox } = u;
  const middle = bbox.left + bbox.width / 2;
  const room = 2 * Math.min(middle, ctx.canvas.width - middle);
  const share = Math.max(SMALLEST_LABEL, room / Math.max(1, ctx.measureText(text).width));
  if (share < 1) ctx.font = ctx.font.replace(/[\d.]+px/, (size) => `${parseFloat(size) * share}px`);
  return text;
}

/** Room for the longest tick label; plots of a group all take what the widest of them needs. */
function sideWidth(u, labels, side, group) {
  u.ctx.save();
  u.ctx.font = FONT;
  const longest = Math.max(0, ...labels.map((text) => u.ctx.measureText(text).width));
  u.ctx.restore();
  const need = Math.max(AXIS_WIDTH, Math.ceil(longest + side.ticks.size + side.gap + 4));
  return group ? group.widen(need, u) : need;
}

/** Tall plots give way on paper. */
function fullHeight(height) {
  return Math.round(isPrinting() ? height * (height > 250 ? 0.74 : 0.88) : height);
}

/**
 * Makes the plot in `host`. `x` and `y` are `{ label, log, range, ticks, step }`; `series` and `data` leave out the
 * abscissas, which are `at`; `draw` and `below` are hooks above and below the curves; `group` ties plots to one another;
 * `bare` makes a strip without numbers beside the plots of a group; `columns` are named lists that stand beside the series, or
 * in place of them where `only` says so, when the data are saved.
 */
function chart(host, spec) {
  const { group, legend = true, bare } = spec;
  const height = () => fullHeight(Number(host.dataset.height)) - (legend ? LEGEND_HEIGHT : 0);
  const options = plotOptions(spec, Math.max(host.clientWidth, 80), height());
  options.hooks.setScale = [(u, key) => key === "x" && showWindow(host, u, group)];
  if (bare) bareAxes(options, bare);
  const u = new uPlot(options, [spec.at, ...spec.data], host);
  const resize = () => {
    const width = host.clientWidth;
    if (width > 0 && (width !== u.width || height() !== u.height)) u.setSize({ width, height: height() });
  };
  new ResizeObserver(resize).observe(host);
  onAppearance(() => {
    resize();
    u.redraw(true, true);
  });
  if (!bare) charts.push({ u, host, spec });
  group?.add(u);
  return u;
}

/** What uPlot is asked for. */
function plotOptions({ x, y, series, scales = {}, bands, draw, below, group, legend = true, bare }, width, height) {
  const marker = (property) => (u, i) => (u.series[i].areaName ? property(u.series[i]) : "transparent");
  return {
    width,
    height,
    padding: [bare ? 4 : 10, 18, 0, 0],
    scales: {
      x: { time: false, distr: x.log ? 3 : 1, ...(x.range && { range: x.range }) },
      y: { distr: y.log ? 3 : 1, ...(y.range && { range: y.range }) },
      ...scales,
    },
    axes: [axis("x", x.label, x), axis("y", y.label, y, group)],
    series: [{ label: x.label, value: (u, v) => withUnit(readable(v, 6), x.label) }, ...series.map((s) => ({ ...s, value: valueWithUnit(s, y.label) }))],
    bands,
    legend: {
      show: legend,
      markers: {
        width: 2,
        stroke: (u, i) => `var(${u.series[i].colourName})`,
        dash: (u, i) => (u.series[i].dash ? "dashed" : "solid"),
        fill: marker((s) => `var(${s.areaName})`),
      },
    },
    cursor: {
      y: false,
      points: { size: 7 },
      drag: { x: true, y: false, setScale: true, dist: 4 },
      ...(group && { sync: { key: group.key, setSeries: false } }),
    },
    hooks: {
      drawClear: below ? [below] : [],
      draw: draw ? [draw] : [],
    },
  };
}

/** A strip without numbers at its side, as wide as the plots of `group`. */
function bareAxes(options, group) {
  options.axes[1] = { ...options.axes[1], label: undefined, size: (u) => group.widen(AXIS_WIDTH, u) + LABEL_WIDTH, values: (u, splits) => splits.map(() => ""), grid: { show: false }, ticks: { show: false } };
  options.axes[0] = { ...options.axes[0], size: 22, ticks: { show: false } };
}

/** Tells the document, and the plots of the same group, what part of the abscissa is shown. */
function showWindow(host, u, group) {
  const { min, max } = u.scales.x;
  host.dataset.xMin = min;
  host.dataset.xMax = max;
  group?.follow(u);
}

/** Draws series `index` as stems from 0; those beyond `limit` in another colour and with a square head. */
function drawStems(u, index, colourName, limit = Infinity) {
  if (!u.series[index].show) return;
  const { ctx } = u;
  const ratio = devicePixelRatio;
  const zero = u.valToPos(0, "y", true);
  const { min, max } = u.scales.x;
  const shown = u.data[0].filter((x) => x >= min && x <= max).length;
  const available = u.bbox.width / ratio / Math.max(1, shown - 1);
  ctx.save();
  ctx.beginPath();
  ctx.rect(u.bbox.left - 4 * ratio, u.bbox.top, u.bbox.width + 8 * ratio, u.bbox.height);
  ctx.clip();
  ctx.setLineDash([]);
  ctx.lineWidth = Math.min(2, Math.max(1, available / 3)) * ratio;
  u.data[0].forEach((x, i) => {
    const v = u.data[index][i];
    if (v == null || x < min || x > max) return;
    const beyond = Math.abs(v) > limit;
    const [px, py] = [u.valToPos(x, "x", true), u.valToPos(v, "y", true)];
    const r = Math.min(3.4, Math.max(1.2, available / 3)) * ratio;
    ctx.strokeStyle = ctx.fillStyle = colour(beyond ? "--truth" : colourName);
    ctx.beginPath();
    ctx.moveTo(px, zero);
    ctx.lineTo(px, py);
    ctx.stroke();
    ctx.beginPath();
    if (beyond) ctx.rect(px - r, py - r, 2 * r, 2 * r);
    else ctx.arc(px, py, r, 0, 2 * Math.PI);
    ctx.fill();
  });
  ctx.restore();
}

/** Draws a straight line across the plot at `value` of `scale`. */
function drawLevel(u, scale, value, colourName, dash = []) {
  const { ctx, bbox } = u;
  const p = u.valToPos(value, scale, true);
  ctx.save();
  ctx.strokeStyle = colour(colourName);
  ctx.lineWidth = 1.2 * devicePixelRatio;
  ctx.setLineDash(dash.map((d) => d * devicePixelRatio));
  ctx.beginPath();
  if (scale === "x") {
    ctx.moveTo(p, bbox.top);
    ctx.lineTo(p, bbox.top + bbox.height);
  } else {
    ctx.moveTo(bbox.left, p);
    ctx.lineTo(bbox.left + bbox.width, p);
  }
  ctx.stroke();
  ctx.restore();
}

/** Writes a short word into a plot, at canvas pixels. */
function drawWord(u, text, px, py, colourName, align = "left") {
  const { ctx } = u;
  ctx.save();
  ctx.font = FONT.replace("12px", `${12 * devicePixelRatio}px`);
  ctx.fillStyle = colour(colourName);
  ctx.textAlign = align;
  ctx.textBaseline = "top";
  ctx.fillText(text, px, py);
  ctx.restore();
}
