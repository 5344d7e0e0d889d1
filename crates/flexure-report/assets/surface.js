/* An estimate of two variables: colours, contours, and where the data are. */

// Viridis: evenly perceived, and readable for colour-blind eyes and in grey.
const VIRIDIS = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37]];
const CONTOURS = 9;

/** The colour of a share from 0 to 1, as red, green and blue. */
function shade(share) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const i = Math.min(Math.floor(place), VIRIDIS.length - 2);
  return VIRIDIS[i].map((c, k) => Math.round(c + (place - i) * (VIRIDIS[i + 1][k] - c)));
}

/** One pixel a grid point, the second column upwards. */
function surfaceImage(s, [low, high]) {
  const [columns, rows] = [s.x.length, s.y.length];
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, rows);
  s.z.forEach((z, k) => {
    if (z == null) return;
    const [i, j] = [Math.floor(k / columns), k % columns];
    const rgb = shade((z - low) / (high - low || 1));
    image.data.set([...rgb, 255], 4 * ((rows - 1 - i) * columns + j));
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

function plotSurface(s) {
  const range = extent(s.z);
  const image = surfaceImage(s, range);
  const levels = contourLevels(range);
  const u = chart(byId("plot-surface"), {
    at: s.x,
    x: { label: s.x_label },
    y: { label: s.y_label, range: () => [s.y[0], s.y.at(-1)] },
    series: [pointsSeries("data", "--card")],
    data: [s.x.map(() => null)],
    legend: false,
    columns: [
      [s.x_label, s.z.map((_, k) => s.x[k % s.x.length])],
      [s.y_label, s.z.map((_, k) => s.y[Math.floor(k / s.x.length)])],
      [s.z_label, s.z],
    ],
    only: true,
    draw: (u) => {
      drawImage(u, s, image);
      drawContours(u, s, levels);
      drawCloud(u, s.points, null, "--card");
    },
  });
  scaleBar(s, range);
  readout(u, s);
}

function drawImage(u, s, image) {
  const { ctx, bbox } = u;
  // A pixel's centre is its grid point.
  const half = (list) => (list.at(-1) - list[0]) / (list.length - 1) / 2;
  const [left, right] = [u.valToPos(s.x[0] - half(s.x), "x", true), u.valToPos(s.x.at(-1) + half(s.x), "x", true)];
  const [bottom, top] = [u.valToPos(s.y[0] - half(s.y), "y", true), u.valToPos(s.y.at(-1) + half(s.y), "y", true)];
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.imageSmoothingEnabled = true;
  ctx.drawImage(image, left, top, right - left, bottom - top);
  ctx.restore();
}

/** Round values between the smallest and the largest. */
function contourLevels([low, high]) {
  const rough = (high - low) / CONTOURS;
  if (!(rough > 0)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((m) => m >= rough);
  const levels = [];
  for (let k = Math.ceil(low / step); k * step < high; k += 1) levels.push(k * step);
  return levels;
}

/** The pieces of the contour at `level`, by the four sides of every cell of the grid. */
function contourPieces(s, level) {
  const columns = s.x.length;
  const pieces = [];
  const crossing = ([xa, ya, za], [xb, yb, zb]) => {
    if (za < level === zb < level) return null;
    const t = (level - za) / (zb - za);
    return [xa + t * (xb - xa), ya + t * (yb - ya)];
  };
  for (let i = 0; i + 1 < s.y.length; i += 1) {
    for (let j = 0; j + 1 < columns; j += 1) {
      const corner = (di, dj) => [s.x[j + dj], s.y[i + di], s.z[(i + di) * columns + j + dj]];
      const corners = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
      if (corners.some(([, , z]) => z == null)) continue;
      const ends = corners.map((c, k) => crossing(c, corners[(k + 1) % 4])).filter(Boolean);
      for (let k = 0; k + 1 < ends.length; k += 2) pieces.push([ends[k], ends[k + 1]]);
    }
  }
  return pieces;
}

function drawContours(u, s, levels) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.strokeStyle = "#ffffffb0";
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  for (const level of levels) {
    for (const [[xa, ya], [xb, yb]] of contourPieces(s, level)) {
      ctx.moveTo(u.valToPos(xa, "x", true), u.valToPos(ya, "y", true));
      ctx.lineTo(u.valToPos(xb, "x", true), u.valToPos(yb, "y", true));
    }
  }
  ctx.stroke();
  ctx.restore();
}

/** What the colours mean. */
function scaleBar(s, [low, high]) {
  byId("scale-low").textContent = readable(low, 3);
  byId("scale-high").textContent = readable(high, 3);
  byId("scale-name").textContent = s.z_label;
  const bar = byId("scale-bar");
  [bar.width, bar.height] = [256, 14];
  const context = bar.getContext("2d");
  for (let i = 0; i < bar.width; i += 1) {
    context.fillStyle = `rgb(${shade(i / (bar.width - 1)).join(",")})`;
    context.fillRect(i, 0, 1, bar.height);
  }
}

/** The estimate under the pointer, as text. */
function readout(u, s) {
  const text = byId("surface-readout");
  const nearest = (list, v) => Math.min(Math.max(Math.round(((v - list[0]) / (list.at(-1) - list[0])) * (list.length - 1)), 0), list.length - 1);
  const hint = "Point at the picture to read the estimate.";
  text.textContent = hint;
  (u.hooks.setCursor ??= []).push(() => {
    const { left, top } = u.cursor;
    if (!(left >= 0 && top >= 0)) {
      text.textContent = hint;
      return;
    }
    const [j, i] = [nearest(s.x, u.posToVal(left, "x")), nearest(s.y, u.posToVal(top, "y"))];
    const z = s.z[i * s.x.length + j];
    const place = `${s.x_label} = ${readable(s.x[j])}, ${s.y_label} = ${readable(s.y[i])}`;
    text.textContent = `${place}: ${z == null ? "nothing is known" : `${s.z_label} = ${readable(z)}`}`;
  });
}
