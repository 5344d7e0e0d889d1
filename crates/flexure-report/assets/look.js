/* Everything drawn on the page of a first look, in the order of the page. */

/** A power spectrum, both axes logarithmic. */
function plotSpectrum(spectrum, index) {
  const [low, high] = extent(spectrum.density);
  const [first, last] = extent(spectrum.frequency);
  chart(byId(`plot-spectrum-${index}`), {
    at: spectrum.frequency,
    x: { label: spectrum.x_label, log: true, range: () => [first, last] },
    // What rounding leaves would flatten the rest.
    y: { label: spectrum.y_label, log: true, range: () => [Math.max(low, high * 1e-14) / 2, high * 2] },
    series: [line("power density", SIGNAL_COLOURS[index % SIGNAL_COLOURS.length], { width: 1.4 })],
    data: [spectrum.density],
    legend: false,
  });
}

startTheme();
if (page.record) plotRecord(page.record);
page.correlations.forEach((plot, i) => plotCorrelation(`plot-correlation-${i}`, plot.lags, plot.values, [plot.limit, plot.level], "correlation"));
page.spectra.forEach(plotSpectrum);
finishPage();
