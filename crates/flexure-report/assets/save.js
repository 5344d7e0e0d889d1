/* What can be taken from a card: its numbers as CSV or as a table, its plots as a picture. */

const TABLE_ROWS = 20;
const unitOf = (label) => label?.match(/ \([^()]*\)$/)?.[0] ?? "";

/** The numbers of plots as named lists; plots over the same abscissas share them. */
function cardColumns(plots) {
  const columns = [];
  let before = null;
  for (const plot of plots) {
    if (plot.columns) columns.push(...plot.columns());
    else {
      const { at } = plot.spec;
      const same = before && before.length === at.length && before.every((v, i) => v === at[i]);
      columns.push(...plotColumns(plot, same));
      before = at;
    }
  }
  // Curves of the same name are told apart by their axes.
  const times = (name) => columns.filter(([other]) => other === name).length;
  return columns.map(([name, values, plain, axis]) => [axis && times(name) > 1 ? `${plain}: ${axis}` : name, values]);
}

/** The numbers of one plot, with units; without the abscissas where they stand there already. */
function plotColumns({ spec }, withoutAbscissas) {
  if (spec.only) return spec.columns;
  const unit = unitOf(spec.y.label);
  const columns = withoutAbscissas ? [] : [[spec.x.label, spec.at]];
  let edges = null;
  spec.series.forEach((series, i) => {
    const values = spec.data[i];
    const name = edges ? edges[1] : (series.edges?.[0] ?? series.label);
    // The upper edge of a band comes first, the lower one behind it.
    const shown = series.edges ? series.edges[1] : edges ? edges[0] : name;
    edges = series.edges ?? null;
    if (values.every((v) => v == null)) return;
    const own = series.scale === "y" && !shown.endsWith(unit) ? unit : "";
    columns.push([shown + own, values, shown, spec.y.label]);
  });
  return [...columns, ...(spec.columns ?? [])];
}

/** A number without the last digits, which are rounding. */
const cell = (v) => (v == null || !Number.isFinite(v) ? "" : String(Number(v.toPrecision(9))));
const quotedCell = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const longest = (columns) => Math.max(0, ...columns.map(([, values]) => values.length));

function csvText(columns) {
  const lines = [columns.map(([name]) => quotedCell(name)).join(",")];
  for (let i = 0; i < longest(columns); i += 1) lines.push(columns.map(([, values]) => (typeof values[i] === "string" ? quotedCell(values[i]) : cell(values[i]))).join(","));
  return `${lines.join("\n")}\n`;
}

/** A table of the columns, of rows evenly apart where there are many. */
function dataTable(heading, columns) {
  const rows = longest(columns);
  const shown = Math.min(rows, TABLE_ROWS);
  const index = Array.from({ length: shown }, (_, i) => (shown > 1 ? Math.round((i * (rows - 1)) / (shown - 1)) : 0));
  const table = document.createElement("table");
  const caption = table.createCaption();
  caption.textContent = rows > shown ? `${heading}: ${shown} of ${rows} rows, evenly apart. The CSV file has all.` : heading;
  const head = table.createTHead().insertRow();
  for (const [name] of columns) head.append(Object.assign(document.createElement("th"), { scope: "col", textContent: name }));
  const body = table.createTBody();
  for (const i of index) {
    const row = body.insertRow();
    for (const [, values] of columns) row.insertCell().textContent = typeof values[i] === "string" ? values[i] : readable(values[i], 5);
  }
  return table;
}

function download(name, blob) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A heading as the name of a file. */
const fileName = (...texts) => texts.map((text) => text.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "")).join("-").slice(0, 90);

