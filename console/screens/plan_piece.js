// One piece of a plan in somebody's hand: its wood large, what it costs in plain words, and what can be done about it.
import {h} from "../dom.js";
import {t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, followEvent, mayChange} from "../model.js";
import {button, cellSays, taskRow} from "../parts.js";
import {picture} from "../pictures.js";
import {cannotTake, findPlaces, looksForPlaces, takeBack, wish, wishOf} from "./plan_changes.js";

const kKept = 64;          // of the pieces that were looked at last
const kAlike = .005;       // of the cost: nobody sees the difference
const places = new Map();  // by plan and mark: {told: by the cell, null before it is; old: is to be asked for (again); asked: how often it was}

function placesOf(plan, mark) {
  const key = `${plan} ${mark}`;
  if (!places.has(key)) {
    places.set(key, {told: null, old: true});
    if (places.size > kKept) places.delete(places.keys().next().value);
  }
  const one = places.get(key);
  if (one.old) {
    one.old = false;
    const asked = one.asked = (one.asked || 0) + 1;  // an answer that comes late tells of the wood of before
    get(`/plans/${plan}/pieces/${encodeURIComponent(mark)}/alternatives?limit=24`).then((told) => { if (one.asked === asked) { one.told = told; changed(); } },
      () => setTimeout(() => { if (one.asked === asked) { one.old = true; changed(); } }, kAgainMs));
  }
  return one.told;
}

// Other wood may be booked by now. What was told stays in sight until the cell has told anew.
export function forgetPlaces() {
  for (const one of places.values()) one.old = true;
}
followEvent("panel", forgetPlaces);

export const woodPath = (plan, mark, query = "") => `/plans/${plan}/pieces/${encodeURIComponent(mark)}/wood.png?width=320${query}`;

const figure = (cost) => String(Number(cost.toPrecision(2)));

// "12 % worse"
function beside(cost, own) {
  if (!(own > 0)) return t("fits.cost", {cost: figure(cost)});
  const share = cost / own - 1;
  if (Math.abs(share) < kAlike) return t("fits.alike");
  if (share >= 1) return t("fits.times", {n: (share + 1).toFixed(share < 9 ? 1 : 0)});
  return t(share > 0 ? "fits.worse" : "fits.better", {n: Math.max(1, Math.round(100 * Math.abs(share)))});
}

// How it stands among the pieces of its plan.
function standing({place, placed, worse}) {
  const others = placed - 1, cost = figure(place.cost_per_pixel);
  if (!others) return t("fits.alone", {cost});
  if (worse === 0 || worse === others) return t(worse ? "fits.first" : "fits.last", {of: placed, cost});
  return t("fits.among", {n: worse, of: others, cost});
}

// `swapping`: whether the piece that it changes places with is being chosen; `said`: what was done last; `hand`:
// {say(sentence), swap()}.
export function pieceSheet(plan, pieces, mark, {swapping, said, hand, begun}) {
  const piece = pieces.find((one) => one.mark === mark);
  if (!piece) return h("div.piece-sheet", {"data-key": "piece-sheet"}, h("p", {role: "status", id: "other-said"}, said || t("piece.choose")));
  const told = piece.panel ? placesOf(plan.id, mark) : null, wanted = wishOf(mark), is = (kind) => Boolean(wanted) && wanted.kind === kind;
  const toggle = (kind) => { if (is(kind)) { takeBack(mark); hand.say(t("wish.back", {mark})); } else hand.say(wish(mark, {kind})); };
  const act = (kind, label, what, small) => button(label, what, {"data-wish": kind, "aria-pressed": String(is(kind) || (kind === "swap" && swapping)), disabled: !mayChange() || !piece.panel, small});
  return h("div.piece-sheet", {"data-key": "piece-sheet", role: "group", "aria-label": t("piece.title", {mark})},
    h("div.piece-face", {},
      piece.panel ? picture(woodPath(plan.id, mark), t("piece.wood", {mark}), {class: "piece-wood"}) : h("p.dim", {}, t("piece.no_wood")),
      h("div", {}, h("h3", {}, t("piece.title", {mark})),
        piece.panel && h("p", {}, t("piece.from", {panel: piece.panel})),
        told && told.place && h("p", {id: "piece-fits"}, standing(told)))),
    h("p", {role: "status", id: "other-said"}, said),
    h("div.commands.piece-acts", {},
      act("keep", t("act.keep"), () => toggle("keep"), t("act.keep_small")),
      act("swap", t(swapping ? "act.swap_off" : "act.swap"), hand.swap, t(swapping ? "act.swap_now" : "act.swap_small")),
      act("other", t("act.other"), () => toggle("other"), t("act.other_small"))),
    piece.panel && elsewhere(plan, pieces, piece, told, hand, begun));
}

// The places where it could be cut as well, as pictures; the first is the nearest to the picture.
function elsewhere(plan, pieces, piece, told, hand, begun) {
  if (!told) return h("p.dim", {}, t("places.asking"));
  const wanted = wishOf(piece.mark), taken = wanted && wanted.kind === "take" ? wanted.number : 0;
  const task = looksForPlaces(plan.id);
  if (!told.alternatives.length)
    return h("div.places-none", {"data-key": "places"}, h("h3", {}, t("places")),
      plan.options && plan.options.alternatives > 0 ? h("p.dim", {}, cellSays(told.none_because)) : [h("p.dim", {}, t("places.none")),
        h("div.commands", {}, button(t("places.find"), () => findPlaces(plan, begun), {wide: true, "data-command": "find-places", disabled: !mayChange() || Boolean(task)})),
        task && h("ul.list", {}, taskRow(task))]);
  const choose = (place) => {
    if (taken === place.number) { takeBack(piece.mark); return hand.say(t("wish.back", {mark: piece.mark})); }
    hand.say(wish(piece.mark, {kind: "take", number: place.number, place}));
  };
  return h("div.places", {"data-key": "places"}, h("h3", {}, t("places")),
    h("ul", {}, ...told.alternatives.map((place) => {
      const no = cannotTake(plan, pieces, piece.mark, place), fits = beside(place.cost_per_pixel, told.place.cost_per_pixel);
      return h("li", {"data-key": place.number}, h("button.place", {type: "button", "data-place": place.number, "aria-pressed": String(taken === place.number), disabled: !mayChange() || Boolean(no),
        onclick: () => choose(place)},
        picture(woodPath(plan.id, piece.mark, `&alternative=${place.number}`), "", {whenSeen: true}),
        h("span.unseen", {}, t("places.one", {n: place.number, panel: place.panel}), ": "), h("b", {}, fits), " ", h("small", {}, no || place.panel)));
    })),
    told.next !== null && h("p.dim", {}, t("places.first", {n: told.alternatives.length})));
}
