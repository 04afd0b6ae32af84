// Drawing the outline of a strip of wood on a panel's map, corner by corner: the strip is what lies in it. It stays on this page,
// with its panel, while other screens are shown, until it is kept or taken back. Asked for once a panel is shown.
import {h} from "../dom.js";
import {asSentence, squareCm, t} from "../words.js";
import {changed, isStale, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button, cellSays} from "../parts.js";

const kMostCorners = 1500;  // that the cell takes
const kKeepMs = 60000;

let of = "", map = null, on = false, said = "", fault = "", kept = 0, busy = false;
const sheets = new Map();  // by panel: {corners: [[x, y]] in mm, zone: which strip, 0 = a further one}

const sheetOf = (panel) => {
  if (!sheets.has(panel)) sheets.set(panel, {corners: [], zone: 0});
  return sheets.get(panel);
};

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
  map.corners(on ? sheet.corners : []);
  map.outline(on && !busy ? {onCorner: (place, apart) => add(sheet, place, apart), onBack: () => back(sheet), onAway: () => { putOutlineAway(); changed(); },
    onCross: ([x, y]) => { said = t("brush.at", {x: x.toFixed(1), y: y.toFixed(1)}); changed(); }} : null);
}

// Nearer to the last one than `apart` it is that one, tapped twice.
function add(sheet, [x, y], apart) {
  const last = sheet.corners[sheet.corners.length - 1];
  if (sheet.corners.length >= kMostCorners || (last && Math.hypot(x - last[0], y - last[1]) <= apart)) return;
  sheet.corners.push([x, y]);
  fault = "";
  kept = 0;
  said = t("outline.corner", {x: x.toFixed(1), y: y.toFixed(1), n: sheet.corners.length});
  hold();
  changed();
}
function back(sheet) {
  if (!sheet.corners.length || busy) return;
  sheet.corners.pop();
  fault = "";
  said = t("outline.left", {n: sheet.corners.length});
  hold();
  changed();
}

function drop(sheet) {
  if (busy) return;
  Object.assign(sheet, {corners: [], zone: 0});
  fault = said = "";
  hold();
  changed();
}

// To the panel it is of, whichever is shown by then.
async function keep() {
  const panel = of, sheet = sheetOf(panel);
  busy = true;
  fault = "";
  hold();
  changed();
  let refused = "";
  const body = {...(sheet.zone ? {zone: sheet.zone} : {}), outline_mm: sheet.corners.flat()};
  const told = await command(`/panels/${encodeURIComponent(panel)}/zones`, {body, timeoutMs: kKeepMs, refused: (sentence) => { refused = sentence; }});
  busy = false;
  if (told) Object.assign(sheet, {corners: [], zone: 0});
  if (panel === of) {
    fault = refused;
    kept = told ? told.zone : 0;
    said = "";
    hold();
  }
  loadPanels();
  changed();
}

// Below the map. `opened`: it, or null while it is not there; `taken` is called when this takes the map's hand from others.
export function outlineTools(opened, panel, taken) {
  if (of !== panel.id || map !== opened) {
    of = panel.id;
    map = opened;
    hold();
  }
  const sheet = sheetOf(of), {corners} = sheet, strips = panel.zones || [];
  const gone = sheet.zone > 0 && !strips.some(({zone}) => zone === sheet.zone);  // stays chosen: another one is for a person to say
  const toggle = () => {
    on = !on;
    kept = 0;
    if (on) { taken(); map.layer("zones", true); }
    hold();
    changed();
  };
  const may = Boolean(map) && mayChange() && !busy;
  return h("div.brush", {"data-key": "outline-tools"},
    h("div.commands", {}, button(t(on ? "outline.off" : "outline.on"), toggle, {wide: true, id: "outline", disabled: !map || (!on && !mayChange()), "aria-pressed": String(on)})),
    on && [
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
        button(t("outline.undo"), () => back(sheet), {id: "outline-undo", disabled: !corners.length || busy}),
        button(t("outline.drop"), () => drop(sheet), {id: "outline-drop", disabled: !corners.length || busy}),
        button(sheet.zone ? t("outline.keep", {n: sheet.zone}) : t("outline.add"), keep, {id: "outline-keep", next: corners.length > 2 && !gone, disabled: corners.length < 3 || gone || !may || isStale()}))],
    kept > 0 && h("p", {id: "outline-kept", role: "status"}, t("outline.kept", {n: kept})));
}