/** A row of small buttons at the end of a card. */
function saveButtons(card) {
  const plots = () => [...charts, ...drawings].filter((plot) => card.contains(plot.host) && plot.host.offsetParent !== null);
  const heading = card.dataset.heading ?? (card.querySelector("h3") ?? card.closest("section").querySelector("h2")).textContent.trim();
  const name = fileName(document.title, heading);
  const row = Object.assign(document.createElement("div"), { className: "save" });
  row.setAttribute("role", "group");
  row.setAttribute("aria-label", `${heading}: save or read the data`);
  const button = (kind, title, act) => {
    const made = Object.assign(document.createElement("button"), { type: "button", textContent: kind, title, onclick: act });
    made.dataset.save = kind.toLowerCase();
    made.setAttribute("aria-label", `${title}: ${heading}`);
    row.append(made);
    return made;
  };
  const picture = () => cardPicture(heading, plots());
  const kinds = plots();
  if (kinds.some((plot) => plot.u || plot.columns)) button("CSV", "Save the data", () => download(`${name}.csv`, new Blob([csvText(cardColumns(plots()))], { type: "text/csv" })));
  button("SVG", "Save as a vector picture", async () => download(`${name}.svg`, new Blob([(await picture()).text], { type: "image/svg+xml" })));
  button("PNG", "Save as a picture", async () => download(`${name}.png`, await pixels(await picture())));
  if (kinds.some((plot) => plot.u || plot.columns)) tableButton(card, heading, plots, button, row);
  return row;
}

/** A button that shows the data as a table below the card's plots. */
function tableButton(card, heading, plots, button, row) {
  let box = null;
  const made = button("Table", "Show the data as a table", () => {
    if (box) box.remove();
    else {
      box = Object.assign(document.createElement("div"), { className: "data-table", tabIndex: 0 });
      box.setAttribute("role", "region");
      box.setAttribute("aria-label", `Data of ${heading}`);
      box.append(dataTable(heading, cardColumns(plots())));
      row.after(box);
      made.setAttribute("aria-expanded", "true");
      return;
    }
    box = null;
    made.setAttribute("aria-expanded", "false");
  });
  made.setAttribute("aria-expanded", "false");
}

/** A command as words that stay whole: a line would else break behind the hyphens of an option. */
function unbrokenWords(text) {
  const span = (word) => Object.assign(document.createElement("span"), { textContent: word });
  return text.split(" ").flatMap((word, i) => (i ? [" ", span(word)] : [span(word)]));
}

/** A button that copies the text of a code block. */
function copyButton(block) {
  const code = block.querySelector("code");
  const text = code.textContent;
  if (!text.includes("\n")) code.replaceChildren(...unbrokenWords(text));
  const button = Object.assign(document.createElement("button"), { type: "button", className: "copy", textContent: "Copy" });
  button.setAttribute("aria-label", `Copy: ${block.dataset.copy}`);
  button.onclick = async () => {
    const copied = await copyText(text).then(() => true, () => false);
    button.textContent = copied ? "Copied" : "Not copied";
    setTimeout(() => {
      button.textContent = "Copy";
    }, 2000);
  };
  block.append(button);
}

/** Copies by the clipboard where the browser allows that, else as a selection is copied. */
async function copyText(text) {
  if (navigator.clipboard) {
    try {
      return await navigator.clipboard.writeText(text);
    } catch {
      // A page inside another one may not use it.
    }
  }
  const area = Object.assign(document.createElement("textarea"), { value: text, className: "hidden" });
  document.body.append(area);
  area.select();
  const copied = document.execCommand("copy");
  area.remove();
  if (!copied) throw new Error("nothing was copied");
}

/** What every page ends with: buttons, and the sign that all is drawn. */
function finishPage() {
  const diagram = byId("diagram");
  if (diagram) drawings.push({ host: diagram, svg: () => [...diagram.querySelectorAll("svg")].find((svg) => svg.getBoundingClientRect().width > 0) });
  for (const card of document.querySelectorAll("figure.card")) {
    if ([...charts, ...drawings].some((plot) => card.contains(plot.host))) card.append(saveButtons(card));
  }
  document.querySelectorAll("[data-copy]").forEach(copyButton);
  root.dataset.ready = "true";
}
