/* Curves over something that is not time: the nonlinearity, the residuals' correlations, the scores. */

function plotNonlinearity(n) {
  plotCurve(byId("plot-nonlinearity"), n);
}

/** An estimate with its band, over the data's density or over the data themselves. */
function plotCurve(host, n, cloud, dashed = "truth") {
  const [series, data, bands] = [[], [], []];
  const add = (s, d) => {
    series.push(s);
    data.push(d);
  };
  const scales = {};
  if (cloud) add(pointsSeries("data"), n.x.map(() => null));
  if (n.density.length) {
    add(line("data density", "--density", { width: 1, area: "--wash", scale: "density" }), n.density);
    scales.density = { range: [0, 3.6 * Math.max(extent(n.density)[1], 1e-300)] };
  }
  if (n.lower.length) {
    const label = `band (${n.band_label || "of the estimate"}${isThin(n) ? "; narrower than the line" : ""})`;
    const band = bandSeries(label, n.lower, n.upper, series.length);
    band.series.forEach((s, i) => add(s, band.data[i]));
    bands.push(...band.bands);
  }
  if (n.truth.length) add(line(dashed, "--truth", { width: 2, dash: [8, 5] }), n.truth);
  add(line("estimate", "--model", { width: n.points ? 1.3 : 2.6, points: n.points && 10 }), n.y);
  chart(host, {
    at: n.x,
    x: { label: n.x_label },
    y: { label: n.y_label, range: () => (cloud ? widened(extent(cloud.y_range, n.y)) : curveRange(n)) },
    series,
    data,
    bands,
    scales,
    columns: cloud && cloudColumns(cloud, n.x_label, n.y_label),
    below: (u) => {
      drawLevel(u, "y", 0, "--line");
      if (cloud) drawCloud(u, cloud, 1);
    },
  });
}

/** Whether the line hides its band, as it does from about a hundredth of the curve's range on. */
function isThin(n) {
  const [low, high] = extent(n.y);
  return n.upper.every((upper, i) => !(upper - n.lower[i] > 0.01 * (high - low)));
}

/** Room for the curves, and for the band as far as that does not flatten them. */
function curveRange(n) {
  const [low, high] = extent(n.y, n.truth);
  const available = 0.4 * (high - low || 1);
  const band = n.lower.length ? extent(n.lower, n.upper) : [low, high];
  return widened([Math.max(Math.min(band[0], low), low - available), Math.min(Math.max(band[1], high), high + available)]);
}

/** Stems over lags with the limits of a single one. */
function plotCorrelation(id, lags, values, [limit, level], name) {
  const host = byId(id);
  if (!host) return;
  const limited = limit > 0;
  const limits = limited ? noiseLimits(`${level} limits`, limit, lags.length) : { series: [], data: [], bands: [] };
  const index = limits.series.length + 1;
  const largest = Math.max(...values.map((v) => Math.abs(v ?? 0)), limited ? 1.6 * limit : 0) * 1.1 || 1;
  chart(host, {
    at: lags,
    x: { label: "lag (samples)", range: () => widened(extent(lags), 0.02), step: WHOLE_STEPS },
    y: { label: "correlation", range: [-largest, largest] },
    series: [...limits.series, drawn(name, "--model")],
    data: [...limits.data, values],
    bands: limits.bands,
    below: (u) => drawLevel(u, "y", 0, "--limit"),
    draw: (u) => drawStems(u, index, "--model", limited ? limit : Infinity),
  });
}

function plotResiduals(residuals) {
  const lags = residuals.autocorrelation.map((_, lag) => lag);
  plotCorrelation("plot-auto", lags.slice(1), residuals.autocorrelation.slice(1), [residuals.limit, residuals.level], "autocorrelation");
  plotCorrelation("plot-cross", residuals.cross_lags, residuals.cross_correlation, [residuals.cross_limit, residuals.level], "cross-correlation");
}

/** The criterion over the candidates; logarithmic where it spans more than two decades. */
function plotScore(score, index) {
  const [low, high] = extent(score.y);
  const log = low > 0 && high > 200 * low;
  const nearest = score.x.reduce((best, x, i) => (Math.abs(x - score.chosen) < Math.abs(score.x[best] - score.chosen) ? i : best), 0);
  chart(byId(`plot-score-${index}`), {
    at: score.x,
    x: {
      label: score.x_label,
      log: score.log_x,
      range: score.log_x ? (u, a, b) => [a / 1.12, b * 1.12] : (u, a, b) => widened([a, b], 0.03),
      step: score.x.every(Number.isInteger) ? WHOLE_STEPS : undefined,
    },
    y: { label: score.y_label, log, range: log ? undefined : () => widened([low, high], 0.12) },
    series: [line(score.y_label, "--model", { points: score.x.length <= 60 })],
    data: [score.y],
    legend: false,
    draw: (u) => drawChosen(u, score, nearest),
  });
}

function drawChosen(u, score, nearest) {
  const { ctx, bbox } = u;
  const ratio = devicePixelRatio;
  drawLevel(u, "x", score.chosen, "--truth", [5, 4]);
  const px = u.valToPos(score.chosen, "x", true);
  const right = px < bbox.left + 0.7 * bbox.width;
  drawWord(u, "chosen", px + (right ? 6 : -6) * ratio, bbox.top + 4 * ratio, "--truth", right ? "left" : "right");
  const v = score.y[nearest];
  if (v == null) return;
  ctx.save();
  ctx.fillStyle = colour("--truth");
  ctx.strokeStyle = colour("--card");
  ctx.lineWidth = 2 * ratio;
  ctx.beginPath();
  ctx.arc(px, u.valToPos(v, "y", true), 6 * ratio, 0, 2 * Math.PI);
  ctx.fill();
  ctx.stroke();
  ctx.restore();
}
