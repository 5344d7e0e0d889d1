/* Everything drawn on the page of a moving chain, in the order of the page. */

startTheme();
if (page.chain) {
  const { chain } = page;
  const view = new ChainView(byId("chain-canvas"), chain);
  new Player(chain.time, chain.points.length - 1, (position) => view.draw(position));
}
if (page.record) plotRecord(page.record);
finishPage();
