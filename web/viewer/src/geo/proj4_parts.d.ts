/** The parts of proj4 that are taken; its own types are of the whole. */
declare module "proj4/lib/core" {
  interface Converter {
    forward(place: number[]): number[];
    inverse(place: number[]): number[];
  }
  const proj4: (from: string, to: string) => Converter;
  export default proj4;
}
declare module "proj4/lib/Proj" {
  const Proj: { projections: { add(projection: object): void } };
  export default Proj;
}
declare module "proj4/lib/projections/*" {
  const projection: object;
  export default projection;
}
