/* The linear parts, each with its own number: impulse response, Bode plots, poles and zeros. */

function plotImpulse(linear, k) {
  const host = byId(`plot-impulse-${k}`);
  if (!host) return;
  const count = Math.max(linear.impulse.length, linear.impulse_estimate.length);
  const { at, x } = responseTimes(linear, count, "time since the impulse");
  const padded = (list) => at.map((_, k) => list[k] ?? null);
  const limited = linear.impulse_estimate.length > 0 && linear.impulse_limit > 0;
  const limits = limited ? noiseLimits("noise limits", linear.impulse_limit, count) : { series: [], data: [], bands: [] };
  const series = [...limits.series];
  const data = [...limits.data];
  const stems = linear.impulse_estimate.length ? series.push(drawn("estimate", "--measured")) : 0;
  if (stems) data.push(padded(linear.impulse_estimate));
  if (linear.impulse.length) {
    series.push(line("fitted", "--model", { width: 2, points: count <= 120 }));
    data.push(padded(linear.impulse));
  }
  chart(host, {
    at,
    x,
    y: { label: `response${responseUnit(linear)}`, range: () => widened(extent(...data, [0])) },
    series,
    data,
    bands: limits.bands,
    below: (u) => {
      drawLevel(u, "y", 0, "--limit");
      if (stems) drawStems(u, stems, "--measured");
    },
  });
}

/** The instants of a response, in s where the sample time is known, and their axis. */
function responseTimes(linear, count, name) {
  const step = linear.sample_time;
  const at = Array.from({ length: count }, (_, k) => k * (step ?? 1));
  const range = () => widened([0, at.at(-1) || (step ?? 1)], 0.02);
  return { at, x: step ? { label: `${name} (s)`, range } : { label: `${name} (samples)`, range, step: WHOLE_STEPS } };
}

/** The unit of a block's responses, behind a name. */
/** A longer unit would not fit beside a plot; the names stand in the diagram. */
const LONGEST_UNIT = 32;
const responseUnit = ({ response_unit: unit }) => (unit && unit.length <= LONGEST_UNIT ? ` (${unit})` : "");

/** B(1) / A(1); none where an integrator makes it infinite. */
function staticGain({ a, b }) {
  const sum = (list, of = (v) => v) => list.reduce((total, v) => total + of(v), 0);
  const finite = Math.abs(sum(a)) > 1e-9 * sum(a, Math.abs);
  return b.length && finite ? sum(b) / sum(a) : null;
}

/** The impulse response added up: what a step at the input makes of the output. */
function plotStep(linear, k) {
  const host = byId(`plot-step-${k}`);
  if (!host) return;
  const impulse = linear.impulse.length ? linear.impulse : linear.impulse_estimate;
  let sum = 0;
  const step = impulse.map((v) => (sum += v ?? 0));
  const { at, x } = responseTimes(linear, step.length, "time since the step");
  const gain = staticGain(linear);
  chart(host, {
    at,
    x,
    y: { label: `response${responseUnit(linear)}`, range: () => widened(extent(step, [0, gain ?? 0])) },
    series: [line("step response", "--model", { width: 2, points: at.length <= 120 })],
    data: [step],
    legend: false,
    below: (u) => {
      drawLevel(u, "y", 0, "--limit");
      if (gain != null) drawLevel(u, "y", gain, "--truth", [5, 4]);
    },
  });
}

function plotBode(linear, k) {
  if (!byId(`plot-magnitude-${k}`)) return;
  const at = linear.frequency;
  const x = { label: `frequency (${linear.frequency_unit})`, log: true };
  const decades = at.length > 1 ? Math.log10(at.at(-1) / at[0]) : 0;
  if (decades < 1) x.log = false;
  const group = new Group(`bode-${k}`, [at[0], at.at(-1)], 0);
  x.range = (u, low, high) => [low, high];
  const curve = (name, values, errors, host, xAxis, yAxis) => {
    const edge = (sign) => values.map((v, i) => (v == null || errors[i] == null ? null : v + sign * errors[i]));
    const band = errors.length ? bandSeries("band (95 %, pointwise)", edge(-1), edge(1)) : { series: [], data: [], bands: [] };
    // A band that is wide somewhere would flatten the curve.
    const [low, high] = widened(extent(values), 0.25);
    const shown = extent(values, ...band.data.map((list) => list.map((v) => Math.min(Math.max(v ?? low, low), high))));
    chart(host, {
      at,
      group,
      legend: band.series.length > 0,
      x: xAxis,
      y: { ...yAxis, range: () => widened(shown) },
      series: [...band.series, line(name, "--model")],
      data: [...band.data, values],
      bands: band.bands,
    });
  };
  const degrees = { label: "phase (degrees)", step: [1, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800] };
  curve("magnitude", linear.magnitude_db, linear.magnitude_error ?? [], byId(`plot-magnitude-${k}`), { ...x, ticks: false }, { label: "magnitude (dB)" });
  curve("phase", linear.phase_deg, linear.phase_error ?? [], byId(`plot-phase-${k}`), x, degrees);
}

