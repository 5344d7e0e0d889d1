/* Everything drawn, in the order of the page. */

startTheme();
if (page.nonlinearity) plotNonlinearity(page.nonlinearity);
plotImpulse(page.linear);
plotBode(page.linear);
plotRoots(page.linear);
if (page.prediction) plotPrediction(page.prediction);
plotResiduals(page.residuals);
page.scores.forEach((score, i) => score && plotScore(score, i));
if (page.record) plotRecord(page.record);
if (page.arm) new Player(page.arm);
root.dataset.ready = "true";
