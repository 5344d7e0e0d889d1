"use strict";

const find = (id) => document.getElementById(id);
const dark = matchMedia("(prefers-color-scheme: dark)");
const theme = () => document.documentElement.classList.toggle("dark", dark.matches);
dark.addEventListener("change", theme);
theme();

/** The record or model that is open with the options of its reading, and what the project has. */
let open = null;
let project = { files: [] };

const say = (text) => { find("status").textContent = text; };
const complain = (text) => { find("problem").textContent = text; };

/** An element with its text or children; nothing is ever parsed as HTML. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

async function ask(path, options = {}) {
  const response = await fetch(path, options);
  const answer = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(answer.problem || `the app answers ${response.status}; is it still running?`);
  return answer;
}

const fileAddress = (name) => `files/${encodeURIComponent(name)}`;
/** A name without its ending, short enough to be continued. */
function stem(name) {
  let short = [...name.replace(/\.[^.]*$/, "")];
  while (new TextEncoder().encode(short.join("")).length > 160) short = short.slice(0, -1);
  return short.join("");
}
const size = (bytes) => bytes < 1e3 ? `${bytes} B` : bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
const number = (value) => value === null || value === undefined ? "" : Number(value).toPrecision(4);

/** Where the focus was in a table that is made anew, it is on the same again. */
function keepingFocus(change) {
  const label = document.activeElement.getAttribute("aria-label");
  change();
  if (label && document.activeElement === document.body) document.querySelector(`[aria-label="${CSS.escape(label)}"]`)?.focus();
}

async function refresh() {
  project = await ask("project");
  find("folder").textContent = project.folder;
  fill(find("structure"), project.structures, (s) => [s.name, `${s.name}: ${s.description}`], 1);
  fill(find("estimator"), project.estimators, (e) => [e.name, `${e.name}: ${e.description}`], 1);
  const records = project.files.filter((file) => file.kind === "record");
  fill(find("report-record"), records, (file) => [file.name, file.name], 0);
  keepingFocus(() => find("file-rows").replaceChildren(...project.files.map(fileRow)));
  const chosen = new Set([...find("models").querySelectorAll(":checked")].map((box) => box.value));
  const models = project.files.filter((file) => file.kind === "model");
  find("models").replaceChildren(...models.map(({ name }) =>
    make("label", {}, make("input", { type: "checkbox", value: name, checked: chosen.has(name) }), ` ${name}`)));
}

/** Fills a choice with options behind the first `kept`, unless it has them. */
function fill(select, items, pair, kept) {
  const wanted = items.map(pair);
  const values = [...select.options].slice(kept).map((option) => option.value);
  if (JSON.stringify(values) === JSON.stringify(wanted.map(([value]) => value))) return;
  while (select.options.length > kept) select.remove(kept);
  for (const [value, text] of wanted) select.append(make("option", { value }, text));
}

function fileRow({ name, kind, size: bytes }) {
  const actions = [];
  const button = (text, act) => actions.push(make("button", { type: "button", "aria-label": `${text} ${name}`, onclick: act }, text), " ");
  if (["record", "model", "curve"].includes(kind)) button("Open", () => openFile(name, kind === "model" ? kind : "record"));
  if (["curve", "arm"].includes(kind)) button("Export", () => openFile(name, kind));
  if (kind === "page") button("Show", () => show(name));
  actions.push(make("a", { href: `${fileAddress(name)}?download`, download: name, "aria-label": `Download ${name}` }, "Download"));
  return make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, kind), make("td", {}, size(bytes)), make("td", {}, ...actions));
}

/** Sends files one after the other, with their progress. */
async function send(files) {
  const bar = find("upload-progress");
  for (const file of files) {
    say(`taking ${file.name}`);
    complain("");
    bar.hidden = false;
    try {
      const kept = await new Promise((done, fail) => {
        const request = new XMLHttpRequest();
        request.open("PUT", fileAddress(file.name));
        request.upload.onprogress = (event) => { bar.value = event.total ? event.loaded / event.total : 0; };
        request.onload = () => {
          const answer = JSON.parse(request.responseText || "{}");
          return request.status === 200 ? done(answer.name) : fail(new Error(answer.problem || `the app answers ${request.status}`));
        };
        request.onerror = () => fail(new Error(`${file.name} was not taken; is the app still running?`));
        request.send(file);
      });
      await refresh();
      say(`${kept} is in the project`);
      const own = project.files.find((file) => file.name === kept);
      if (own && own.kind === "record") openFile(kept, own.kind);
    } catch (error) {
      complain(error.message);
    }
    bar.hidden = true;
  }
}

