// Other wood for pieces of a plan: somebody goes over those that do not please with a finger, or from one to the next by
// keyboard, and another plan is made in which they have other wood, and all others what they have.
import {h, svg} from "../dom.js";
import {t} from "../words.js";
import {changed, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button} from "../parts.js";
import {brushKey} from "../brush_keys.js";
import {heartOf, holds, middleOf, nextTo} from "../outlines.js";

let of = 0;                 // the plan
const chosen = new Set();   // marks
let last = null, adds = null;  // where the finger was, and what its stroke does: as with its first piece
let stands = "", byKeys = false, said = "";  // the mark where the keyboard is; whether it is in use; what it did last

export const choosesIn = (plan) => of === plan;

// Wood that no other piece touches: a square within the piece's own, and within its rim.
function heartOfPiece({panel, panel_outline_mm: ring}) {
  const heart = heartOf(ring);
  if (!heart || heart.half < .5) return null;
  const half = .9 * heart.half;
  return [panel, ...[heart.x - half, heart.y - half, 2 * half, 2 * half].map((mm) => mm.toFixed(2))].join(",");
}

// ---- the keyboard ---------------------------------------------------------------------------------------------------

// Space takes the piece or leaves it; Shift with an arrow makes of the next one what this one is.
function keyed(event, placed) {
  const key = brushKey(event);
  const from = placed.find((piece) => piece.mark === stands) || placed[0];
  if (!key || !from) return;
  byKeys = true;
  const turns = !key.across && !key.down;
  const to = turns ? from : nextTo(placed, from, key.across, key.down) || from;
  const take = turns ? !chosen.has(from.mark) : chosen.has(from.mark);
  if (key.paints && take) chosen.add(to.mark);
  if (key.paints && !take) chosen.delete(to.mark);
  say(to);
}

function say(piece) {
  stands = piece.mark;
  said = t(chosen.has(piece.mark) ? "other.gets" : "other.keeps", {mark: piece.mark, n: chosen.size});
  changed();
}

// ---- the finger -----------------------------------------------------------------------------------------------------

// Over the preview; `box`: of all pieces, in millimetres of the artwork.
export function chooser(plan, pieces, box) {
  if (!choosesIn(plan) || !box) return null;
  const wide = box.right - box.left, high = box.high - box.low;
  const placed = pieces.filter((piece) => piece.panel);
  const pieceAt = ([x, y]) => placed.find((piece) => holds(piece.artwork_outline_mm, x, y));
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
  // What is chosen has a cross as well: wood may be of any colour.
  const cross = ({artwork_outline_mm: ring}) => {
    const [x, y] = middleOf(ring), [right, down] = [x - box.left, box.high - y], r = Math.sqrt(wide * high / pieces.length) / 6;
    return [1, -1].map((up) => `M${(right - r).toFixed(2)} ${(down - up * r).toFixed(2)}L${(right + r).toFixed(2)} ${(down + up * r).toFixed(2)}`).join("");
  };
  return svg("svg.chooser", {viewBox: `0 0 ${box.right - box.left} ${box.high - box.low}`, preserveAspectRatio: "none", "data-key": "chooser", role: "application", tabindex: 0, "aria-label": t("other.map"), "aria-describedby": "other-keys",
    onkeydown: (event) => keyed(event, placed),
    onfocus: (event) => { if (!event.currentTarget.matches(":focus-visible") || !placed.length) return; byKeys = true; say(placed.find((piece) => piece.mark === stands) || placed[0]); },
    onblur: () => { byKeys = false; changed(); },
    onpointerdown: (event) => { if (event.button !== 0 || !event.isPrimary) return; event.currentTarget.setPointerCapture(event.pointerId); go(event, true); },
    onpointermove: (event) => { if (event.isPrimary && event.currentTarget.hasPointerCapture(event.pointerId)) go(event, false); }},
    svg("path", {d: pieces.filter((piece) => chosen.has(piece.mark)).map(path).join("")}),
    ...["sign", "sign.inner"].map((look) => svg(`path.${look}`, {d: placed.map((piece) => (chosen.has(piece.mark) ? cross(piece) : "") + (byKeys && piece.mark === stands ? path(piece) : "")).join("")})));
}

// `begun` is told of the task that makes the other plan.
export function chooserTools(plan, pieces, begun) {
  const on = choosesIn(plan);
  const put = () => { of = on ? 0 : plan; chosen.clear(); stands = said = ""; changed(); };
  return h("div.commands", {"data-key": "other"},
    button(t(on ? "other.off" : "other.on"), put, {"data-command": "other", "aria-pressed": String(on), disabled: !on && (!mayChange() || !pieces.length)}),
    on && h("p.dim.wide", {}, t("other.about")),
    on && h("p.dim.keys.wide", {id: "other-keys"}, t("other.keys")),
    on && h("p.dim.wide", {role: "status", id: "other-said"}, said),
    on && button(t("other.make", {n: chosen.size}), () => make(plan, pieces, begun), {wide: true, "data-command": "other-wood", next: chosen.size > 0, disabled: !chosen.size || !mayChange()}));
}

async function make(plan, pieces, begun) {
  const replan = pieces.filter((piece) => chosen.has(piece.mark));
  const started = await command(`/plans/${plan}/changes`, {body: {replan: replan.map((piece) => piece.mark), forbid: replan.map(heartOfPiece).filter(Boolean)}});
  if (!started) return;
  of = 0;
  chosen.clear();
  stands = said = "";
  begun(started.task);
}
