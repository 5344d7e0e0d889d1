/* The linear parts, each with its own number: impulse response, Bode plots, poles and zeros. */

function plotImpulse(linear, k) {
  const host = byId(`plot-impulse-${k}`);
  if (!host) return;
  const count = Math.max(linear.impulse.length, linear.impulse_estimate.length);
  const lags = Array.from({ length: count }, (_, k) => k);
  const padded = (list) => lags.map((k) => list[k] ?? null);
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
    at: lags,
    x: { label: "lag (samples)", range: () => widened([0, Math.max(count - 1, 1)], 0.02), step: WHOLE_STEPS },
    y: { label: "impulse response", range: () => widened(extent(...data, [0])) },
    series,
    data,
    bands: limits.bands,
    below: (u) => {
      drawLevel(u, "y", 0, "--limit");
      if (stems) drawStems(u, stems, "--measured");
    },
  });
}

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
  const at = step.map((_, i) => i);
  const gain = staticGain(linear);
  chart(host, {
    at,
    x: { label: "time since the step (samples)", range: () => widened([0, Math.max(at.length - 1, 1)], 0.02), step: WHOLE_STEPS },
    y: { label: "step response", range: () => widened(extent(step, [0, gain ?? 0])) },
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
  const common = { at, legend: false, group };
  x.range = (u, low, high) => [low, high];
  chart(byId(`plot-magnitude-${k}`), {
    ...common,
    x: { ...x, ticks: false },
    y: { label: "magnitude (dB)", range: () => widened(extent(linear.magnitude_db)) },
    series: [line("magnitude", "--model")],
    data: [linear.magnitude_db],
  });
  chart(byId(`plot-phase-${k}`), {
    ...common,
    x,
    y: { label: "phase (degrees)", range: () => widened(extent(linear.phase_deg)), step: [1, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800] },
    series: [line("phase", "--model")],
    data: [linear.phase_deg],
  });
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
  byId(`roots-caption-${k}`).textContent = rootCaption(poles, zeros, inside);
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
    text.push(largest < 1 ? `All poles are inside the unit circle: stable, the slowest with |z| = ${readable(largest)}.` : `Unstable: the largest pole has |z| = ${readable(largest)}.`);
  }
  const hidden = [...poles.map((r) => ["pole", r]), ...zeros.map((r) => ["zero", r])].filter(([, r]) => !inside(r));
  if (hidden.length) text.push(`Outside the picture: ${hidden.map(([name, r]) => `${name} ${rootText(r)}`).join(", ")}.`);
  return text.join(" ");
}
