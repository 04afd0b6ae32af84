// What somebody wants changed about one plan before it is planned again: at most one thing for each piece. The plan
// itself stays; another one is made.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {get} from "../link.js";
import {changed, followEvent, mayChange, model} from "../model.js";
import {command} from "../commands.js";
import {button, taskRow} from "../parts.js";
import {heartOf} from "../outlines.js";
import {apart, boxOf, inPlaceOf, tooNear} from "../piece_places.js";

export const kPlaces = 6;  // looked for, for each piece
const kRounding = .02;     // mm
let of = 0;                // the plan
const wishes = new Map();  // by mark: {kind: "keep"}, {kind: "other"}, {kind: "swap", with} of both, {kind: "take", number, place}
const made = new Map();    // by task: {from: the plan that is changed, places: whether other places are all that was asked for, wanted: else all wishes}
let failed = null;         // of them: the last one that came to nothing, while its plan is in hand

export const choosesIn = (plan) => of === plan;
export const planInHand = () => (model.plans.some((plan) => plan.id === of) ? of : 0);  // somebody may have forgotten it
export const wishOf = (mark) => wishes.get(mark);
export const wishedMarks = () => [...wishes.keys()];

const allWishes = () => JSON.stringify([...wishes]);

export function begin(plan) { of = plan; failed = null; wishes.clear(); changed(); focusSoon("svg.chooser"); }
export function leave() { of = 0; wishes.clear(); changed(); }

// What was pressed is gone with the next drawing: whoever came by keyboard goes on there.
export const focusSoon = (css) => requestAnimationFrame(() => requestAnimationFrame(() => { const next = document.querySelector(css); if (next) next.focus({preventScroll: true}); }));

// ---- one thing for each piece ---------------------------------------------------------------------------------------

export function takeBack(mark) {
  const wish = wishes.get(mark);
  if (wish && wish.kind === "swap") wishes.delete(wish.with);
  wishes.delete(mark);
  changed();
}

const said = (mark, wish) => t(`wish.${wish.kind}`, {mark, other: wish.with, n: wish.number, panel: wish.place && wish.place.panel});

// What it takes the place of goes, and is told: a sentence.
export function wish(mark, what) {
  const before = [mark, what.with].filter(Boolean).map((one) => [one, wishes.get(one)]).filter(([, is]) => is);
  for (const [one] of before) takeBack(one);
  wishes.set(mark, what);
  if (what.kind === "swap") wishes.set(what.with, {kind: "swap", with: mark});
  changed();
  return [asSentence(said(mark, what)), ...before.map(([one, is]) => t("wish.instead", {was: said(one, is)}))].join(" ");
}

// ---- what cannot be -------------------------------------------------------------------------------------------------

const gapOf = (plan) => Math.max(0, 2 * ((plan.options && plan.options.kerf_mm) || 0) - kRounding);
const keepsOnly = () => [...wishes.values()].some((one) => one.kind === "keep");

// Where the piece will lie for sure: {panel, ring}; null where it is planned anew.
function futureOf(piece, byMark) {
  const is = wishes.get(piece.mark);
  if (is && is.kind === "take") return {panel: is.place.panel, ring: is.place.panel_outline_mm};
  if (is && is.kind === "swap") { const other = byMark.get(is.with); return {panel: other.panel, ring: inPlaceOf(piece, other)}; }
  if (!piece.panel || (is ? is.kind === "other" : keepsOnly())) return null;
  return {panel: piece.panel, ring: piece.panel_outline_mm};
}

// All of them with their boxes, until something else is wanted: each piece is held against each other one.
let futures = {pieces: null, wishes: "", all: []};
function futuresOf(pieces) {
  const wanted = allWishes();
  if (futures.pieces === pieces && futures.wishes === wanted) return futures.all;
  const byMark = new Map(pieces.map((piece) => [piece.mark, piece]));
  const all = pieces.map((piece) => ({mark: piece.mark, ...futureOf(piece, byMark)})).filter(({ring}) => ring).map((one) => ({...one, box: boxOf(one.ring)}));
  futures = {pieces, wishes: wanted, all};
  return all;
}

// The mark of a piece that will lie there or too near by; "" where there is room among the pieces.
function inTheWay(plan, pieces, panel, ring, but) {
  const box = boxOf(ring), gap = gapOf(plan);
  const other = futuresOf(pieces).find((one) => one.panel === panel && !apart(box, one.box, gap) && !but.includes(one.mark) && tooNear(ring, one.ring, gap));
  return other ? other.mark : "";
}

// Why it cannot be taken; "" where it can.
export function cannotTake(plan, pieces, mark, place) {
  if (!place.free) return t("place.gone");
  const other = inTheWay(plan, pieces, place.panel, place.panel_outline_mm, [mark]);
  return other && t("place.in_the_way", {mark: other});
}

export function cannotSwap(plan, pieces, one, other) {
  if (one.mark === other.mark) return t("swap.itself");
  if (!one.panel || !other.panel) return t("swap.no_wood", {mark: one.panel ? other.mark : one.mark});
  const [there, here] = [inPlaceOf(one, other), inPlaceOf(other, one)], both = [one.mark, other.mark];
  if (one.panel === other.panel && tooNear(there, here, gapOf(plan))) return t("swap.each_other");
  const stands = inTheWay(plan, pieces, other.panel, there, both);
  if (stands) return t("swap.no_room", {mark: one.mark, other: stands});
  const too = inTheWay(plan, pieces, one.panel, here, both);
  return too && t("swap.no_room", {mark: other.mark, other: too});
}

