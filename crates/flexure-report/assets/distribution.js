/* What an estimate leaves: residuals over x, and their distribution. */

/** Residuals with their running mean and spread. */
function plotResidualCloud(residuals) {
  const host = byId("plot-residuals");
  const { running_x: at, points } = residuals;
  const band = bandSeries("± running spread", residuals.running_low, residuals.running_high, 1);
  const series = [pointsSeries("residuals"), ...band.series, line("running mean", "--model", { width: 2 })];
  const x = cloudExtent(points, at);
  chart(host, {
    at,
    x: { label: residuals.x_label, range: (u, low, high) => (u.status ? [low, high] : x) },
    y: { label: residuals.y_label, range: () => widened(points.y_range) },
    series,
    data: [at.map(() => null), ...band.data, residuals.running_mean],
    bands: band.bands,
    columns: cloudColumns(points, residuals.x_label, residuals.y_label),
    below: (u) => {
      drawCloud(u, points, 1);
      drawLevel(u, "y", 0, "--limit");
    },
  });
}

/** The abscissas' range of a cloud and of a curve over it. */
function cloudExtent(cloud, at) {
  const [low, high] = extent(cloud?.cells ? cloud.cells.x : (cloud?.x ?? []), at);
  return widened([low, high], 0.02);
}

/** A histogram with the normal density of the same mean and spread. */
function plotDistribution(h, label) {
  const host = byId("plot-distribution");
  if (!host) return;
  const [low, high] = [h.edges[0], h.edges.at(-1)];
  const at = Array.from({ length: 201 }, (_, i) => low + ((high - low) * i) / 200);
  const normal = at.map((v) => Math.exp(-0.5 * ((v - h.mean) / h.spread) ** 2) / (h.spread * Math.sqrt(2 * Math.PI)));
  chart(host, {
    at,
    x: { label },
    y: { label: "density", range: () => [0, 1.08 * extent(h.density, normal)[1]] },
    series: [drawn("residuals", "--measured", { width: 4 }), line("normal", "--model")],
    data: [at.map(() => null), normal],
    columns: [["bin from", h.edges.slice(0, -1)], ["bin to", h.edges.slice(1)], ["density of the residuals", h.density]],
    below: (u) => drawBars(u, h, 1, "--measured"),
  });
}

function drawBars(u, h, index, colourName) {
  if (!u.series[index].show) return;
  const { ctx, bbox } = u;
  const zero = u.valToPos(0, "y", true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = colour(colourName);
  ctx.globalAlpha = 0.55;
  h.density.forEach((d, i) => {
    const [left, right] = [u.valToPos(h.edges[i], "x", true), u.valToPos(h.edges[i + 1], "x", true)];
    const top = u.valToPos(d, "y", true);
    ctx.fillRect(left + 0.5, top, Math.max(right - left - 1, 1), zero - top);
  });
  ctx.restore();
}
