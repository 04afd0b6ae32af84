// The pieces of a plan under a finger or the keyboard, over its preview: one is chosen, or, by brush, those that do not
// please are gone over. What is wanted of them is kept in plan_changes.js.
import {h, svg} from "../dom.js";
import {t} from "../words.js";
import {changed, mayChange} from "../model.js";
import {button} from "../parts.js";
import {picture} from "../pictures.js";
import {brushKey} from "../brush_keys.js";
import {holds, middleOf, nextTo} from "../outlines.js";
import {begin, cannotSwap, choosesIn, planInHand, takeBack, wish, wishedMarks, wishesCard, wishOf} from "./plan_changes.js";
import {forgetPlaces, pieceSheet, woodPath} from "./plan_piece.js";

let brush = false;             // goes over pieces; else one is chosen
let chosen = "", swapping = false;
let last = null, adds = null;  // where the finger was, and what its stroke does: as with its first piece
let stands = "", byKeys = false, said = "";  // the mark where the keyboard is; whether it is in use; what was done last
let cannot = {key: "", marks: new Set()};    // with which the chosen one cannot change places

const getsOther = (mark) => (wishOf(mark) || {}).kind === "other";
const countOther = () => wishedMarks().filter(getsOther).length;

function say(sentence) { said = sentence; changed(); }

function brushOver(piece, take) {
  if (take && !getsOther(piece.mark)) wish(piece.mark, {kind: "other"});
  if (!take && getsOther(piece.mark)) takeBack(piece.mark);
}

// One is chosen, or is the one that the chosen one changes places with.
function pick(plan, pieces, piece) {
  stands = piece.mark;
  if (!swapping || !chosen) { chosen = piece.mark; return say(""); }
  const no = cannotSwap(plan, pieces, pieces.find((one) => one.mark === chosen), piece);
  if (no) return say(no);
  swapping = false;
  say(wish(chosen, {kind: "swap", with: piece.mark}));
}

function swap() {
  const wanted = wishOf(chosen);
  if (wanted && wanted.kind === "swap") { takeBack(chosen); return say(t("wish.back", {mark: chosen})); }
  swapping = !swapping;
  cannot.key = "";
  say(swapping ? t("swap.choose", {mark: chosen}) : "");
}

// Those that the chosen one cannot change places with, while the other one is being chosen.
function cannotBe(plan, pieces) {
  const one = swapping && pieces.find((piece) => piece.mark === chosen);
  if (!one) return new Set();
  const key = `${plan.id} ${chosen} ${wishedMarks().map((mark) => `${mark} ${JSON.stringify(wishOf(mark).number || wishOf(mark).kind)}`)}`;
  if (cannot.key !== key) cannot = {key, marks: new Set(pieces.filter((piece) => piece !== one && cannotSwap(plan, pieces, one, piece)).map((piece) => piece.mark))};
  return cannot.marks;
}

// ---- the keyboard ---------------------------------------------------------------------------------------------------

// By brush Space takes the piece or leaves it, and Shift with an arrow makes of the next one what this one is; else the
// arrows choose, and Space or Enter says that it is the one to change places with.
function keyed(event, plan, placed) {
  if (event.key === "Escape" && swapping) { swapping = false; return say(""); }
  const key = event.key === "Enter" ? {across: 0, down: 0, paints: true} : brushKey(event);
  const from = placed.find((piece) => piece.mark === stands) || placed[0];
  if (!key || !from) return;
  event.preventDefault();
  byKeys = true;
  const turns = !key.across && !key.down;
  const to = turns ? from : nextTo(placed, from, key.across, key.down) || from;
  stands = to.mark;
  if (!brush) {
    if (turns || !swapping) return pick(plan, placed, to);
    return say(cannotSwap(plan, placed, placed.find((piece) => piece.mark === chosen), to) || t("swap.may", {mark: to.mark, other: chosen}));
  }
  if (key.paints) brushOver(to, turns ? !getsOther(from.mark) : getsOther(from.mark));
  tell(to);
}

const tell = (piece) => say(t(getsOther(piece.mark) ? "other.gets" : "other.keeps", {mark: piece.mark, n: countOther()}));

// ---- the finger -----------------------------------------------------------------------------------------------------

