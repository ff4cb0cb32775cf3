/**
 * The script of a Web Worker that decodes for the engine, in a memory of its own. Orders come as `{ serial, kind, bytes, size }`,
 * answers go as `{ serial, bytes, size }`: the first `size` of a buffer that is handed over, and back with the answer if that
 * fits into it. `{}` says that it is ready, at first and whenever `{}` asks; `{ problem }`, that it can do no more.
 *
 * The browser's tests run this file as it is: it is JavaScript, too.
 */
import makeWorkerModule from "./terrane_worker.mjs";

const scope = globalThis;

makeWorkerModule().then(
  (module) => {
    scope.onmessage = (event) => {
      const { serial, kind, bytes, size } = event.data;
      if (bytes === undefined) return scope.postMessage({});
      const room = module._terrane_order_room(size);
      module.HEAPU8.set(new Uint8Array(bytes, 0, size), room);
      const isAnswered = module._terrane_run_order(kind);
      const at = module._terrane_answer();
      const answer = module.HEAPU8.subarray(at, at + module._terrane_answer_bytes());
      if (!isAnswered) return scope.postMessage({ problem: new TextDecoder().decode(answer) });
      const back = answer.length <= bytes.byteLength ? bytes : new ArrayBuffer(answer.length);
      new Uint8Array(back).set(answer);
      scope.postMessage({ serial, bytes: back, size: answer.length }, { transfer: [back] });
    };
    // What asked before this moment was not heard.
    scope.postMessage({});
  },
  (error) => scope.postMessage({ problem: `its module did not load: ${error}` }),
);