/** The best linear approximation with the levels of what disturbs it, and its phase. */
function plotApproximation(a) {
  const at = a.frequency;
  const x = { label: `frequency (${a.frequency_unit})`, log: at.length > 1 && at.at(-1) > 10 * at[0] };
  const few = at.length <= 120;
  const [series, data] = [[], []];
  const add = (text, token, list, width) => {
    if (!list.length) return;
    series.push(line(text, token, { width, points: few }));
    data.push(list);
  };
  add("magnitude", "--model", a.magnitude_db, 2.2);
  add("total level", "--limit", a.total_db, 1.2);
  add("noise level", "--measured", a.noise_db, 1.2);
  add("distortion level", "--truth", a.distortion_db, 1.2);
  const group = new Group("approximation", [at[0], at.at(-1)], 0);
  const common = { at, x: { ...x, range: (u, low, high) => [low, high] }, group };
  chart(byId("plot-approximation"), {
    ...common,
    y: { label: "dB", range: () => widened(extent(...data)) },
    series,
    data,
  });
  chart(byId("plot-approximation-phase"), {
    ...common,
    y: { label: "phase (degrees)", range: () => widened(extent(a.phase_deg)), step: [1, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800] },
    series: [line("phase", "--model", { points: few })],
    data: [a.phase_deg],
    legend: false,
  });
}

/** Poles and zeros around the unit circle, as an SVG with equal scales. */
function plotRoots(linear, k) {
  const host = byId(`plot-roots-${k}`);
  if (!host) return;
  const finite = (list) => list.filter((r) => r.every(Number.isFinite));
  const [poles, zeros] = [finite(linear.poles), finite(linear.zeros)];
  const farthest = Math.max(1, ...[...poles, ...zeros].map(([re, im]) => Math.max(Math.abs(re), Math.abs(im))));
  const reach = Math.min(2.5, farthest * 1.18);
  const [size, left, top] = [300, 44, 26];
  const px = (re) => left + ((re + reach) / (2 * reach)) * size;
  const py = (im) => top + ((reach - im) / (2 * reach)) * size;
  const step = reach > 1.6 ? 1 : 0.5;
  const parts = [`<svg viewBox="0 0 ${left + size + 12} ${top + size + 40}" role="img" aria-label="Poles and zeros in the z plane">`];
  for (let v = -Math.floor(reach / step) * step; v <= reach; v += step) {
    const [x, y, text] = [px(v), py(v), readable(v, 3)];
    const kind = v === 0 ? "root-axis" : "root-grid";
    parts.push(`<path class="${kind}" d="M${x} ${top} V${top + size} M${left} ${y} H${left + size}"/>`);
    parts.push(`<text class="root-text" x="${x}" y="${top + size + 15}" text-anchor="middle">${text}</text>`);
    parts.push(`<text class="root-text" x="${left - 6}" y="${y + 4}" text-anchor="end">${text}</text>`);
  }
  parts.push(`<rect class="root-frame" x="${left}" y="${top}" width="${size}" height="${size}"/>`);
  parts.push(`<circle class="root-circle" cx="${px(0)}" cy="${py(0)}" r="${size / 2 / reach}"/>`);
  const mark = ([re, im], body, name) =>
    parts.push(`<g><title>${name} ${rootText([re, im])}, |z| = ${readable(Math.hypot(re, im))}</title>${body(px(re), py(im))}</g>`);
  const inside = (root) => root.every((c) => Math.abs(c) <= reach);
  const covariances = linear.pole_covariances ?? [];
  covariances.forEach((covariance, i) => parts.push(region(linear.poles[i], covariance, px, py, size / 2 / reach)));
  for (const zero of zeros.filter(inside)) mark(zero, zeroMark, "zero");
  for (const pole of poles.filter(inside)) mark(pole, poleMark, "pole");
  parts.push(`<text class="root-text" x="${left + size / 2}" y="${top + size + 33}" text-anchor="middle">real part</text>`);
  parts.push(`<text class="root-text" transform="translate(10 ${top + size / 2}) rotate(-90)" text-anchor="middle">imaginary part</text>`);
  parts.push(`${poleMark(left + 8, 10)}<text class="root-legend" x="${left + 20}" y="14">${poles.length === 1 ? "1 pole" : `${poles.length} poles`}</text>`);
  parts.push(`${zeroMark(left + 98, 10)}<text class="root-legend" x="${left + 110}" y="14">${zeros.length === 1 ? "1 zero" : `${zeros.length} zeros`}</text></svg>`);
  host.innerHTML = parts.join("");
  const all = [...poles.map((r) => ["pole", ...r]), ...zeros.map((r) => ["zero", ...r])];
  const columns = ["root", "real part", "imaginary part"].map((name, i) => [name, all.map((r) => r[i])]);
  drawings.push({ host, svg: () => host.querySelector("svg"), columns: () => columns });
  const known = covariances.some((c) => c.every(Number.isFinite));
  byId(`roots-caption-${k}`).textContent = rootCaption(poles, zeros, inside) + (known ? " Shaded: the 95 % region of each pole, where it is large enough to be seen." : "");
}

