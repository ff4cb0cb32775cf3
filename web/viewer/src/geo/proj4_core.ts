import proj4 from "proj4/lib/core";
import Proj from "proj4/lib/Proj";
import aea from "proj4/lib/projections/aea";
import aeqd from "proj4/lib/projections/aeqd";
import cass from "proj4/lib/projections/cass";
import cea from "proj4/lib/projections/cea";
import eqc from "proj4/lib/projections/eqc";
import eqdc from "proj4/lib/projections/eqdc";
import etmerc from "proj4/lib/projections/etmerc";
import krovak from "proj4/lib/projections/krovak";
import laea from "proj4/lib/projections/laea";
import lcc from "proj4/lib/projections/lcc";
import nzmg from "proj4/lib/projections/nzmg";
import omerc from "proj4/lib/projections/omerc";
import poly from "proj4/lib/projections/poly";
import sinu from "proj4/lib/projections/sinu";
import somerc from "proj4/lib/projections/somerc";
import stere from "proj4/lib/projections/stere";
import sterea from "proj4/lib/projections/sterea";
import tmerc from "proj4/lib/projections/tmerc";
import utm from "proj4/lib/projections/utm";

// The projections that countries and rasters use, without those for atlases of the world: a third of the bytes is saved.
for (const projection of [
  aea,
  aeqd,
  cass,
  cea,
  eqc,
  eqdc,
  etmerc,
  krovak,
  laea,
  lcc,
  nzmg,
  omerc,
  poly,
  sinu,
  somerc,
  stere,
  sterea,
  tmerc,
  utm,
])
  Proj.projections.add(projection);

export default proj4;