function openFile(name, kind) {
  open = { name, kind, reading: {} };
  find("reading").reset();
  find("how").open = false;
  find("work-title").textContent = `Work on ${name}`;
  find("work-hint").hidden = true;
  find("record").hidden = kind !== "record";
  find("report").hidden = kind !== "model";
  find("export").hidden = kind === "record";
  find("topics").hidden = true;
  find("columns").hidden = true;
  const formats = project.formats.filter((format) => kind !== "arm" || format.arm);
  fill(find("format"), formats, (f) => [f.name, `${f.name}: ${f.description}`], 0);
  kindOfExport();
  find("export").elements.name.value = stem(name).replace(/[^A-Za-z0-9_]/g, "_").replace(/^[^A-Za-z]+/, "") || "model";
  find("work-title").focus();
  if (kind === "record") look();
}

/** The page that a look writes: none where there is one that is younger than the record, of which it is the only one. */
function lookPage({ name, reading }) {
  const page = `${stem(name)}-look.html`;
  const [record, shown] = [name, page].map((wanted) => project.files.find((file) => file.name === wanted));
  const others = project.files.some((file) => file.kind === "record" && file.name !== name && stem(file.name) === stem(name));
  if (Object.keys(reading).length || others || !shown || !record || !(shown.modified > record.modified)) return { report: page };
  show(page);
  return {};
}

async function look() {
  const own = open;
  const job = await run({ command: "look", files: [own.name], options: own.reading, outputs: lookPage(own), json: true });
  if (own !== open) return;
  if (!job || job.state !== "done") {
    find("how").open = true;
    return;
  }
  const seen = JSON.parse(job.result);
  if (seen.topics) return showTopics(seen.topics);
  const next = ((seen.next && seen.next.command) || "").match(/'[^']*'|\S+/g) || [];
  const named = (option) => {
    const at = next.indexOf(`--${option}`);
    return at < 0 ? [] : next[at + 1].replace(/^'|'$/g, "").split(",");
  };
  const either = (one, other) => (named(one).length ? named(one) : named(other));
  const [inputs, outputs] = [either("input", "x"), either("output", "y")];
  find("structure").value = named("structure")[0] || "";
  const identify = find("identify").elements;
  for (const option of ["missing", "robust"]) identify[option].checked = next.includes(`--${option}`);
  for (const step of ["resample", "hold", "outliers", "fill"]) identify[step].value = named(step).join(",");
  find("column-rows").replaceChildren(...seen.columns.map((column) => make("tr", {},
    make("th", { scope: "row" }, column.name),
    make("td", {}, make("input", { type: "checkbox", name: "input", value: column.name, "aria-label": `${column.name} is an input`, checked: inputs.includes(column.name) })),
    make("td", {}, make("input", { type: "radio", name: "output", value: column.name, "aria-label": `${column.name} is the output`, checked: outputs.includes(column.name) })),
    make("td", {}, column.unit || ""), make("td", {}, number(column.least)), make("td", {}, number(column.greatest)), make("td", {}, String(column.missing)),
  )));
  const names = seen.columns.map((column) => column.name);
  const joint = find("robot-joint").elements;
  joint.kind.value = named("motor").length ? "flexible" : "rigid";
  kindOfJoint();
  for (const role of ["torque", "position", "motor", "link"]) {
    joint[role].replaceChildren(make("option", { value: "" }, "choose"), ...names.map((name) => make("option", { value: name }, name)));
    const usual = { torque: "effort", position: "position" }[role];
    joint[role].value = named(role)[0] || (open.reading.joint && names.includes(usual) ? usual : "");
  }
  find("findings").replaceChildren(...(seen.findings || []).map((text) => make("li", {}, text)));
  find("columns").hidden = false;
}

function showTopics(topics) {
  const readable = topics.filter((topic) => !topic.problem && topic.messages > 0);
  find("topic").replaceChildren(...readable.map((topic) => make("option", { value: topic.name }, `${topic.name} (${topic.type}, ${topic.messages} messages)`)));
  const joints = () => {
    const topic = readable.find((own) => own.name === find("topic").value);
    fill(find("joint"), (topic && topic.joints) || [], (joint) => [joint, joint], 1);
  };
  find("topic").onchange = joints;
  joints();
  find("topics").hidden = false;
  say("choose a topic of the bag");
}

