// The worker: one session, and one request at a time. It is ended, and begun anew, to stop a request.
"use strict";
let page;

function sayProgress(task, done, total) {
  self.postMessage({ progress: { task, done, total } });
}

// What the session refuses is thrown as a plain error; a trap and an exhausted stack are others, after which it is not to be trusted.
const isRefusal = (error) => error instanceof Error && error.constructor === Error;

const answers = {
  start: ({ wasm }) => {
    wasm_bindgen.initSync({ module: wasm });
    page = new wasm_bindgen.Page();
  },
  example: () => wasm_bindgen.Page.example(),
  // A new session with these files; what is in each of them.
  read: ({ files, selection }) => {
    page.free();
    page = new wasm_bindgen.Page();
    return files.map(({ name, bytes }) => {
      try {
        return { name, inspection: JSON.parse(page.add(name, new Uint8Array(bytes), selection)) };
      } catch (error) {
        if (!isRefusal(error)) throw error;
        return { name, problem: error.message };
      }
    });
  },
  diagnose: ({ options, madeAt }) => ({
    json: page.diagnose(options), report: page.report(madeAt), model: page.model(),
  }),
  compensate: ({ madeAt }) => ({
    json: page.compensate(), report: page.gasReport(madeAt), csv: page.gasCsv(),
  }),
};

self.onmessage = ({ data: { id, ask, ...what } }) => {
  try {
    self.postMessage({ id, answer: answers[ask](what) });
  } catch (error) {
    self.postMessage({ id, problem: error.message, isBroken: !isRefusal(error) });
  }
};
