/* Reading the page's data and writing numbers. */

const byId = (id) => document.getElementById(id);
const page = JSON.parse(byId("page-data").textContent);

/** A number for reading, with a typographic minus; empty where there is none. */
function readable(v, digits = 4) {
  if (v == null || !Number.isFinite(v)) return "";
  const size = Math.abs(v);
  const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? short(v.toExponential(digits - 1)) : String(Number(v.toPrecision(digits)));
  return text.replaceAll("-", "−");
}

/** `1.50e-7` as `1.5e-7`. */
function short(exponential) {
  return exponential.replace(/\.?0+e/, "e").replace("e+", "e");
}

/** Labels of evenly spaced ticks with as many decimals as their distance needs. */
function tickLabels(u, splits, axis, space, step) {
  const largest = Math.max(...splits.map((v) => Math.abs(v ?? 0)));
  if (largest >= 1e7 || (largest > 0 && largest < 1e-3)) {
    const digits = Math.max(0, Math.ceil(Math.log10(largest / step) - 1e-9));
    return splits.map((v) => (v == null ? "" : v === 0 ? "0" : v.toExponential(Math.min(digits, 8)).replace("e+", "e").replaceAll("-", "−")));
  }
  const decimals = Math.min(8, Math.max(0, Math.ceil(-Math.log10(step) - 1e-9), decimalsOf(step)));
  return splits.map((v) => (v == null ? "" : v.toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "−")));
}

/** Decimals of a tick distance such as 0.25 that needs more of them than its size says. */
function decimalsOf(step) {
  const text = String(Number(step.toPrecision(6)));
  return text.includes("e") || !text.includes(".") ? 0 : text.split(".")[1].length;
}

/** Ticks of a logarithmic axis at 1 to 9 times each power of ten, wherever the scale begins; over many decades at the powers alone. */
function logSplits(u, side, low, high) {
  const ticks = [];
  const digits = Math.log10(high / low) > 6 ? 1 : 9;
  for (let power = 10 ** Math.floor(Math.log10(low)); power <= high; power *= 10) {
    for (let digit = 1; digit <= digits; digit += 1) {
      const tick = digit * power;
      if (tick >= low && tick <= high) ticks.push(tick);
    }
  }
  return ticks;
}

/** Labels of those ticks: at the powers of ten, not at all of them where they are many, and at 2 and 5 between where they are few. */
function logLabels(u, splits) {
  const leading = (tick) => Math.round(tick / 10 ** Math.floor(Math.log10(tick) + 1e-9));
  const powers = splits.filter((tick) => leading(tick) === 1).length;
  const every = Math.ceil(powers / 6);
  if (every > 1) return splits.map((tick) => (leading(tick) === 1 && Math.round(Math.log10(tick)) % every === 0 ? readable(tick, 2) : null));
  const shown = powers >= 2 ? [1] : splits.length > 6 ? [1, 2, 5] : [1, 2, 3, 4, 5, 6, 7, 8, 9];
  return splits.map((tick) => (shown.includes(leading(tick)) ? readable(tick, 2) : null));
}

/** The values of an evenly spaced grid. */
const gridValues = (grid) => Array.from({ length: grid.count }, (_, i) => grid.start + i * grid.step);

/** Smallest and largest finite value of some lists. */
function extent(...lists) {
  let low = Infinity;
  let high = -Infinity;
  for (const list of lists) {
    for (const v of list) {
      if (v == null || !Number.isFinite(v)) continue;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

/** The range widened by `part` of itself on both sides, and never empty. */
function widened([low, high], part = 0.06) {
  const margin = (high - low) * part || Math.abs(high) * 0.1 || 1;
  return [low - margin, high + margin];
}