/** The region of a pole that holds the true one with 95 %: an ellipse, or a piece of the real axis. */
function region([re, im], [real, both, imaginary], px, py, scale) {
  if (![re, im, real, both, imaginary].every(Number.isFinite)) return "";
  const [middle, half] = [(real + imaginary) / 2, (real - imaginary) / 2];
  const spread = Math.hypot(half, both);
  const along = Math.sqrt(middle + spread);
  const across = Math.sqrt(Math.max(middle - spread, 0));
  // Of one number 95 % lie within 1.96 standard deviations, of two within the root of 5.991.
  const times = (Math.abs(im) < 1e-12 ? 1.96 : Math.sqrt(5.991)) * scale;
  const angle = (-Math.atan2(both, half) / 2) * (180 / Math.PI);
  const text = Math.abs(im) < 1e-12 ? `95 % interval: ${readable(re - 1.96 * along)} to ${readable(re + 1.96 * along)}` : "95 % confidence region";
  return `<g><title>${text}</title><ellipse class="root-region" cx="${px(re)}" cy="${py(im)}" rx="${times * along}" ry="${Math.max(times * across, 1.5)}" transform="rotate(${angle} ${px(re)} ${py(im)})"/></g>`;
}

const poleMark = (x, y) => `<path class="root-pole" d="M${x - 5} ${y - 5} L${x + 5} ${y + 5} M${x - 5} ${y + 5} L${x + 5} ${y - 5}"/>`;
const zeroMark = (x, y) => `<circle class="root-zero" cx="${x}" cy="${y}" r="5.2"/>`;

function rootText([re, im]) {
  if (Math.abs(im) < 1e-12) return readable(re);
  return `${readable(re)} ${im < 0 ? "−" : "+"} ${readable(Math.abs(im))}i`;
}

function rootCaption(poles, zeros, inside) {
  const text = [];
  if (poles.length) {
    const largest = Math.max(...poles.map((p) => Math.hypot(...p)));
    // The difference of an integrator's pole from 1 is rounding.
    if (Math.abs(largest - 1) < 1e-9) text.push("It integrates: a pole is on the unit circle.");
    else if (largest < 1) text.push(`All poles are inside the unit circle: stable, the slowest with |z| = ${readable(largest)}.`);
    else text.push(`Unstable: the largest pole has |z| = ${readable(largest)}.`);
  }
  const hidden = [...poles.map((r) => ["pole", r]), ...zeros.map((r) => ["zero", r])].filter(([, r]) => !inside(r));
  if (hidden.length) text.push(`Outside the picture: ${hidden.map(([name, r]) => `${name} ${rootText(r)}`).join(", ")}.`);
  return text.join(" ");
}
