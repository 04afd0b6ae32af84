// Drawing the outline of a strip of wood on a panel's map, corner by corner: the strip is what lies in it. It stays on this page,
// with its panel and the versions of its mask and strips that it was drawn on, while other screens are shown, until it is kept or
// taken back. Asked for once a panel is shown.
import {h} from "../dom.js";
import {asSentence, squareCm, t} from "../words.js";
import {changed, isStale, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button, cellSays} from "../parts.js";
import {byThisHand} from "./panel_brush.js";

const kMostCorners = 1500;  // that the cell takes
const kKeepMs = 60000;

let of = "", map = null, on = false, said = "", fault = "", kept = 0;
let keeping = null;     // the sheet that is on its way to the cell
let heldMoved = false;  // as the map's hand was last told
// By panel: {corners: [[x, y]] in mm, zone: which strip, 0 = a further one; drawn: {mask, strips}, the versions that were shown when
// it was begun; seen: those that this page knows of}
const sheets = new Map();

const sheetOf = (panel) => {
  if (!sheets.has(panel)) sheets.set(panel, {corners: [], zone: 0, drawn: null, seen: null});
  return sheets.get(panel);
};
const newest = (strips) => Math.max(1, ...(strips || []).map(({version}) => version));
// What this page knows is never older than that: a list may come late.
function see(sheet, mask, strips) {
  const before = sheet.seen || {mask: 0, strips: 0};
  sheet.seen = {mask: Math.max(mask, before.mask), strips: Math.max(strips, before.strips)};
}
const movedMask = ({corners, drawn, seen}) => corners.length > 0 && byThisHand(of, drawn.mask) < seen.mask;
const movedStrips = ({corners, drawn, seen}) => corners.length > 0 && drawn.strips !== seen.strips;
// The cell tells of what it is asked to keep before it answers: that is no news to who asked.
const isMoved = (sheet) => sheet !== keeping && (movedMask(sheet) || movedStrips(sheet));

export function enterOutline() {
  on = false;
  map = null;
  said = fault = "";
  kept = 0;
}
export function putOutlineAway() {
  on = false;
  hold();
}

// Into the map's hand, as it is now.
function hold() {
  if (!map) return;
  const sheet = sheetOf(of);
  heldMoved = isMoved(sheet);
  map.corners(on ? sheet.corners : []);
  map.outline(on && !keeping && !heldMoved ? {onCorner: (place, apart) => add(sheet, place, apart), onBack: () => back(sheet), onAway: () => { putOutlineAway(); changed(); },
    onCross: ([x, y]) => { said = t("brush.at", {x: x.toFixed(1), y: y.toFixed(1)}); changed(); }} : null);
}

// Nearer to the last one than `apart` it is that one, tapped twice.
function add(sheet, [x, y], apart) {
  const last = sheet.corners[sheet.corners.length - 1];
  if (sheet.corners.length >= kMostCorners || (last && Math.hypot(x - last[0], y - last[1]) <= apart)) return;
  if (!sheet.corners.length) sheet.drawn = {...sheet.seen};
  sheet.corners.push([x, y]);
  fault = "";
  kept = 0;
  said = t("outline.corner", {x: x.toFixed(1), y: y.toFixed(1), n: sheet.corners.length});
  hold();
  changed();
}
function back(sheet) {
  if (!sheet.corners.length || keeping) return;
  sheet.corners.pop();
  fault = "";
  said = t("outline.left", {n: sheet.corners.length});
  hold();
  changed();
}

function drop(sheet) {
  if (keeping) return;
  Object.assign(sheet, {corners: [], zone: 0});
  fault = said = "";
  hold();
  changed();
}

// To the panel it is of, whichever is shown by then.
async function keep(renew) {
  const panel = of, sheet = sheetOf(panel), {drawn} = sheet;
  keeping = sheet;
  fault = "";
  hold();
  changed();
  let refused = "";
  const body = {...(sheet.zone ? {zone: sheet.zone} : {}), outline_mm: sheet.corners.flat(), mask_version: byThisHand(panel, drawn.mask), zones_version: drawn.strips};
  const told = await command(`/panels/${encodeURIComponent(panel)}/zones`, {body, timeoutMs: kKeepMs, refused: (sentence) => { refused = sentence; }});
  keeping = null;
  if (told) {
    Object.assign(sheet, {corners: [], zone: 0});
    see(sheet, 0, newest(told.zones));
  }
  if (panel === of) {
    fault = refused;
    kept = told ? told.zone : 0;
    said = "";
    hold();
    renew();
  }
  loadPanels();
  changed();
}

