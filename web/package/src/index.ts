export * from "./api.js";
export { createViewer } from "./viewer.js";
