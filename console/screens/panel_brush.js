// Painting on a panel's mask with a finger: wood that is given back, wood that is withheld. Strokes stay on this page, of
// the panel and of the version of its mask that they were painted on, and can be taken back one by one, until they are
// saved: then they are edits of the mask, each run of a kind and width one, and a new version of it.
import {h} from "../dom.js";
import {dayTime, squareCm, t} from "../words.js";
import {askAll, kAgainMs} from "../link.js";
import {changed, isStale, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button, card} from "../parts.js";
import {edits as editsOf, kept} from "../strokes.js";

const kWidths = [1, 2, 4, 8, 15, 30];  // mm
const kMostPoints = 500;               // that one edit takes; no stroke is begun when there are as many
const kSaveMs = 60000;

let of = "";          // the panel that is shown
let map = null;
let on = false, give = false, width = 8;
let edits = null, asked = "", said = "";
const sheets = new Map();  // by panel: what was painted on it, also while another screen is shown

// version: of the mask that the strokes were painted on; seen: the newest that this page knows of.
const sheetOf = (panel) => {
  if (!sheets.has(panel)) sheets.set(panel, {version: 0, seen: 0, strokes: [], busy: false});  // strokes: {give, width_mm, points_mm}
  return sheets.get(panel);
};
// Versions of masks that were made here, each of the one before.
const own = new Set();
// The newest that comes of `version` by this hand alone.
export function byThisHand(panel, version) {
  let newest = version;
  while (own.has(`${panel} ${newest + 1}`)) ++newest;
  return newest;
}
export const unsavedOn = (panel) => (sheets.has(panel) ? sheets.get(panel).strokes.length : 0);
const isMoved = (sheet) => sheet.strokes.length > 0 && sheet.version !== sheet.seen;

// Strokes outlive every screen, but not the page.
addEventListener("beforeunload", (event) => {
  if ([...sheets.keys()].some(unsavedOn)) event.preventDefault();
});

export function beginBrush(panel) {
  of = panel;
  map = null;
  on = false;
  edits = null;
  asked = said = "";
}
export function brushOn(opened) {
  map = opened;
  map.strokes(sheetOf(of).strokes);
  hold();
}

const points = (sheet) => sheet.strokes.reduce((sum, one) => sum + one.points_mm.length, 0);

// Into the map's hand, as it is now.
function hold() {
  if (!map) return;
  const sheet = sheetOf(of), {seen} = sheet;
  map.brush(on && !sheet.busy && !isMoved(sheet) ? {give, width_mm: width, room: kMostPoints - points(sheet), onStroke: (stroke) => take(sheet, seen, stroke),
    onCross: ([x, y]) => { said = t("brush.at", {x: x.toFixed(1), y: y.toFixed(1)}); changed(); }} : null);
}
const set = (act) => () => { act(); hold(); changed(); };

// `seen`: the version that was shown when it was begun.
function take(sheet, seen, stroke) {
  if (!sheet.strokes.length) sheet.version = seen;
  sheet.strokes.push(kept(stroke));
  const [x, y] = stroke.points_mm[stroke.points_mm.length - 1];
  said = t("brush.done", {kind: t(stroke.give ? "brush.give" : "brush.withhold"), mm: stroke.width_mm, x: x.toFixed(1), y: y.toFixed(1), n: sheet.strokes.length});
  show(sheet);
}

// What the map shows of it is what will be saved.
function show(sheet) {
  if (map && sheet === sheetOf(of)) map.strokes(sheet.strokes);
  hold();
  changed();
}

