/* Everything drawn on the page of a regression, in the order of the page. */

startTheme();
if (page.curve) plotCurve(byId("plot-curve"), page.curve, page.points);
if (page.surface) plotSurface(page.surface);
page.slices.forEach((slice, i) => plotCurve(byId(`plot-slice-${i}`), slice));
if (page.residuals) plotResidualCloud(page.residuals);
if (page.distribution) plotDistribution(page.distribution, page.residuals.y_label);
page.scores.forEach((score, i) => score && plotScore(score, i));
finishPage();