find("read-topic").addEventListener("click", () => {
  open.reading = { ...open.reading, topic: find("topic").value };
  delete open.reading.joint;
  if (find("joint").value) open.reading.joint = find("joint").value;
  look();
});

/** What the fields of a form say, without those that are empty. */
function fields(form) {
  return Object.fromEntries([...new FormData(form)].filter(([, value]) => value !== ""));
}

function onSubmit(id, act) {
  find(id).addEventListener("submit", (event) => {
    event.preventDefault();
    act(event.target);
  });
}

onSubmit("reading", (form) => {
  open.reading = fields(form);
  look();
});

onSubmit("prepare", async (form) => {
  const options = { ...fields(form), ...open.reading };
  const job = await run({ command: "prepare", files: [open.name], options, outputs: { out: `${stem(open.name)}-prepared.csv` } });
  if (job && job.state === "done") {
    form.reset();
    openFile(job.outputs.out, "record");
  }
});

/** The columns that are chosen as inputs, and as output. */
function chosen() {
  const names = (role) => [...document.querySelectorAll(`#column-rows [name=${role}]:checked`)].map((box) => box.value);
  return [names("input").join(","), names("output").join(",")];
}

onSubmit("identify", async (form) => {
  const options = { ...fields(form), ...open.reading };
  const [input, output] = chosen();
  if (input) options.input = input;
  if (output) options.output = output;
  const base = [stem(open.name), options.structure].filter(Boolean).join("-");
  await run({ command: "identify", files: [open.name], options, outputs: { model: `${base}.json`, report: `${base}.html` } });
});

onSubmit("regress", async (form) => {
  const [x, y] = chosen();
  if (!x || !y) return complain("choose inputs and an output among the columns");
  const base = `${stem(open.name)}-curve`;
  const outputs = { out: `${base}.csv`, json: `${base}.json`, report: `${base}.html` };
  await run({ command: "regress", files: [open.name], options: { ...fields(form), ...open.reading, x, y }, outputs });
});

/** Shows what the kind of joint needs, and leaves out the rest. */
function kindOfJoint() {
  const form = find("robot-joint");
  for (const kind of ["rigid", "flexible"]) {
    for (const label of form.querySelectorAll(`.${kind}`)) {
      label.hidden = form.elements.kind.value !== kind;
      label.querySelector("input, select").disabled = label.hidden;
    }
  }
}
find("robot-joint").elements.kind.addEventListener("change", kindOfJoint);

onSubmit("robot-joint", async (form) => {
  const { kind, arm, ...options } = { ...fields(form), ...open.reading };
  const base = [stem(open.name), open.reading.joint].filter(Boolean).join("-").replace(/[/\\:]/g, "-");
  const outputs = { friction: `${base}-friction.csv`, json: `${base}-joint.json`, report: `${base}-joint.html` };
  if (kind === "flexible") outputs.stiffness = `${base}-stiffness.csv`;
  if (arm) outputs.arm = `${base}-arm.toml`;
  await run({ command: "joint", files: [open.name], options, outputs });
});

onSubmit("compare", async () => {
  const models = [...find("models").querySelectorAll(":checked")].map((box) => box.value);
  if (!models.length) return complain("choose one model or more");
  await run({ command: "compare", files: [...models, open.name], options: open.reading, outputs: { report: `${stem(open.name)}-compared.html` } });
});

onSubmit("report", async (form) => {
  const { record } = fields(form);
  if (!record) return complain("there is no record in the project");
  await run({ command: "report", files: [open.name, record], outputs: { out: `${stem(open.name)}-on-${stem(record)}.html` } });
});

/** Shows what the format has a choice of. */
function kindOfExport() {
  const isFmu = find("format").value === "fmu";
  find("fmi").hidden = !isFmu;
  find("fmi").querySelector("select").disabled = !isFmu;
}
find("format").addEventListener("change", kindOfExport);

onSubmit("export", async (form) => {
  const options = fields(form);
  const extension = { c: "c", fmu: "fmu", onnx: "onnx", python: "py", matlab: "m" }[options.to];
  await run({ command: "export", files: [open.name], options, outputs: { out: `${options.name}.${extension}` } });
});

