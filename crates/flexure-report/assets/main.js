/* Everything drawn, in the order of the page. */

startTheme();
if (page.nonlinearity) plotNonlinearity(page.nonlinearity);
if (page.surface) plotSurface(page.surface);
page.curves.forEach((curve, i) => plotCurve(byId(`plot-curve-${i}`), curve));
if (page.approximation) plotApproximation(page.approximation);
page.linear.forEach((part, k) => {
  plotImpulse(part, k);
  plotStep(part, k);
  plotBode(part, k);
  plotRoots(part, k);
});
if (page.prediction) plotPrediction(page.prediction);
plotResiduals(page.residuals);
page.scores.forEach((score, i) => score && plotScore(score, i));
if (page.record) plotRecord(page.record);
if (page.arm) playArm(page.arm);
finishPage();
