// Painting on a panel's mask with a finger: wood that is given back, wood that is withheld. Strokes stay on this page,
// and can be taken back one by one, until they are saved: then they are edits of the mask, and a new version of it.
import {h} from "../dom.js";
import {dayTime, squareCm, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, isStale, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button, card} from "../parts.js";

const kWidths = [1, 2, 4, 8, 15, 30];  // mm
const kMostPoints = 4000;              // that one edit takes

let of = "";          // the panel
let map = null;
let on = false, give = false, width = 8;
let strokes = [];     // {give, width_mm, points_mm}
let edits = null, asked = "", busy = false;

export function beginBrush(panel) {
  of = panel;
  map = null;
  on = busy = false;
  strokes = [];
  edits = null;
  asked = "";
}
export function brushOn(opened) {
  map = opened;
  map.strokes(strokes);
  hold();
}
export const unsaved = () => strokes.length;

const points = () => strokes.reduce((sum, one) => sum + one.points_mm.length, 0);

// Into the map's hand, as it is now.
function hold() {
  if (!map) return;
  map.brush(on ? {give, width_mm: width, room: kMostPoints - points(), onStroke: (stroke) => { strokes.push(stroke); hold(); changed(); }} : null);
}
const set = (act) => () => { act(); hold(); changed(); };

function load(version) {
  const now = `${of} ${version}`;
  if (asked === now) return;
  asked = now;
  get(`/panels/${encodeURIComponent(of)}/mask-edits`).then(({edits: list}) => { if (asked === now) { edits = list; changed(); } },
    () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

// Runs of strokes that are alike, in their order: of two that meet the later one counts.
function runs() {
  const out = [];
  for (const one of strokes) {
    const last = out[out.length - 1];
    if (last && last.give === one.give && last.width_mm === one.width_mm) last.strokes.push(one.points_mm);
    else out.push({give: one.give, width_mm: one.width_mm, strokes: [one.points_mm]});
  }
  return out;
}

async function save() {
  busy = true;
  changed();
  for (const run of runs()) {
    const body = {kind: run.give ? "give" : "withhold", width_mm: run.width_mm, strokes_mm: run.strokes.flat(2), stroke_points: run.strokes.map((one) => one.length)};
    if (!await command(`/panels/${encodeURIComponent(of)}/mask-edits`, {body, timeoutMs: 60000})) break;
    strokes.splice(0, run.strokes.length);
  }
  busy = false;
  renew();
}

async function takeBack(number) {
  busy = true;
  changed();
  await command(`/panels/${encodeURIComponent(of)}/mask-edits/${number}`, {method: "DELETE", timeoutMs: 60000});
  busy = false;
  renew();
}

function renew() {
  asked = "";
  if (map) { map.strokes(strokes); map.renewFree(); }
  hold();
  loadPanels();
  changed();
}

// Below the map: the brush, and what was painted.
export function brushTools(ready) {
  const may = ready && mayChange() && !busy;
  const choice = (label, is, act, more = {}) => h("button", {type: "button", "aria-pressed": String(is), onclick: set(act), ...more}, label);
  return h("div.brush", {"data-key": "brush"},
    h("div.commands", {}, button(t(on ? "brush.off" : "brush.on"), set(() => { on = !on; if (on && map) map.layer("free", true); }), {wide: true, id: "brush", disabled: !ready || (!on && !mayChange()), "aria-pressed": String(on)})),
    on && [
      h("p.dim", {}, t("brush.about")),
      h("div.choices", {role: "group", "aria-label": t("brush.kind")},
        choice(`− ${t("brush.withhold")}`, !give, () => { give = false; }, {id: "brush-withhold"}),
        choice(`+ ${t("brush.give")}`, give, () => { give = true; }, {id: "brush-give"})),
      h("div.choices", {role: "group", "aria-label": t("brush.width")}, ...kWidths.map((mm) => choice(`${mm} mm`, width === mm, () => { width = mm; }))),
      points() >= kMostPoints && h("p.warn", {}, `▲ ${t("brush.full")}`)],
    (on || strokes.length > 0) && h("div.commands", {},
      button(t("brush.undo"), () => { strokes.pop(); map.strokes(strokes); hold(); changed(); }, {id: "brush-undo", disabled: !strokes.length || busy}),
      button(t("brush.save", {n: strokes.length}), save, {id: "brush-save", next: strokes.length > 0, disabled: !strokes.length || !may || isStale()})));
}

export function paintedCard(version) {
  load(version);
  const list = (edits || []).filter((one) => !one.removed);
  if (!list.length) return null;
  return card(t("brush.painted"), h("ul.list", {}, ...list.reverse().map((one) => h("li", {"data-key": one.number, "data-edit": one.number},
    h("div", {}, h("b", {}, `${one.kind === "give" ? "+" : "−"} ${t(`brush.${one.kind}`)}, ${squareCm(one.area_mm2)}`), h("div.dim", {}, [dayTime(one.at), one.who, one.note].filter(Boolean).join(", "))),
    button(t("brush.back"), () => takeBack(one.number), {disabled: !mayChange() || busy})))));
}
