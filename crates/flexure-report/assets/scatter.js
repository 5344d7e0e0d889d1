/* Points: one by one where they are few, as the darkness of cells where they are many. */

/** A legend entry for points that `drawCloud` draws. */
const pointsSeries = (label, colourName = "--measured") => drawn(label, colourName, { dots: true });

/** Draws a cloud of points below or above the curves; not while series `index` is switched off. */
function drawCloud(u, cloud, index, colourName = "--measured") {
  if (!cloud || (index != null && !u.series[index].show)) return;
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = colour(colourName);
  if (cloud.cells) drawCells(u, cloud.cells);
  else drawDots(u, cloud);
  ctx.restore();
}

function drawDots(u, cloud) {
  const { ctx } = u;
  const n = cloud.x.length;
  const r = (n < 150 ? 3 : n < 1000 ? 2.2 : 1.6) * devicePixelRatio;
  ctx.globalAlpha = n < 150 ? 0.85 : n < 1000 ? 0.6 : 0.4;
  cloud.x.forEach((x, i) => {
    ctx.beginPath();
    ctx.arc(u.valToPos(x, "x", true), u.valToPos(cloud.y[i], "y", true), r, 0, 2 * Math.PI);
    ctx.fill();
  });
}

function drawCells(u, cells) {
  const { ctx } = u;
  const most = Math.log1p(cells.count.reduce((a, b) => Math.max(a, b), 1));
  const edge = ([low, high], i, count) => low + ((high - low) * i) / count;
  cells.index.forEach((index, k) => {
    const [column, row] = [index % cells.columns, Math.floor(index / cells.columns)];
    const left = u.valToPos(edge(cells.x, column, cells.columns), "x", true);
    const right = u.valToPos(edge(cells.x, column + 1, cells.columns), "x", true);
    const bottom = u.valToPos(edge(cells.y, row, cells.rows), "y", true);
    const top = u.valToPos(edge(cells.y, row + 1, cells.rows), "y", true);
    ctx.globalAlpha = 0.12 + 0.78 * (Math.log1p(cells.count[k]) / most);
    ctx.fillRect(left, top, Math.max(right - left, 1), Math.max(bottom - top, 1));
  });
}

/** A cloud as named lists: its points, or the cells that have any. */
function cloudColumns(cloud, xLabel, yLabel) {
  const { cells } = cloud;
  if (!cells) return [[`data: ${xLabel}`, cloud.x], [`data: ${yLabel}`, cloud.y]];
  const middle = ([low, high], i, count) => low + ((high - low) * (i + 0.5)) / count;
  return [
    [`cell: ${xLabel}`, cells.index.map((i) => middle(cells.x, i % cells.columns, cells.columns))],
    [`cell: ${yLabel}`, cells.index.map((i) => middle(cells.y, Math.floor(i / cells.columns), cells.rows))],
    ["points in the cell", cells.count],
  ];
}
