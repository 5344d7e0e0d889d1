/* Bands between two edges: drawn as one area, and read as both edges. */

/** What the legend says of a band at a point: both edges. */
const edgesText = (low, high) => (low == null || high == null ? "" : `${readable(low)} to ${readable(high)}`);

/** The names of a band's edges as columns: "lower 95 %" where it has a level. */
function edgeNames(label) {
  const level = label.match(/[\d.]+ %/)?.[0];
  return ["lower", "upper"].map((side) => (level ? `${side} ${level}` : `${label.replace("; narrower than the line", "")}, ${side}`));
}

/** The two edges of a band as series, data and band for `chart`, after `before` other series. */
function bandSeries(label, lower, upper, before = 0) {
  const edge = (name, options) => line(name, "--model", { ...options, hidden: true });
  const listed = edge(label, { area: "--soft" });
  listed.class = "band";
  listed.value = (u, v, series, i) => (i == null ? "" : edgesText(lower[i], upper[i]));
  listed.edges = edgeNames(label);
  return {
    series: [listed, edge("lower edge", { unlisted: true })],
    data: [upper, lower],
    bands: [{ series: [before + 1, before + 2], fill: () => colour("--soft") }],
  };
}

/** Two edges at +-limit with a wash between them, as series, data and band for `chart`, to be drawn first. */
function noiseLimits(label, limit, count) {
  const edge = (name, options) => ({ ...line(name, "--limit", { width: 1, dash: [5, 4], ...options }), fill: undefined });
  const listed = edge(label, { area: "--wash" });
  listed.value = (u, v) => (v == null ? "" : `±${readable(limit)}`);
  listed.edges = edgeNames(label);
  return {
    series: [listed, edge("lower limit", { unlisted: true })],
    data: [Array(count).fill(limit), Array(count).fill(-limit)],
    bands: [{ series: [1, 2], fill: () => colour("--wash") }],
  };
}
