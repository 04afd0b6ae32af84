// Other wood for pieces of a plan: somebody goes over those that do not please with a finger, and another plan is made in
// which they have other wood, and all others what they have.
import {h, svg} from "../dom.js";
import {t} from "../words.js";
import {changed, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button} from "../parts.js";
import {heartOf, holds} from "../outlines.js";

let of = 0;                 // the plan
const chosen = new Set();   // marks
let last = null, adds = null;  // where the finger was, and what its stroke does: as with its first piece

export const choosesIn = (plan) => of === plan;

// Wood that no other piece touches: a square within the piece's own, and within its rim.
function heartOfPiece({panel, panel_outline_mm: ring}) {
  const heart = heartOf(ring);
  if (!heart || heart.half < .5) return null;
  const half = .9 * heart.half;
  return [panel, ...[heart.x - half, heart.y - half, 2 * half, 2 * half].map((mm) => mm.toFixed(2))].join(",");
}

// ---- the finger -----------------------------------------------------------------------------------------------------

// Over the preview; `box`: of all pieces, in millimetres of the artwork.
export function chooser(plan, pieces, box) {
  if (!choosesIn(plan) || !box) return null;
  const wide = box.right - box.left, high = box.high - box.low;
  const pieceAt = ([x, y]) => pieces.find((piece) => piece.panel && holds(piece.artwork_outline_mm, x, y));
  const go = (event, begins) => {
    const place = event.currentTarget.getBoundingClientRect();
    const to = [box.left + (event.clientX - place.left) / place.width * wide, box.high - (event.clientY - place.top) / place.height * high];
    if (begins) { last = to; adds = null; }
    // A quick finger is felt here and there.
    const [from, steps] = [last, Math.ceil(150 * Math.hypot((to[0] - last[0]) / wide, (to[1] - last[1]) / high))];
    last = to;
    for (let step = steps ? 1 : 0; step <= steps; ++step) {
      const piece = pieceAt(steps ? from.map((at, i) => at + (to[i] - at) * step / steps) : to);
      if (!piece) continue;
      if (adds === null) adds = !chosen.has(piece.mark);
      if (adds) chosen.add(piece.mark); else chosen.delete(piece.mark);
    }
    changed();
  };
  const path = (piece) => `M${piece.artwork_outline_mm.map(([x, y]) => `${(x - box.left).toFixed(2)} ${(box.high - y).toFixed(2)}`).join("L")}Z`;
  return svg("svg.chooser", {viewBox: `0 0 ${box.right - box.left} ${box.high - box.low}`, preserveAspectRatio: "none", "data-key": "chooser", role: "img", "aria-label": t("other.about"),
    onpointerdown: (event) => { if (event.button !== 0 || !event.isPrimary) return; event.currentTarget.setPointerCapture(event.pointerId); go(event, true); },
    onpointermove: (event) => { if (event.isPrimary && event.currentTarget.hasPointerCapture(event.pointerId)) go(event, false); }},
    svg("path", {d: pieces.filter((piece) => chosen.has(piece.mark)).map(path).join("")}));
}

// `begun` is told of the task that makes the other plan.
export function chooserTools(plan, pieces, begun) {
  const on = choosesIn(plan);
  const put = () => { of = on ? 0 : plan; chosen.clear(); changed(); };
  return h("div.commands", {"data-key": "other"},
    button(t(on ? "other.off" : "other.on"), put, {"data-command": "other", "aria-pressed": String(on), disabled: !on && (!mayChange() || !pieces.length)}),
    on && h("p.dim", {}, t("other.about")),
    on && button(t("other.make", {n: chosen.size}), () => make(plan, pieces, begun), {wide: true, "data-command": "other-wood", next: chosen.size > 0, disabled: !chosen.size || !mayChange()}));
}

async function make(plan, pieces, begun) {
  const replan = pieces.filter((piece) => chosen.has(piece.mark));
  const started = await command(`/plans/${plan}/changes`, {body: {replan: replan.map((piece) => piece.mark), forbid: replan.map(heartOfPiece).filter(Boolean)}});
  if (!started) return;
  of = 0;
  chosen.clear();
  begun(started.task);
}