// Somebody has looked at the panel as it is now.
function fits(sheet) {
  sheet.drawn = {...sheet.seen};
  fault = "";
  hold();
  changed();
}

// What of the panel another hand, or a scan, has changed since.
function movedWords({drawn, seen}, words) {
  return h("p.warn", {id: `outline-${words}`, role: "status"}, `▲ ${t(`outline.${words}`, words === "mask" ? {drawn: byThisHand(of, drawn.mask), now: seen.mask} : {drawn: drawn.strips, now: seen.strips})}`);
}

// Below the map. `opened`: it, or null while it is not there; `taken` is called when this takes the map's hand from others, `renew`
// when the panel has to be asked for anew.
export function outlineTools(opened, panel, taken, renew) {
  const sheet = sheetOf(panel.id), {corners} = sheet, strips = panel.zones || [];
  see(sheet, panel.mask_version, newest(strips));
  // A change may turn out to be this hand's own once the cell has answered.
  if (of !== panel.id || map !== opened || heldMoved !== isMoved(sheet)) {
    of = panel.id;
    map = opened;
    hold();
  }
  const gone = sheet.zone > 0 && !strips.some(({zone}) => zone === sheet.zone);  // stays chosen: another one is for a person to say
  const toggle = () => {
    on = !on;
    kept = 0;
    if (on) { taken(); map.layer("zones", true); }
    hold();
    changed();
  };
  const may = Boolean(map) && mayChange() && !keeping, moved = isMoved(sheet);
  return h("div.brush", {"data-key": "outline-tools"},
    h("div.commands", {}, button(t(on ? "outline.off" : "outline.on"), toggle, {wide: true, id: "outline", disabled: !map || (!on && !mayChange()), "aria-pressed": String(on)})),
    on && [  // nothing is asked of an outline that is not shown
      moved && movedMask(sheet) && movedWords(sheet, "mask"), moved && movedStrips(sheet) && movedWords(sheet, "strips"),
      h("p.dim", {role: "status", id: "outline-said"}, said),
      h("p.dim", {}, t("outline.about")),
      h("p.dim.keys", {id: "outline-keys"}, t("outline.keys")),
      h("div.form", {}, h("label", {}, t("outline.which"), h("select", {id: "outline-zone", value: String(sheet.zone), onchange: (event) => { sheet.zone = Number(event.target.value); changed(); }},
        h("option", {value: "0"}, t("outline.further")),
        ...strips.map(({zone, material, area_mm2}) => h("option", {value: String(zone)}, t("outline.strip", {n: zone, wood: material || t("panel.unnamed"), area: squareCm(area_mm2)}))),
        gone && h("option", {value: String(sheet.zone)}, t("outline.gone", {n: sheet.zone}))))),
      gone && h("p.warn", {id: "outline-gone", role: "status"}, `▲ ${t("outline.is_gone", {n: sheet.zone})}`),
      fault && h("p.fault", {id: "outline-fault", role: "alert"}, "▲ ", cellSays(asSentence(fault))),
      h("div.commands", {},
        button(t("outline.undo"), () => back(sheet), {id: "outline-undo", disabled: !corners.length || Boolean(keeping)}),
        button(t("outline.drop"), () => drop(sheet), {id: "outline-drop", disabled: !corners.length || Boolean(keeping)}),
        moved ? button(t("outline.fits"), () => fits(sheet), {id: "outline-fits", next: true, disabled: !may})
          : button(sheet.zone ? t("outline.keep", {n: sheet.zone}) : t("outline.add"), () => keep(renew), {id: "outline-keep", next: corners.length > 2 && !gone, disabled: corners.length < 3 || gone || !may || isStale()}))],
    kept > 0 && h("p", {id: "outline-kept", role: "status"}, t("outline.kept", {n: kept})));
}
