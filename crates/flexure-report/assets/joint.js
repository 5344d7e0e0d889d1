/* Everything drawn on the page of a joint, and on that of several models, in the order of the page. */

startTheme();
(page.curves ?? []).forEach((c, i) => plotCurve(byId(`plot-curve-${i}`), c.curve, c.points, c.dashed));
page.motions.forEach((motion, i) => plotPrediction(motion, `-${i}`));
finishPage();
