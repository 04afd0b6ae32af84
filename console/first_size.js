// How large a new picture is proposed to be, and in which patches: as the free wood allows, until somebody types.

const kModest = {size_mm: 190, patch_mm: 14};  // while no panel is known
const kLeast = {size_mm: 20, patch_mm: 5};
const kLargest = 360;  // mm: what is larger somebody has to want
const kShare = .4;     // of the free wood: webs, kerfs and corners into which no patch goes take the rest
const kStep = 5;       // mm

const mayBeCut = (panel) => !panel.retired && !panel.scan_again;
export const waits = (panel) => !panel.retired && Boolean(panel.scan_again);

// `longer`: the picture's longer side in its shorter ones. -> {size_mm: of the shorter side, patch_mm, of_wood: as much as
// is free allows, lack: why none is: "" | "no_wood" | "scan_again": what there is waits for a scan}
export function firstSize(panels, longer = 4 / 3) {
  if (!panels.length) return {...kModest, of_wood: false, lack: ""};
  const free = panels.filter(mayBeCut).reduce((all, panel) => all + (panel.free_mm2 || 0), 0);
  if (!(free > 0) && panels.some((panel) => mayBeCut(panel) && panel.mask === "uncounted")) return {...kModest, of_wood: false, lack: ""};
  if (!(free > 0)) return {...kLeast, of_wood: false, lack: panels.some(waits) ? "scan_again" : "no_wood"};
  const side = Math.floor(Math.sqrt(kShare * free / Math.max(1, longer)) / kStep) * kStep;
  const size_mm = Math.min(kLargest, Math.max(kLeast.size_mm, side));
  return {size_mm, patch_mm: Math.max(kLeast.patch_mm, Math.round(size_mm * kModest.patch_mm / kModest.size_mm)), of_wood: true, lack: ""};
}
