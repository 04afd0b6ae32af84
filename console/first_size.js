// How large a new picture is proposed to be, and in which patches: as the free wood allows, until somebody types.

const kModest = {size_mm: 190, patch_mm: 14};  // while no panel is known
const kLeast = {size_mm: 20, patch_mm: 5};
const kLargest = 360;  // mm: what is larger somebody has to want
const kShare = .4;     // of the free wood: webs, kerfs and corners into which no patch goes take the rest
const kStep = 5;       // mm

const mayBeCut = (panel) => !panel.retired && !panel.scan_again;

// `longer`: the picture's longer side in its shorter ones. -> {size_mm: of the shorter side, patch_mm, no_wood: there are
// panels, and nothing of them is free}
export function firstSize(panels, longer = 4 / 3) {
  if (!panels.some((panel) => !panel.retired)) return {...kModest, no_wood: false};
  const free = panels.filter(mayBeCut).reduce((all, panel) => all + (panel.free_mm2 || 0), 0);
  if (!(free > 0)) return {...kLeast, no_wood: true};
  const side = Math.floor(Math.sqrt(kShare * free / Math.max(1, longer)) / kStep) * kStep;
  const size_mm = Math.min(kLargest, Math.max(kLeast.size_mm, side));
  return {size_mm, patch_mm: Math.max(kLeast.patch_mm, Math.round(size_mm * kModest.patch_mm / kModest.size_mm)), no_wood: false};
}
