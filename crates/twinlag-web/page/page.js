(() => {
  "use strict";
  const byId = (id) => document.getElementById(id);
  const columnRoles = { time: "time", t1: "T1", t2: "T2" };
  const knownOf = { T1: "known-t1", T2: "known-t2" };
  const knownInputs = [...Object.values(knownOf), "noise"];
  let files = [];                       // name and bytes of each
  let chosen = {};                      // what the user has said of columns and time; the rest is guessed
  let grouping = {};                    // and of groups of channels: a group's name, or that they are joined
  let groups;                           // of the first file, once they are read
  let generation = 0;                   // a reply to an older question is out of date
  let worker, started, isWorking = false;
  let reading;                          // ends once the files are read as they are chosen
  const waiting = new Map();            // requests that are not answered, by number
  let requests = 0;
  const links = { answer: [], gas: [] };
  let answered;                         // the diagnosis that is shown: its report, JSON and model

  // --- the worker

  const workerUrl = URL.createObjectURL(new Blob([byId("worker").textContent], { type: "text/javascript" }));
  const wasm = unpacked();

  // A browser unpacks gzip alone: so is the unpacker packed, and all else by LZMA.
  async function unpacked() {
    const plain = new Blob([bytesOf("unpacker")]).stream().pipeThrough(new DecompressionStream("gzip"));
    await unpacker({ module_or_path: await new Response(plain).arrayBuffer() });
    return unpacker.unpack(bytesOf("wasm")).buffer;
  }

  // The bytes that an element holds, which is removed.
  function bytesOf(id) {
    const base64 = byId(id).textContent.trim();
    byId(id).remove();
    return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  }

  function ask(what, details = {}) {
    const id = ++requests;
    const answered = new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
    worker.postMessage({ id, ask: what, ...details });
    return answered;
  }

  function end(reason) {
    worker?.terminate();
    for (const { reject } of waiting.values()) reject(Object.assign(new Error(reason), { isEnded: true }));
    waiting.clear();
  }

  async function begin() {
    const code = await wasm;
    worker = new Worker(workerUrl);
    worker.onerror = (event) => end(event.message || "its worker has failed");
    worker.onmessage = ({ data: { id, answer, problem, isBroken, progress } }) => {
      if (progress) return show(progress);
      const { resolve, reject } = waiting.get(id) ?? {};
      waiting.delete(id);
      if (problem === undefined) return resolve?.(answer);
      reject?.(Object.assign(new Error(problem), { isBroken }));
    };
    await ask("start", { wasm: code });
  }

  // Begins, and says where the browser cannot.
  function start() {
    started = begin();
    started.catch((error) => {
      if (error.isEnded && isWorking) return;
      warn(`This page needs a browser of 2023 or later that runs WebAssembly in a worker: ${error.message}. The program and the Python package `
        + "read the same files.");
    });
  }
  start();

  function warn(text) {
    byId("read").replaceChildren(element("p", text, "warning"));
  }

  // Ends what is being worked on. What was answered before is of a session that is gone.
  async function restart() {
    end("stopped");
    byId("answer").hidden = byId("gas").hidden = byId("asking").hidden = true;
    start();
    await started;
  }

  // --- files and columns

  async function take(list) {
    const taken = [...list];
    if (taken.length === 0) return;
    const mine = ++generation;
    byId("asking").hidden = true;
    byId("read").replaceChildren(element("p", "Reading …"));
    try {
      const read = await Promise.all(taken.map(async (file) => ({ name: file.name, bytes: await file.arrayBuffer() })));
      if (mine !== generation) return;
      files = read;
      forget();
      grouping = {};
      groups = undefined;
      for (const id of knownInputs) byId(id).value = "";
      await readFiles();
    } catch (error) {
      if (mine === generation) warn(`What was dropped cannot be read (${error.message}): drop files, not folders.`);
    }
  }

  // What was answered is not of what is asked now.
  function forgetAnswer() {
    answered = undefined;
    byId("answer").hidden = byId("gas").hidden = true;
    say("");
  }

  function forget() {
    chosen = {};
    for (const id of ["period", "time-unit"]) byId(id).value = "";
  }

  // Reads all files anew, with what is chosen. A question that is asked meanwhile waits for it.
  function readFiles() {
    reading = readAsChosen();
    return reading;
  }

  async function readAsChosen() {
    if (files.length === 0) return;
    const mine = ++generation;
    const wasWorking = isWorking;
    if (wasWorking) await restart();
    forgetAnswer();
    if (wasWorking) say("Stopped, since the files or columns are others now.");
    try {
      await started;
      const known = groups ?? await ask("groups", { file: files[0] });
      if (mine !== generation) return;
      groups = known;
      const found = await ask("read", { files, selection: JSON.stringify(chosen), join: false, ...grouping });
      if (mine !== generation) return;
      byId("read").replaceChildren(...found.map(about));
      offer(groups);
      const first = found.find(({ inspection }) => inspection);
      byId("columns").hidden = !first;
      if (first) columns(first.inspection);
      byId("asking").hidden = !found.every(({ inspection }) => inspection?.record);
    } catch (error) {
      if (error.isBroken) await restart();
      if (mine !== generation) return;
      byId("asking").hidden = true;
      if (!error.isEnded) warn(`The files cannot be read in this page: ${error.message}.`);
    }
  }

  function element(tag, text, className) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  }

  const digits = (value) => String(Number(value.toPrecision(5)));

  function about({ name, problem, inspection }) {
    const box = element("div", undefined, "file");
    const record = inspection?.record;
    const length = record && `${record.samples} samples, one every ${digits(record.sampling.period_s)} s, ${digits(record.length_s)} s in all`;
    box.append(element("p", record ? `${name}: ${length}` : name));
    const fault = problem ?? inspection?.problem;
    if (fault) box.append(element("p", fault, "warning"));
    const notes = inspection?.notes ?? [];
    if (notes.length > 0) {
      const folded = element("details");
      folded.append(element("summary", `How it was read (${notes.length === 1 ? "1 note" : `${notes.length} notes`})`));
      notes.forEach((note) => folded.append(element("p", note, "note")));
      box.append(folded);
    }
    return box;
  }

  const option = (text, value) => Object.assign(element("option", text), { value });

  // Sheets or groups to choose from, where there are several.
  function offer(groups) {
    byId("grouping").hidden = groups.length < 2;
    byId("group").replaceChildren(
      option("as guessed", "{}"),
      ...groups.map(([group, about]) => option(about, JSON.stringify({ group }))),
      option("all, joined on the stamps of one", JSON.stringify({ join: true })),
    );
    byId("group").value = JSON.stringify(grouping);
  }

  function columns({ columns }) {
    const row = (cells, tag) => {
      const made = element("tr");
      made.append(...cells.map((cell) => Object.assign(element(tag, cell), tag === "th" ? { scope: "col" } : {})));
      return made;
    };
    const number = (value) => (value === null ? "" : digits(value));
    byId("found").replaceChildren(
      row(["number", "name", "unit", "holds", "missing", "min", "max", "taken as"], "th"),
      ...columns.map((c) => row([String(c.number), c.name, c.unit, c.kind, String(c.missing), number(c.minimum), number(c.maximum),
        c.taken_as ?? ""], "td")),
    );
    for (const [role, taken_as] of Object.entries(columnRoles)) {
      const taken = columns.find((c) => c.taken_as === taken_as);
      const unsaid = option(taken && !chosen[role] ? `as guessed: ${taken.name}` : "as guessed", "");
      const options = columns.map((c) => option(`${c.number}: ${c.name}`, JSON.stringify(reference(c, columns))));
      byId(role).replaceChildren(unsaid, ...options);
      byId(role).value = chosen[role] === undefined ? "" : JSON.stringify(chosen[role]);
    }
  }

  // A column by its name, where that says which one it is, else by its number.
  function reference(column, columns) {
    const isAlone = columns.filter(({ name }) => name === column.name).length === 1;
    return column.name !== "" && isAlone ? column.name : column.number;
  }

  function choose(key, value) {
    if (value === undefined) delete chosen[key]; else chosen[key] = value;
    readFiles();
  }

  // --- questions and answers

  const now = () => new Date().toISOString().replace("T", " ").slice(0, 16) + " UTC";
  const decimal = (id) => byId(id).value.trim().replaceAll(",", ".");

  function say(text) {
    byId("said").textContent = text;
  }

  function show({ task, done, total }) {
    const bar = byId("progress");
    if (total > 0) { bar.max = total; bar.value = done; } else bar.removeAttribute("value");
    byId("task").textContent = total > 0 ? `${task}: ${done} of ${total}` : task;
  }

  function setWorking(is) {
    isWorking = is;
    for (const id of ["diagnose", "compensate", "example"]) byId(id).disabled = is;
    byId("working").hidden = !is;
  }

  // The answer to a question about the files as they are; `undefined` where it is stopped, or refused, which is said.
  async function work(what, details) {
    const mine = generation;
    show({ task: "working", done: 0, total: 0 });
    say("");
    setWorking(true);
    try {
      const answer = await ask(what, { madeAt: now(), ...details });
      return mine === generation ? answer : undefined;
    } catch (error) {
      if (error.isBroken) {
        await restart();
        await readFiles();
        say(`This record is too much for the page (${error.message}). Take fewer rows, or the program, which needs less memory.`);
      } else if (mine === generation) {
        say(error.isEnded ? "Stopped." : error.message);
      }
      return undefined;
    } finally {
      setWorking(false);
    }
  }

  // The answer that is shown stays, where it is the gas temperature that is stopped.
  async function stop() {
    const kept = answered;
    await restart();
    await readFiles();
    if (kept) showAnswer(kept);
    say("Stopped.");
  }

  const stem = () => files[0].name.replace(/\.[^.]*$/, "");

  // Shows a report in its section, with what there is to download.
  function give(section, report, offered) {
    links[section].forEach((url) => URL.revokeObjectURL(url));
    links[section] = offered.map(({ text, type }) => URL.createObjectURL(new Blob([text], { type })));
    byId(`${section}-links`).replaceChildren(...offered.map(({ title, name }, index) =>
      Object.assign(element("a", title), { href: links[section][index], download: name })));
    byId(section).hidden = false;
    // A frame of its own: one that was hidden and is shown again stays blank in Chromium.
    const before = byId(`${section}-report`);
    const frame = before.cloneNode(false);
    frame.srcdoc = report;
    before.replaceWith(frame);
    byId(section).scrollIntoView({ block: "start" });
  }

  const JSON_TYPE = "application/json";

  // What is known beforehand.
  function options() {
    const of = ([sensor, id]) => [sensor, decimal(id).replace(new RegExp(`^${sensor}\\s*=`, "i"), "")];
    const known = Object.entries(knownOf).map(of).filter(([, value]) => value).map(([sensor, value]) => `${sensor}=${value}`);
    const noise_std_k = noise();
    return JSON.stringify({ ...(known.length > 0 && { known }), ...(noise_std_k.length > 0 && { noise_std_k }) });
  }

  // Levels of both sensors. A comma parts them before a blank or beside a decimal point; another one is a decimal comma.
  function noise() {
    const said = byId("noise").value.trim();
    const levels = said.replace(said.includes(".") ? /,/g : /,\s+/g, " ").split(/[;\s]+/).filter(Boolean);
    return levels.map((level) => Number(level.replace(",", ".")));
  }

  function checkNoise() {
    const levels = noise();
    const isEmptyOrPair = levels.length === 0 || (levels.length === 2 && levels.every((level) => Number.isFinite(level) && level > 0));
    return isValid("noise", isEmptyOrPair, "expected the noise of the first and of the second sensor in K, both above 0 and without their unit, such as 0.1, 0.15");
  }

  // NaN where it is no time.
  function periodSeconds() {
    const [, number, unit] = decimal("period").match(/^(\S*?)\s*(s|ms|us|\u00b5s|\u03bcs)?$/u) ?? [];
    const perSecond = { s: 1, ms: 1e3 }[unit ?? "s"] ?? 1e6;
    return number ? Number(number) / perSecond : NaN;
  }

  function checkPeriod() {
    const isTime = Number.isFinite(periodSeconds()) && periodSeconds() > 0;
    return isValid("period", decimal("period") === "" || isTime, "expected a time, such as 0.01 or 10 ms");
  }

  // Says what is expected where an input is not valid.
  function isValid(id, is, expected) {
    byId(id).setCustomValidity(is ? "" : expected);
    if (!is) say(`${byId(id).labels[0].textContent.trim()}: ${expected}`);
    return byId(id).reportValidity();
  }

  async function diagnose() {
    // What is chosen meanwhile is read as well.
    for (let seen; seen !== reading;) await (seen = reading);
    if (isWorking || byId("asking").hidden || !checkPeriod() || !checkNoise()) return;
    const answer = await work("diagnose", { options: options() });
    if (!answer) return;
    showAnswer(answer);
    say("Diagnosed.");
  }

  function showAnswer(answer) {
    answered = answer;
    byId("gas").hidden = true;
    give("answer", answer.report, [
      { title: "Report", name: `${stem()}-report.html`, text: answer.report, type: "text/html" },
      { title: "Answer as JSON", name: `${stem()}-diagnosis.json`, text: answer.json, type: JSON_TYPE },
      { title: "Model", name: `${stem()}-model.json`, text: answer.model, type: JSON_TYPE },
    ]);
  }

  async function compensate() {
    const answer = await work("compensate", { model: answered.model });
    if (!answer) return;
    const csv = answer.csv ? [{ title: "Gas temperature as CSV", name: `${stem()}-gas.csv`, text: answer.csv, type: "text/csv" }] : [];
    give("gas", answer.report, [
      ...csv,
      { title: "Report of the gas", name: `${stem()}-gas-report.html`, text: answer.report, type: "text/html" },
      { title: "Gas as JSON", name: `${stem()}-compensation.json`, text: answer.json, type: JSON_TYPE },
    ]);
    say(answer.csv ? "The gas temperature is reconstructed." : "No gas temperature can be given; the report says why.");
  }

  async function example() {
    try {
      await started;
      await take([new File([await ask("example")], "example.csv", { type: "text/csv" })]);
    } catch (error) {
      if (!error.isEnded) warn(error.message);
    }
  }

  byId("diagnose").addEventListener("click", diagnose);
  byId("compensate").addEventListener("click", compensate);
  byId("stop").addEventListener("click", stop);
  byId("example").addEventListener("click", example);
  byId("files").addEventListener("change", async ({ target }) => {
    await take(target.files);
    // A file that was edited may be chosen again.
    target.value = "";
  });
  for (const role of Object.keys(columnRoles))
    byId(role).addEventListener("change", ({ target }) => choose(role, target.value ? JSON.parse(target.value) : undefined));
  byId("group").addEventListener("change", ({ target }) => {
    grouping = JSON.parse(target.value);
    // Another group has columns and a clock of its own.
    forget();
    readFiles();
  });
  byId("time-unit").addEventListener("change", ({ target }) => choose("time_unit", target.value || undefined));
  // At once, and not when the field is left for the button, which would move from under the pointer.
  for (const id of [...knownInputs, "period"]) byId(id).addEventListener("input", forgetAnswer);
  byId("period").addEventListener("change", () => {
    if (checkPeriod()) choose("period_s", periodSeconds() || undefined);
  });
  // Anywhere: a file that misses its place would be opened instead of the page.
  addEventListener("dragover", (event) => { event.preventDefault(); byId("drop").classList.add("over"); });
  addEventListener("dragleave", () => byId("drop").classList.remove("over"));
  addEventListener("drop", (event) => {
    event.preventDefault();
    byId("drop").classList.remove("over");
    take(event.dataTransfer.files);
  });
})();
