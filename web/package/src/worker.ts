/**
 * The script of a Web Worker that decodes for the engine, in a memory of its own: orders come and answers go as
 * `{ serial, kind, bytes }` and `{ serial, bytes }`, buffers handed over whole. It first says `{}`: ready; and
 * `{ problem }` where it can do no more.
 *
 * The browser's tests run this file as it is: it is JavaScript, too.
 */
import makeWorkerModule from "./terrane_worker.mjs";

const scope = globalThis;

makeWorkerModule().then(
  (module) => {
    scope.onmessage = (event) => {
      const { serial, kind, bytes } = event.data;
      const order = new Uint8Array(bytes);
      const room = module._terrane_order_room(order.length);
      module.HEAPU8.set(order, room);
      const isAnswered = module._terrane_run_order(kind);
      const at = module._terrane_answer();
      const answer = module.HEAPU8.slice(at, at + module._terrane_answer_bytes());
      if (isAnswered) scope.postMessage({ serial, bytes: answer.buffer }, { transfer: [answer.buffer] });
      else scope.postMessage({ problem: new TextDecoder().decode(answer) });
    };
    scope.postMessage({});
  },
  (error) => scope.postMessage({ problem: `its module did not load: ${error}` }),
);
