"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const [drop, input, read, said] = ["drop", "files", "read", "said"].map(byId);
  const roles = ["time", "t1", "t2"];
  let files = [];      // name and bytes of each
  let worker, requests = 0, waiting = new Map();
  let downloads = [];

  const workerUrl = URL.createObjectURL(new Blob([byId("worker").textContent], { type: "text/javascript" }));
  const wasm = inflated(byId("wasm").textContent.trim());
  byId("wasm").remove();

  async function inflated(base64) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(plain).arrayBuffer();
  }

  function ask(what, details = {}) {
    const id = ++requests;
    const answered = new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
    worker.postMessage({ id, ask: what, ...details });
    return answered;
  }

  async function begin() {
    worker = new Worker(workerUrl);
    worker.onmessage = ({ data: { id, answer, problem, isBroken, progress } }) => {
      if (progress) return show(progress);
      const { resolve, reject } = waiting.get(id);
      waiting.delete(id);
      if (problem === undefined) return resolve(answer);
      reject(Object.assign(new Error(problem), { isBroken }));
    };
    return ask("start", { wasm: await wasm });
  }

  // Ends what is being worked on, and begins anew with the same files.
  async function restart() {
    worker.terminate();
    for (const { reject } of waiting.values()) reject(new Error("stopped"));
    waiting.clear();
    started = begin();
    await started;
    if (files.length > 0) await ask("read", { files, selection: selection() });
  }
  let started = begin();

  function show({ task, done, total }) {
    const bar = byId("progress");
    if (total > 0) { bar.max = total; bar.value = done; } else bar.removeAttribute("value");
    byId("task").textContent = total > 0 ? `${task}: ${done} of ${total}` : task;
  }

  // --- files and columns

  async function take(list) {
    files = await Promise.all([...list].map(async (file) => ({ name: file.name, bytes: await file.arrayBuffer() })));
    byId("known").value = "";
    byId("time-unit").value = "";
    roles.forEach((role) => byId(role).replaceChildren());
    await readFiles();
  }

  function selection() {
    const chosen = {};
    for (const role of roles) if (byId(role).value) chosen[role] = byId(role).value;
    if (byId("time-unit").value) chosen.time_unit = byId("time-unit").value;
    return JSON.stringify(chosen);
  }

  async function readFiles() {
    if (files.length === 0) return;
    await started;
    byId("answer").hidden = true;
    said.textContent = "";
    const found = await ask("read", { files, selection: selection() });
    read.replaceChildren(...found.map(about));
    const first = found.find(({ inspection }) => inspection);
    byId("columns").hidden = !first;
    if (first) columns(first.inspection);
    byId("asking").hidden = !found.every(({ inspection }) => inspection && inspection.record);
  }

  function element(tag, text, className) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  }

  function about({ name, problem, inspection }) {
    const box = element("div", undefined, "file");
    const record = inspection && inspection.record;
    const length = record && `${record.samples} samples, one every ${digits(record.sampling.period_s)} s, ${digits(record.length_s)} s in all`;
    box.append(element("p", record ? `${name}: ${length}` : name));
    const fault = problem ?? (inspection && inspection.problem);
    if (fault) box.append(element("p", fault, "warning"));
    const notes = inspection ? inspection.notes : [];
    if (notes.length > 0) {
      const folded = element("details");
      folded.append(element("summary", `How it was read (${notes.length === 1 ? "1 note" : `${notes.length} notes`})`));
      notes.forEach((note) => folded.append(element("p", note, "note")));
      box.append(folded);
    }
    return box;
  }

  const digits = (value) => String(Number(value.toPrecision(5)));

  function columns({ columns }) {
    const row = (cells, tag) => {
      const made = element("tr");
      made.append(...cells.map((cell) => element(tag, cell)));
      return made;
    };
    const number = (value) => (value === null ? "" : digits(value));
    byId("found").replaceChildren(
      row(["", "name", "unit", "holds", "missing", "min", "max", "taken as"], "th"),
      ...columns.map((c) => row([String(c.number), c.name, c.unit, c.kind, String(c.missing), number(c.minimum), number(c.maximum),
        c.taken_as ?? ""], "td")),
    );
    for (const role of roles) {
      const select = byId(role);
      const old = select.value;
      const options = columns.map((c) => Object.assign(element("option", `${c.number}: ${c.name}`), { value: c.name }));
      select.replaceChildren(Object.assign(element("option", "choose"), { value: "" }), ...options);
      const taken = columns.find((c) => c.taken_as === { time: "time", t1: "T1", t2: "T2" }[role]);
      select.value = taken ? taken.name : old;
    }
  }

  // --- questions and answers

  const now = () => new Date().toISOString().replace("T", " ").slice(0, 16) + " UTC";

  function options() {
    const text = byId("known").value.trim().replace(",", ".");
    if (!text) return "{}";
    return JSON.stringify({ known: [`${byId("t1").value}=${text}s`] });
  }

  async function work(what, details) {
    const buttons = ["diagnose", "compensate", "example"].map(byId);
    buttons.forEach((button) => { button.disabled = true; });
    byId("stop").hidden = byId("working").hidden = false;
    show({ task: "working", done: 0, total: 0 });
    said.textContent = "";
    try {
      return await ask(what, { madeAt: now(), ...details });
    } catch (error) {
      said.textContent = error.isBroken ? `the page has run out of memory, or has a fault (${error.message})` : error.message;
      if (error.isBroken) await restart();
      return undefined;
    } finally {
      buttons.forEach((button) => { button.disabled = false; });
      byId("stop").hidden = byId("working").hidden = true;
    }
  }

  const stem = () => files[0].name.replace(/\.[^.]*$/, "");

  function give(report, links) {
    downloads.forEach((url) => URL.revokeObjectURL(url));
    downloads = links.map(([, , text, type]) => URL.createObjectURL(new Blob([text], { type })));
    byId("downloads").replaceChildren(...links.map(([title, name], index) =>
      Object.assign(element("a", title), { href: downloads[index], download: name })));
    byId("report").srcdoc = report;
    byId("answer").hidden = false;
  }

  byId("diagnose").addEventListener("click", async () => {
    const answer = await work("diagnose", { options: options() });
    if (!answer) return;
    give(answer.report, [
      ["Report", `${stem()}-report.html`, answer.report, "text/html"],
      ["Answer as JSON", `${stem()}-diagnosis.json`, answer.json, "application/json"],
      ["Model", `${stem()}-model.json`, answer.model, "application/json"],
    ]);
    said.textContent = "Diagnosed.";
  });

  byId("compensate").addEventListener("click", async () => {
    const answer = await work("compensate", {});
    if (!answer) return;
    const csv = answer.csv ? [["Gas temperature as CSV", `${stem()}-gas.csv`, answer.csv, "text/csv"]] : [];
    give(answer.report, [
      ...csv,
      ["Report", `${stem()}-gas-report.html`, answer.report, "text/html"],
      ["Answer as JSON", `${stem()}-compensation.json`, answer.json, "application/json"],
    ]);
    said.textContent = answer.csv ? "The gas temperature is reconstructed." : "No gas temperature can be given; the report says why.";
  });

  byId("stop").addEventListener("click", restart);
  input.addEventListener("change", () => take(input.files));
  for (const id of [...roles, "time-unit"]) byId(id).addEventListener("change", readFiles);
  byId("example").addEventListener("click", async () => {
    await started;
    await take([new File([await ask("example")], "example.csv", { type: "text/csv" })]);
  });
  drop.addEventListener("dragover", (event) => { event.preventDefault(); drop.classList.add("over"); });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    drop.classList.remove("over");
    take(event.dataTransfer.files);
  });
})();
