/** `web/module/worker.cpp` as WebAssembly. */
export interface WorkerModule {
  HEAPU8: Uint8Array<ArrayBuffer>;
  _terrane_order_room(bytes: number): number;
  _terrane_run_order(kind: number): number;
  _terrane_answer(): number;
  _terrane_answer_bytes(): number;
}
declare const makeWorkerModule: () => Promise<WorkerModule>;
export default makeWorkerModule;
