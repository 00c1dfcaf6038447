// The worker: one session, and one request at a time. It is ended, and begun anew, to stop a request.
"use strict";
let page;
let first; // the bytes of the first file

function sayProgress(task, done, total) {
  self.postMessage({ progress: { task, done, total } });
}

// What the session refuses is thrown as a plain error; a trap and an exhausted stack are others, after which it is not to be trusted.
const isRefusal = (error) => error instanceof Error && error.constructor === Error;

function orRefusal(work, refused) {
  try {
    return work();
  } catch (error) {
    if (!isRefusal(error)) throw error;
    return refused(error.message);
  }
}

const answers = {
  start: ({ wasm }) => {
    wasm_bindgen.initSync({ module: wasm });
    page = new wasm_bindgen.Page();
  },
  example: () => wasm_bindgen.Page.example(),
  groups: ({ file: { name, bytes } }) =>
    orRefusal(() => JSON.parse(wasm_bindgen.Page.groups(name, new Uint8Array(bytes))), () => []),
  // A new session with these files; what is in each of them.
  read: ({ files, selection, group, join }) => {
    page.free();
    page = new wasm_bindgen.Page();
    const read = ({ name, bytes }) => ({ name, inspection: JSON.parse(page.add(name, new Uint8Array(bytes), selection, group, join)) });
    first = new Uint8Array(files[0].bytes);
    return files.map((file) => orRefusal(() => read(file), (problem) => ({ name: file.name, problem })));
  },
  diagnose: ({ options, madeAt }) => ({
    json: page.diagnose(options), report: page.report(madeAt), model: page.model(),
  }),
  compensate: ({ model, madeAt }) => ({
    json: page.compensate(model), report: page.gasReport(madeAt), csv: page.gasCsv(first),
  }),
};

self.onmessage = ({ data: { id, ask, ...what } }) => {
  try {
    self.postMessage({ id, answer: answers[ask](what) });
  } catch (error) {
    self.postMessage({ id, problem: error.message, isBroken: !isRefusal(error) });
  }
};
