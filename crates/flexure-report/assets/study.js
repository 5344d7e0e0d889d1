/* Errors over the number of samples, both axes logarithmic, beside theory's slopes. */

/** One colour a line; of more than four lines the second half has the first half's colours, dashed. */
const RATE_COLOURS = ["--first", "--second", "--third", "--fourth"];

function plotRates(plot, index) {
  const colours = plot.lines.length > RATE_COLOURS.length ? Math.ceil(plot.lines.length / 2) : RATE_COLOURS.length;
  const all = [...plot.lines, ...plot.guides];
  const [first, last] = extent(plot.n);
  const [low, high] = extent(...all.map((l) => l.error));
  chart(byId(`plot-rate-${index}`), {
    at: plot.n,
    x: { label: "samples n", log: true, range: () => [first / 1.25, last * 1.25] },
    y: { label: plot.y_label, log: true, range: () => [low / 1.25, high * 1.25] },
    series: [
      ...plot.lines.map((l, i) => line(l.name, RATE_COLOURS[i % colours], { points: 7, dash: i < colours ? undefined : [7, 4] })),
      ...plot.guides.map((l) => line(l.name, "--limit", { width: 1.5, dash: [3, 4] })),
    ],
    data: all.map((l) => l.error),
  });
}

startTheme();
page.plots.forEach(plotRates);
finishPage();
