/* The two-link arm's motion: the picture, numbers below it, and plots beside it with a line at the present moment. */

const PLOTS_HEIGHT = 480; // of all the plots beside the picture together, without their legend and time axis

/** Plays the arm's motion. */
function playArm(arm) {
  const view = new ArmView(byId("arm-canvas"), arm);
  const readout = readoutOf(arm);
  const plots = plotArm(arm, (t) => player.seekTime(t));
  if (view.gain > 1) byId("arm-gain").textContent = `, drawn ${view.gain} times as large`;
  const player = new Player(arm.time, arm.q[0].length - 1, (position, t) => {
    view.draw(position);
    for (const show of readout) show(position);
    plots.mark(t);
  });
}

/** One line a quantity below the picture; each entry updates its number. */
function readoutOf({ q, qm, tau }) {
  const degrees = (rad) => `${((rad * 180) / Math.PI).toFixed(1)}°`;
  const lines = [0, 1].flatMap((k) => [
    [["shoulder", "elbow"][k], (i) => degrees(between(q[k], i)), true],
    ["deflection", (i) => `${(1000 * (between(qm[k], i) - between(q[k], i))).toFixed(1)} mrad`, qm[k].length],
    ["torque", (i) => `${readable(tau[k][Math.floor(i)] ?? NaN, 3)} N m`, tau[k].length],
  ]);
  return lines.filter(([, , there]) => there).map(([name, value]) => {
    const row = document.createElement("span");
    const number = document.createElement("b");
    row.append(name, number);
    byId("arm-readout").append(row);
    return (i) => {
      number.textContent = value(i).replace("-", "−");
    };
  });
}

/** The angles, deflections and torques; returns how to mark a moment in all of them. */
function plotArm(arm, seek) {
  const grid = { start: arm.time.start, step: arm.time.step, count: arm.q[0].length };
  const at = gridValues(grid);
  const group = gridGroup("arm", grid);
  const unit = arm.time.unit ? `${arm.time.name} (${arm.time.unit})` : arm.time.name;
  const joints = ["shoulder", "elbow"];
  const pair = (lists) => joints.map((name, k) => [name, lists[k], ["--first", "--second"][k]]).filter(([, list]) => list.length);
  const deflection = arm.q.map((q, k) => arm.qm[k].map((m, i) => (m == null || q[i] == null ? null : m - q[i])));
  const panels = [["angle (rad)", pair(arm.q)], ["deflection (rad)", pair(deflection)], ["torque (N m)", pair(arm.tau)]].filter(([, p]) => p.length);
  const heads = panels.map(([label, lists], i) => {
    const last = i + 1 === panels.length;
    const box = document.createElement("div");
    box.className = "plot";
    box.setAttribute("role", "img");
    box.setAttribute("aria-label", `${label} of the joints over time`);
    box.dataset.height = Math.round(PLOTS_HEIGHT / panels.length) + (last ? 34 : 0) + (i ? 0 : LEGEND_HEIGHT);
    byId("arm-plots").append(box);
    const u = chart(box, {
      at,
      group,
      x: { label: unit, ticks: last },
      y: { label },
      series: lists.map(([name, , colourName], k) => line(name, colourName, { width: 1.6, dash: k ? [7, 3] : undefined })),
      data: lists.map(([, list]) => list),
      legend: i === 0,
    });
    return playhead(u, seek);
  });
  let moment = at[0];
  const mark = (t) => {
    moment = t;
    for (const head of heads) head(t);
  };
  group.onWindow(() => queueMicrotask(() => mark(moment)));
  onAppearance(() => queueMicrotask(() => mark(moment)));
  return { mark };
}

/** A line over a plot at a moment, and seeking by a click; returns how to move the line. */
function playhead(u, seek) {
  const head = document.createElement("div");
  head.className = "playhead";
  u.over.append(head);
  u.over.addEventListener("click", (event) => {
    const t = u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x");
    if (!(u.select.width > 0)) seek(t);
  });
  let moment = null;
  const move = (t) => {
    moment = t;
    const left = u.valToPos(t, "x");
    const shown = left >= 0 && left <= u.over.clientWidth;
    head.style.transform = `translateX(${left - 1}px)`;
    head.style.visibility = shown ? "visible" : "hidden";
  };
  (u.hooks.setSize ??= []).push(() => moment != null && move(moment));
  return move;
}