// ---- the plan that is made ------------------------------------------------------------------------------------------

// Wood that no other piece touches: a square within the piece's own, and within its rim.
function heartOfPiece({panel, panel_outline_mm: ring}) {
  const heart = heartOf(ring);
  if (!heart || heart.half < .5) return null;
  const half = .9 * heart.half;
  return [panel, ...[heart.x - half, heart.y - half, 2 * half, 2 * half].map((mm) => mm.toFixed(2))].join(",");
}

function bodyOf(pieces) {
  const kinds = (kind) => pieces.filter((piece) => (wishes.get(piece.mark) || {}).kind === kind);
  const other = kinds("other");
  return {
    pin: kinds("keep").map((piece) => piece.mark),
    replan: other.map((piece) => piece.mark), forbid: other.map(heartOfPiece).filter(Boolean),
    swap: kinds("swap").filter((piece) => piece.mark < wishes.get(piece.mark).with).map((piece) => `${piece.mark},${wishes.get(piece.mark).with}`),
    take: kinds("take").map((piece) => `${piece.mark}=${wishes.get(piece.mark).number}`),
  };
}

async function make(plan, pieces, begun) {
  const wanted = allWishes(), started = await command(`/plans/${plan.id}/changes`, {body: bodyOf(pieces)});
  if (!started) return;
  made.set(started.task, {from: plan.id, places: false, wanted});
  failed = null;
  begun(started.task);
  changed();
}

// The same plan once more, with other places for each piece.
export async function findPlaces(plan, begun) {
  const started = await command(`/plans/${plan.id}/changes`, {body: {alternatives: kPlaces}});
  if (!started) return;
  made.set(started.task, {from: plan.id, places: true});
  failed = null;
  begun(started.task);
  changed();
}

// The task that is at it; null where none is.
function underWay(plan, places) {
  const [task] = [...made].find(([, one]) => one.places === places && one.from === plan) || [];
  return task ? model.tasks.get(task) || {id: task, state: "running", text: ""} : null;
}
export const looksForPlaces = (plan) => underWay(plan, true);

// Of those that ended while the page was cut off nobody tells it.
followEvent("open", () => { for (const id of made.keys()) ask(id); });
async function ask(id) {
  try {
    model.tasks.set(id, await get(`/tasks/${id}`));
  } catch (fault) {
    if (fault.status !== 404 || !made.has(id)) return;
    if (of === made.get(id).from) failed = {...model.tasks.get(id), id, state: "failed"};
    made.delete(id);
  }
  changed();
}

// What was made since the last look: `show` is told of the plans to be seen then, the newest behind. What was wanted
// stays where it came to nothing, so that it can be wanted otherwise.
export function takeMade(show) {
  for (const [task, {from, places, wanted}] of made) {
    const known = model.tasks.get(task);
    if (!known || known.state === "running" || (known.state === "done" && !("result" in known))) continue;  // it is asked for again
    const plan = known.state === "done" && known.result && known.result.plan;
    if (plan && !model.plans.some((one) => one.id === plan)) continue;  // the list is on its way
    made.delete(task);
    if (!plan) { if (of === from) failed = known; continue; }
    if (places && of === from) of = plan;  // what was chosen holds: all of it lies where it lay
    if (!places && of === from && wanted === allWishes()) leave();  // else somebody goes on with it
    show(places ? [plan] : [from, plan]);
  }
}

// What is wanted, one below the other, each to be taken back; and making the plan of it.
export function wishesCard(plan, pieces, begun) {
  const marks = wishedMarks().filter((mark) => wishes.get(mark).kind !== "swap" || mark < wishes.get(mark).with);
  const task = underWay(plan.id, false), stop = () => command(`/tasks/${task.id}`, {method: "DELETE"});
  const kept = [...wishes.values()].filter((one) => one.kind !== "other").length, n = pieces.length - kept;
  return h("div.wishes", {"data-key": "wishes"},
    h("h3", {}, t("wishes")),
    !marks.length && h("p.dim", {}, t("wishes.none")),
    marks.length > 0 && h("ul.list", {}, ...marks.map((mark) => h("li", {"data-key": mark}, h("span.grow", {}, said(mark, wishes.get(mark))),
      button(t("wishes.back"), () => takeBack(mark), {"aria-label": t("wishes.back_of", {what: said(mark, wishes.get(mark))})})))),
    marks.length > 0 && h("p", {id: "wishes-rest", class: keepsOnly() ? "note" : "dim"}, keepsOnly() ? t("wishes.rest_anew", {n}) : t("wishes.rest_stays")),
    (task || failed) && h("div", {id: "wishes-task", role: "status"}, h("ul.list", {}, taskRow(task || failed, task && stop))),
    h("div.commands", {}, button(t("wishes.make", {n: marks.length}), () => make(plan, pieces, begun), {wide: true, "data-command": "make-changed", next: marks.length > 0, disabled: !marks.length || !mayChange() || Boolean(task)}),
      button(t("other.off"), () => { leave(); focusSoon(`section[data-key="${plan.id}"] [data-command=other]`); }, {"data-command": "leave-pieces", wide: true})));
}