/** A message of the command line in the words of this page: fields instead of options. */
function inFields(text) {
  const label = (name) => [...document.querySelectorAll(`#work [name="${name}"]`)].map((field) => field.closest("label")).find(Boolean);
  return text.trim().replace(/--([a-z][a-z-]*)(?:[ =][A-Z][A-Z_]*)?/g, (option, name) => {
    if (["input", "output", "x", "y"].includes(name)) return { input: "Input", x: "Input", output: "Output", y: "Output" }[name];
    const found = label(name);
    return found ? `"${found.firstChild.textContent.trim() || found.textContent.trim()}"` : option;
  });
}

/** Runs a command to its end, and shows how far it is. */
async function run(request) {
  complain("");
  let number;
  try {
    number = (await ask("jobs", { method: "POST", body: JSON.stringify(request) })).job;
  } catch (error) {
    complain(error.message);
    return null;
  }
  find("no-runs").hidden = true;
  const title = `${request.command} ${request.files.join(" ")}`;
  const state = make("span", {}, "running");
  const bar = make("progress", { "aria-label": title });
  const stop = make("button", { type: "button", "aria-label": `Cancel ${title}`, onclick: () => ask(`jobs/${number}`, { method: "DELETE" }) }, "Cancel");
  const item = make("li", { "data-job": number, tabindex: "-1" }, make("strong", {}, title), ": ", state, " ", bar, " ", stop);
  find("run-list").prepend(item);
  say(`${title} is running`);
  try {
    for (;;) {
      const job = await ask(`jobs/${number}`);
      if (job.state === "running") {
        state.textContent = `running, ${job.seconds.toFixed(0)} s ${job.progress}`;
        const share = job.progress.match(/(\d+) %/);
        if (share) bar.value = Number(share[1]) / 100;
        await new Promise((wake) => setTimeout(wake, 250));
        continue;
      }
      bar.remove();
      if (document.activeElement === stop) item.focus();
      stop.remove();
      item.dataset.state = job.state;
      state.textContent = `${job.state} after ${job.seconds.toFixed(1)} s`;
      state.className = job.state;
      say(`${title}: ${job.state}`);
      if (job.messages) item.append(make("pre", { tabindex: "0" }, inFields(job.messages)));
      if (job.result && job.state === "done") item.append(...told(request, job.result));
      if (job.state === "failed") complain(inFields(job.messages));
      await refresh();
      for (const name of Object.values(job.outputs)) {
        item.append(make("a", { href: `${fileAddress(name)}?download`, download: name }, `Download ${name}`), " ");
        const { kind } = project.files.find((file) => file.name === name) || {};
        if (kind === "page") show(name);
        if (["model", "curve", "arm"].includes(kind)) {
          item.append(make("button", { type: "button", onclick: () => openFile(name, kind) }, `Export ${name}`), " ");
        }
      }
      return job;
    }
  } catch (error) {
    complain(error.message);
    return null;
  }
}

/** What a command printed: its text, or what the object says to know before trusting it. */
function told(request, result) {
  if (request.json) return [];
  if (!request.outputs.json) return [make("pre", { tabindex: "0" }, result.trim())];
  const object = JSON.parse(result);
  const notes = object.findings || object.warnings || [];
  return notes.length ? [make("ul", {}, ...notes.map((note) => make("li", {}, note)))] : [];
}

/** Shows a page of the project. */
function show(name) {
  find("no-page").hidden = true;
  find("shown-title").textContent = name;
  find("page-link").hidden = false;
  find("page-link").firstChild.href = fileAddress(name);
  find("frame").replaceChildren(make("iframe", { src: fileAddress(name), title: name, sandbox: "allow-scripts allow-downloads" }));
}

find("upload").addEventListener("change", (event) => {
  send([...event.target.files]).then(() => { event.target.value = ""; });
});
const drop = find("drop");
for (const kind of ["dragover", "dragleave", "drop"]) {
  document.addEventListener(kind, (event) => {
    event.preventDefault();
    drop.classList.toggle("over", kind === "dragover");
    if (kind === "drop") send([...event.dataTransfer.files]);
  });
}

refresh().then(() => { document.documentElement.dataset.ready = "true"; }, (error) => complain(error.message));
// Another tab, or the command line, may have changed the folder.
addEventListener("focus", () => { refresh().catch((error) => complain(error.message)); });