function load(version) {
  const now = `${of} ${version}`;
  if (asked === now) return;
  asked = now;
  askAll(`/panels/${encodeURIComponent(of)}/mask-edits?counting=true`, "edits").then((list) => { if (asked === now) { edits = list; changed(); } },
    () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

// To the panel they are of, whichever is shown by then.
async function save() {
  const panel = of, sheet = sheetOf(panel);
  sheet.busy = true;
  hold();
  changed();
  for (const one of editsOf(sheet.strokes, kMostPoints)) {
    const body = {kind: one.give ? "give" : "withhold", version: sheet.version, width_mm: one.width_mm, strokes_mm: one.strokes.flat(2), stroke_points: one.strokes.map((part) => part.length)};
    const made = await command(`/panels/${encodeURIComponent(panel)}/mask-edits`, {body, timeoutMs: kSaveMs});
    if (!made) break;
    own.add(`${panel} ${made.version}`);
    sheet.version = sheet.seen = made.version;
    sheet.strokes.splice(0, one.ended);
  }
  sheet.busy = false;
  renew(panel);
}

async function takeBack(number) {
  const panel = of, sheet = sheetOf(panel);
  sheet.busy = true;
  hold();
  changed();
  const made = await command(`/panels/${encodeURIComponent(panel)}/mask-edits/${number}`, {method: "DELETE", timeoutMs: kSaveMs});
  // The same hand did both.
  if (made && sheet.version === made.version - 1) sheet.version = made.version;
  if (made) {
    own.add(`${panel} ${made.version}`);
    sheet.seen = made.version;
    if (panel === of && edits) edits = edits.filter((one) => one.number !== number);
  }
  sheet.busy = false;
  renew(panel);
}

function renew(panel) {
  if (panel === of) {
    asked = "";
    if (map) map.renewFree();
  }
  loadPanels();
  show(sheetOf(panel));
}

// In the place of the brush, of a panel that was retired while strokes on it waited: they cannot be saved, and are not
// dropped in silence, since a panel may be restored.
export function strokesLeft() {
  if (on) { on = false; hold(); }
  const sheet = sheetOf(of), n = sheet.strokes.length;
  if (!n) return null;
  return h("div.brush", {"data-key": "brush-left"},
    h("p.warn", {role: "status"}, `▲ ${t("brush.left", {n})}`),
    h("div.commands", {}, button(t("brush.drop"), () => { sheet.strokes = []; show(sheet); }, {id: "brush-drop", disabled: sheet.busy})));
}

export function putBrushAway() {
  on = false;
  hold();
}

// Below the map: the brush, and what was painted. `version`: of the mask, as the panel was read; `taken` is called when this takes
// the map's hand from others.
export function brushTools(ready, version, taken) {
  const sheet = sheetOf(of);
  if (version > sheet.seen) { sheet.seen = version; hold(); }
  const {strokes, busy} = sheet, moved = isMoved(sheet);
  const may = ready && mayChange() && !busy;
  const choice = (label, is, act, more = {}) => h("button", {type: "button", "aria-pressed": String(is), onclick: set(act), ...more}, label);
  return h("div.brush", {"data-key": "brush"},
    h("div.commands", {}, button(t(on ? "brush.off" : "brush.on"), set(() => { on = !on; if (on) taken(); if (on && map) map.layer("free", true); }), {wide: true, id: "brush", disabled: !ready || (!on && !mayChange()), "aria-pressed": String(on)})),
    moved && h("p.warn", {role: "status"}, `▲ ${t("brush.moved", {painted: sheet.version, now: sheet.seen})}`),
    on && !moved && [
      h("p.dim", {role: "status", id: "brush-said"}, said),
      h("p.dim", {}, t("brush.about")),
      h("p.dim.keys", {id: "brush-keys"}, t("brush.keys")),
      h("div.choices", {role: "group", "aria-label": t("brush.kind")},
        choice(`− ${t("brush.withhold")}`, !give, () => { give = false; }, {id: "brush-withhold"}),
        choice(`+ ${t("brush.give")}`, give, () => { give = true; }, {id: "brush-give"})),
      h("div.choices", {role: "group", "aria-label": t("brush.width")}, ...kWidths.map((mm) => choice(`${mm} mm`, width === mm, () => { width = mm; }))),
      points(sheet) >= kMostPoints && h("p.warn", {}, `▲ ${t("brush.full")}`)],
    (on || strokes.length > 0) && h("div.commands", {},
      button(t("brush.undo"), () => { strokes.pop(); show(sheet); }, {id: "brush-undo", disabled: !strokes.length || busy}),
      moved ? button(t("brush.fits"), () => { sheet.version = sheet.seen; show(sheet); }, {id: "brush-fits", next: true, disabled: !may})
        : button(t("brush.save", {n: strokes.length}), save, {id: "brush-save", next: strokes.length > 0, disabled: !strokes.length || !may || isStale()})));
}

const areaOf = (mm2) => (mm2 < 100 ? `${mm2.toFixed(0)} mm²` : squareCm(mm2));

export function paintedCard(version) {
  load(version);
  const list = [...(edits || [])];
  if (!list.length) return null;
  return card(t("brush.painted"), h("ul.list", {}, ...list.reverse().map((one) => h("li", {"data-key": one.number, "data-edit": one.number},
    h("div", {}, h("b", {}, `${one.kind === "give" ? "+" : "−"} ${t(`brush.${one.kind}`)}, ${areaOf(one.area_mm2)}`), h("div.dim", {}, [dayTime(one.at), one.who, one.note].filter(Boolean).join(", "))),
    button(t("brush.back"), () => takeBack(one.number), {disabled: !mayChange() || sheetOf(of).busy})))));
}
