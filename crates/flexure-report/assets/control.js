/* Everything drawn on the page of controllers, in the order of the page. */

startTheme();
if (page.record) plotRecord(page.record);
if (page.arm) playArm(page.arm);
finishPage();
