import type { MakeEngine } from "./engine.js";
declare const makeEngine: MakeEngine;
export default makeEngine;