// Over the preview; `box`: of all pieces, in millimetres of the artwork.
export function chooser(plan, pieces, box) {
  if (!choosesIn(plan.id) || !box) return null;
  const wide = box.right - box.left, high = box.high - box.low;
  const placed = pieces.filter((piece) => piece.panel);
  const pieceAt = ([x, y]) => placed.find((piece) => holds(piece.artwork_outline_mm, x, y));
  const placeOf = (event) => {
    const place = event.currentTarget.getBoundingClientRect();
    return [box.left + (event.clientX - place.left) / place.width * wide, box.high - (event.clientY - place.top) / place.height * high];
  };
  const go = (event, begins) => {
    const to = placeOf(event);
    if (begins) { last = to; adds = null; }
    // A quick finger is felt here and there.
    const [from, steps] = [last, Math.ceil(150 * Math.hypot((to[0] - last[0]) / wide, (to[1] - last[1]) / high))];
    last = to;
    for (let step = steps ? 1 : 0; step <= steps; ++step) {
      const piece = pieceAt(steps ? from.map((at, i) => at + (to[i] - at) * step / steps) : to);
      if (!piece) continue;
      if (adds === null) adds = !getsOther(piece.mark);
      brushOver(piece, adds);
      stands = piece.mark;
    }
    changed();
  };
  const tap = (event) => { const piece = pieceAt(placeOf(event)); if (piece) pick(plan, pieces, piece); };
  const path = (piece) => `M${piece.artwork_outline_mm.map(([x, y]) => `${(x - box.left).toFixed(2)} ${(box.high - y).toFixed(2)}`).join("L")}Z`;
  const all = (list) => list.map(path).join("");
  const wished = (kind) => pieces.filter((piece) => (wishOf(piece.mark) || {}).kind === kind);
  const r = Math.sqrt(wide * high / pieces.length) / 6;
  const middle = ({artwork_outline_mm: ring}) => { const [x, y] = middleOf(ring); return [x - box.left, box.high - y]; };
  const line = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}`;
  // Each wish has a sign of its own, since wood may be of any colour: a cross, a lock, a double arrow.
  const signs = {
    other: ([x, y]) => [1, -1].map((up) => line([[x - r, y - up * r], [x + r, y + up * r]])).join(""),
    keep: ([x, y]) => `${line([[x - r, y], [x + r, y], [x + r, y + 1.2 * r], [x - r, y + 1.2 * r]])}Z${line([[x - .6 * r, y], [x - .6 * r, y - .8 * r], [x + .6 * r, y - .8 * r], [x + .6 * r, y]])}`,
    swap: ([x, y]) => [1, -1].map((to) => line([[x - to * r, y - .5 * to * r], [x + to * r, y - .5 * to * r]]) + line([[x + .4 * to * r, y - 1.1 * to * r], [x + to * r, y - .5 * to * r], [x + .4 * to * r, y + .1 * to * r]])).join(""),
  };
  const rings = pieces.filter((piece) => (!brush && piece.mark === chosen) || (byKeys && piece.mark === stands));
  return svg("svg.chooser", {class: brush ? "strokes" : "", viewBox: `0 0 ${wide} ${high}`, preserveAspectRatio: "none", "data-key": "chooser", role: "application", tabindex: 0, "aria-label": t("other.map"), "aria-describedby": "other-keys",
    onkeydown: (event) => keyed(event, plan, placed),
    onfocus: (event) => { if (!event.currentTarget.matches(":focus-visible") || !placed.length) return; byKeys = true; const at = placed.find((piece) => piece.mark === (stands || chosen)) || placed[0]; stands = at.mark; if (brush) tell(at); else changed(); },
    onblur: () => { byKeys = false; changed(); },
    onclick: brush ? null : tap,
    onpointerdown: (event) => { if (!brush || event.button !== 0 || !event.isPrimary) return; event.currentTarget.setPointerCapture(event.pointerId); go(event, true); },
    onpointermove: (event) => { if (brush && event.isPrimary && event.currentTarget.hasPointerCapture(event.pointerId)) go(event, false); }},
    svg("path.cannot", {d: all(pieces.filter((piece) => cannotBe(plan, pieces).has(piece.mark)))}),
    svg("path.gets-other", {d: all(wished("other"))}),
    svg("path.moves", {d: all([...wished("take"), ...wished("swap")])}),
    ...["sign", "sign.inner"].map((look) => svg(`path.${look}`, {d: Object.entries(signs).map(([kind, sign]) => wished(kind).map((piece) => sign(middle(piece))).join("")).join("") + all(rings)})));
}

// The wood that was chosen, at its place in the picture before anything is planned.
export function laidWood(plan, pieces, box) {
  if (!choosesIn(plan.id) || !box) return null;
  const wide = box.right - box.left, high = box.high - box.low;
  return h("div.laid-woods", {"data-key": "laid"}, pieces.flatMap((piece) => {
    const is = wishOf(piece.mark);
    if (!is || !["take", "swap"].includes(is.kind)) return [];
    const [xs, ys] = [0, 1].map((i) => piece.artwork_outline_mm.map((p) => p[i]));
    const [left, right, low, top] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    return [picture(woodPath(plan.id, piece.mark, is.kind === "take" ? `&alternative=${is.number}` : `&swap=${encodeURIComponent(is.with)}`), "",
      {class: "laid-wood", "data-key": `laid ${piece.mark}`, lies: {left: (left - box.left) / wide, top: (box.high - top) / high, width: (right - left) / wide, height: (top - low) / high}})];
  }));
}

// ---- beside the picture ---------------------------------------------------------------------------------------------

export function chooserButton(plan, pieces) {
  const put = () => { chosen = stands = said = ""; swapping = brush = false; forgetPlaces(); begin(plan.id); };
  return h("div.commands", {"data-key": "other"}, button(t("other.on"), put, {"data-command": "other", wide: true, disabled: !pieces.length}));
}

// Below the picture.
export const chooserHelp = (plan) => choosesIn(plan.id) && [h("p.dim", {}, t(brush ? "other.about" : "other.about_choose")), h("p.dim.keys", {id: "other-keys"}, t(brush ? "other.keys" : "other.keys_choose"))];

// `begun` is told of the task that makes the other plan.
export function chooserTools(plan, pieces, begun) {
  if (planInHand() !== plan.id) return null;
  const tool = (is) => h("button", {type: "button", "data-command": is ? "brush" : "choose", disabled: is && !mayChange(), "aria-pressed": String(brush === is), onclick: () => { brush = is; swapping = false; say(""); }}, t(is ? "other.brush" : "other.choose"));
  return h("div.chooser-tools", {"data-key": "chooser-tools"},
    h("div.choices", {role: "group", "aria-label": t("other.tool")}, tool(false), tool(true)),
    brush ? h("p", {role: "status", id: "other-said"}, said) : pieceSheet(plan, pieces, chosen, {swapping, said, hand: {say, swap}, begun}),
    wishesCard(plan, pieces, begun));
}
