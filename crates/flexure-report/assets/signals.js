/* Signals over time: measured against predicted, and the record. */

/** `range` is that of the error; by default its own. */
function plotPrediction(p, suffix = "", range = undefined) {
  const at = gridValues(p.time);
  const group = gridGroup(`prediction${suffix}`, p.time);
  const x = { label: p.time.label };
  const common = { at, group };
  const measured = line(p.names[0], "--measured", { width: 4 });
  chart(byId(`plot-prediction${suffix}`), {
    ...common,
    x: { ...x, ticks: false },
    y: { label: p.y_label },
    series: [measured, line(p.names[1], "--model", { width: 1.5 })],
    data: [p.measured, p.predicted],
  });
  chart(byId(`plot-error${suffix}`), {
    ...common,
    x,
    y: { label: `error${p.y_label.match(/ \([^()]*\)$/)?.[0] ?? ""}`, range },
    series: [line(`error: ${p.names.join(" − ")}`, "--error", { width: 1.3 })],
    data: [p.error],
    below: (u) => drawLevel(u, "y", 0, "--limit"),
  });
  plotOverview(byId(`plot-overview${suffix}`), at, p, group);
  group.buttons(byId(`tools-prediction${suffix}`));
}

/** The strip that always shows everything, with the group's window marked on it. */
function plotOverview(host, at, p, group) {
  const u = chart(host, {
    at,
    x: { label: p.time.label },
    y: { label: "" },
    series: [line(p.names[0], "--measured", { width: 1 })],
    data: [p.measured],
    legend: false,
    bare: group,
  });
  const mark = () => {
    const [left, right] = group.window.map((t) => Math.min(Math.max(u.valToPos(t, "x"), 0), u.over.clientWidth));
    u.setSelect({ left, width: Math.max(right - left, 2), top: 0, height: u.over.clientHeight }, false);
  };
  u.cursor.drag.setScale = false;
  (u.hooks.setSelect ??= []).push(() => {
    const { left, width } = u.select;
    if (width > 4) group.show(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
    else mark();
  });
  (u.hooks.setSize ??= []).push(mark);
  (u.hooks.ready ??= []).push(mark);
  group.onWindow(mark);
  u.over.addEventListener("dblclick", () => group.reset());
}

const SIGNAL_COLOURS = ["--first", "--second", "--third", "--fourth"];

function plotRecord(record) {
  const host = byId("plot-record");
  const at = gridValues(record.time);
  const group = gridGroup("record", record.time);
  const tall = record.signals.length > 5 ? 96 : 132;
  // Where a name does not fit beside its plot, all plots carry units alone: the legends have the names.
  const short = record.signals.some((signal) => signal.label.length > (tall - LEGEND_HEIGHT) / 7);
  record.signals.forEach((signal, i) => {
    const last = i + 1 === record.signals.length;
    const name = SIGNAL_COLOURS[i % SIGNAL_COLOURS.length];
    const box = document.createElement("div");
    box.className = "plot";
    box.setAttribute("role", "img");
    box.setAttribute("aria-label", `${signal.name} over ${record.time.label}`);
    box.dataset.height = tall + (last ? 42 : 0) + LEGEND_HEIGHT;
    host.append(box);
    const unit = signal.label.slice(signal.name.length).replace(/[()]/g, "").trim();
    chart(box, {
      at,
      group,
      x: { label: record.time.label, ticks: last },
      y: { label: short ? unit || " " : signal.label },
      series: [line(signal.name, name, { width: 1.3 })],
      data: [signal.values],
      below: (u) => drawFresh(u, record.fresh_from, i === 0),
    });
  });
  group.buttons(byId("tools-record"));
}

/** Shades what was not used for the fit. */
function drawFresh(u, from, worded) {
  if (from == null) return;
  const { ctx, bbox } = u;
  const [left, right] = [bbox.left, bbox.left + bbox.width];
  const edge = Math.min(Math.max(u.valToPos(from, "x", true), left), right);
  ctx.save();
  ctx.fillStyle = colour("--shade");
  ctx.fillRect(edge, bbox.top, right - edge, bbox.height);
  ctx.restore();
  if (edge > left && edge < right) drawLevel(u, "x", from, "--model", [4, 4]);
  const available = 42 * devicePixelRatio;
  const gap = 6 * devicePixelRatio;
  if (worded && right - edge > available) drawWord(u, "fresh", edge + gap, bbox.top + gap / 2, "--model");
  if (worded && edge - left > available) drawWord(u, "fit", edge - gap, bbox.top + gap / 2, "--muted", "right");
}
