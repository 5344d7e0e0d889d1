/* Everything drawn on the page of a joint, and on that of several models, in the order of the page. */

startTheme();
(page.curves ?? []).forEach((c, i) => plotCurve(byId(`plot-curve-${i}`), c.curve, c.points, c.dashed));
// The errors of several models have one scale, which one that runs away does not stretch beyond the measured range.
const [low, high] = page.same_scale ? extent(...page.motions.map((m) => m.measured)) : [];
const errors = page.same_scale && extent(...page.motions.map((m) => m.error.map((e) => e && Math.min(Math.max(e, low - high), high - low))));
page.motions.forEach((motion, i) => plotPrediction(motion, `-${i}`, errors ? () => widened(errors) : undefined));
finishPage();
