// What lies over a panel's scan on its map, and whether it is shown: of every panel that is looked at.
export const kLayers = ["free", "reserved", "cut", "suspect", "scrap", "fiducials", "zones"];
// What is free is a picture of its own and hides the scan, so it is shown when somebody asks for it.
export const hiddenLayers = new Set(["free", "zones"]);
export const isShown = (layer) => !hiddenLayers.has(layer);
