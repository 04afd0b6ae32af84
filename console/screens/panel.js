// One panel: its map, the piece that is looked at, facts, what scan and ledger disagree about, its label.
import {h} from "../dom.js";
import {dayTime, sizeOf, squareCm, t} from "../words.js";
import {askAll, get, kAgainMs} from "../link.js";
import {changed, followEvent, loadPanels, mayChange, model} from "../model.js";
import {command, showRefusal} from "../commands.js";
import {bar, button, card, empty, fact, facts, cellSays, later, link, tWith} from "../parts.js";
import {openFile} from "../work.js";
import {woodOf} from "./pieces.js";
import {isShown, kLayers} from "./panel_layers.js";
import {leasesOn} from "./leases.js";
import {stockCard, versionsCard} from "./panel_versions.js";
import {beginFacts, saidCard} from "./panel_facts.js";
import {beginBrush, brushOn, brushTools, paintedCard, putBrushAway, strokesLeft} from "./panel_brush.js";

const shown = {id: "", panel: null, fault: "", allocations: [], differences: [], piece: null, passport: null, version: ""};
let map = null;      // the open map
let mapOf = "";
let noMap = "";      // why there is none

const code = encodeURIComponent;

export function enterPanel(id, piece) {
  Object.assign(shown, {id, panel: null, fault: "", allocations: [], differences: [], piece: Number(piece) || null, passport: null, version: ""});
  if (map) { map.close(); map = null; }
  mapOf = noMap = "";
  beginBrush(id);
  beginFacts();
  if (apart.part) { apart.part.enterApart(); apart.part.enterOutline(); }
  apart.ask();
}

const apart = later(() => Promise.all([import("./panel_apart.js"), import("./panel_outline.js")]).then((parts) => Object.assign({}, ...parts)));

// Asked for anew whenever the list says that the panel is another one, and when something was said of any: of its wood,
// its shelf or its treatment the list need not tell.
followEvent("panel", () => { shown.version = ""; changed(); });
async function load() {
  const {id} = shown;
  const known = model.panels.find((panel) => panel.id === id);
  const version = known ? JSON.stringify([known.free_mm2, known.reserved_mm2, known.cut_mm2, known.mask, known.open_differences, known.retired, known.faces, known.mask_version]) : "?";
  if (shown.version === version) return;
  shown.version = version;
  try {
    const [panel, allocations, differences] = await Promise.all([get(`/panels/${code(id)}`), askAll(`/panels/${code(id)}/ledger`, "allocations"), askAll(`/panels/${code(id)}/differences`, "differences")]);
    if (shown.id !== id || shown.version !== version) return;
    const before = shown.panel;
    Object.assign(shown, {panel, allocations, differences: differences.filter((one) => !one.decided), fault: ""});
    if (map) map.show(allocations);
    if (map) { map.zones(panel.zones); map.fiducials(panel.fiducials || []); }
    if (map && before && before.mask_version !== panel.mask_version) { map.renewFree(); map.renewScan(); }
    if (shown.piece) look(shown.piece);
  } catch (fault) {
    if (shown.id !== id || shown.version !== version) return;
    shown.fault = fault.message;
    setTimeout(() => { if (shown.id === id && shown.version === version) { shown.version = ""; changed(); } }, kAgainMs);
  }
  changed();
}

async function look(piece) {
  shown.piece = piece;
  if (map) map.choose(piece);
  try { shown.passport = await get(`/pieces/${piece}`); } catch (fault) { showRefusal(fault.message); }
  changed();
}

function tapped(allocation) {
  if (allocation.piece) return look(allocation.piece);
  shown.piece = null;
  shown.passport = {written_off: true, ...allocation};
  changed();
}

export function panelDrawn(place, id) {
  const {panel} = shown;
  const canvas = place.querySelector(".map");
  if (!panel || !canvas || mapOf === id) return;
  mapOf = id;
  import("./panel_map.js").then(({openMap}) => openMap(canvas, panel, tapped)).then((opened) => {
    if (mapOf !== id || !canvas.isConnected) return opened.close();
    map = opened;
    noMap = "";
    brushOn(map);
    changed();
    map.show(shown.allocations);
    map.zones(shown.panel.zones);
    map.fiducials(shown.panel.fiducials || []);
    if (shown.piece) map.choose(shown.piece);
  }, (fault) => {
    const isHere = () => mapOf === id && canvas.isConnected;
    if (!isHere()) return;
    noMap = fault.message;
    setTimeout(() => { if (isHere()) { mapOf = ""; changed(); } }, kAgainMs);
    changed();
  });
}

export function drawPanel(id) {
  load();
  const {panel, fault} = shown;
  const back = link("#panels", `← ${t("panel.back")}`, {class: "back"});
  if (!panel) return [back, fault ? empty(cellSays(fault)) : empty(t("map.loading"))];
  if (panel.retired && apart.part) apart.part.putOutlineAway();  // there is no button for it
  return [
    h("div.tools", {}, back, h("h2.title", {}, id, panel.name && panel.name !== id ? ` ${panel.name}` : ""), h("span.grow"),
      !panel.retired && link(`#scan/${code(id)}`, t("panel.scan"), {class: "go", id: "scan-again"}), link(`#log/panel/${code(id)}`, t("log.open"), {class: "go"}), button(t("panel.label"), () => openFile(`/panels/${code(id)}/label?format=pdf`))),
    h("div.columns.two", {},
      h("div.column", {}, card(t("panel.map", {panel: id}), h("div.map", {"data-keep": "", "data-key": `map-${id}`}),
        noMap && h("p.fault", {id: "no-map", role: "alert"}, "▲ ", tWith("map.none", "why", noMap)),
        panel.retired ? strokesLeft() : brushTools(Boolean(map), panel.mask_version, () => { if (apart.part) apart.part.putOutlineAway(); }),
        !panel.retired && apart.part && apart.part.outlineTools(map, panel, putBrushAway, () => { shown.version = ""; changed(); }),
        h("div.chips.layers", {}, ...kLayers.map((name) => h("label", {}, h("input", {type: "checkbox", checked: isShown(name), disabled: !map, onchange: (event) => { map.layer(name, event.target.checked); changed(); }}), h(`i.layer-${name}`, {"aria-hidden": "true"}), t(`layer.${name}`)))),
        h("p.dim", {}, t("panel.tap")))),
      h("div.column", {}, apart.part && apart.part.sawnCard(panel), passportCard(), differencesCard(), paintedCard(shown.version), factsCard(panel), saidCard(panel, (zone) => { if (map) map.zone(zone); }), areaCard(panel), piecesCard(), versionsCard(panel), apart.comes(), apart.part && [apart.part.fitCard(panel), ...apart.part.apartCards(panel)], stockCard(panel))),
  ];
}

// ---- the piece that is looked at ------------------------------------------------------------------------------------

function passportCard() {
  const {passport} = shown;
  if (!passport) return null;
  const close = button(t("passport.close"), () => { shown.piece = null; shown.passport = null; if (map) map.choose(null); changed(); });
  if (passport.written_off)
    return card(t("passport.written_off"), facts(fact(t("passport.state"), t(`state.${passport.state}`)), fact(t("passport.wood"), squareCm(passport.area_mm2))), close);
  const {mark, state, job, run, wood, history = []} = passport;
  const since = history.length ? t("passport.since", {at: dayTime(history[history.length - 1].at)}) : "";
  const past = ({state, at, panel, who}) => h("li", {}, h("b", {}, t(`state.${state}`)), " ", h("span.dim", {}, [dayTime(at), panel, who].filter(Boolean).join(", ")));
  return card(t("passport", {mark}), h("div.load", {}, wood && woodOf({id: shown.piece, mark, panel: wood.panel, panel_outline_mm: wood.outline_mm}),
    facts(fact(t("passport.job"), `${job.id}, ${job.name}`),
      fact(t("passport.state"), [t(`state.${state}`), since].filter(Boolean).join(", "), state === "suspect"),
      run && fact(t("passport.who"), [run.who, run.started && dayTime(run.started)].filter(Boolean).join(", ")))),
    history.length > 1 && h("details", {"data-key": "past"}, h("summary", {}, t("passport.past")), h("ol.list", {}, ...history.map(past))),
    h("div.choices", {}, link(`#assembly/${job.id}/${encodeURIComponent(mark)}`, t("passport.place"), {class: "go"}), close));
}

// ---- what scan and ledger disagree about ----------------------------------------------------------------------------

function differencesCard() {
  if (!shown.differences.length) return null;
  const decide = (one, verdict, words) => button(words, async () => {
    await command(`/panels/${code(shown.id)}/differences/${one.id}/decide`, {body: {verdict}});
    shown.version = "";
    loadPanels();
  }, {disabled: !mayChange()});
  return card(`▲ ${t("panel.differences", {n: shown.differences.length})}`, h("ul.list", {}, ...shown.differences.map((one) => h("li", {"data-key": one.id},
    h("span", {}, [t("difference.at", {x: one.place_mm[0].toFixed(1), y: one.place_mm[1].toFixed(1)}), t(`difference.${one.kind}`), `${one.area_mm2.toFixed(0)} mm²`,
      ...(one.pieces || []).map((piece) => t("difference.piece", piece))].join(", ")),
    h("span.choices", {}, decide(one, "written_off", t("difference.write_off")), decide(one, "accepted", t("difference.leave")))))));
}

// ---- facts ----------------------------------------------------------------------------------------------------------

function factsCard(panel) {
  const noted = panel.facts || {};
  const left = panel.remnant || {};
  const thickness = [noted.veneer_mm && t("panel.veneer", {mm: noted.veneer_mm}), noted.substrate_mm && t("panel.substrate", {mm: noted.substrate_mm})].filter(Boolean).join(", ");
  return card(t("panel.facts"),
    panel.retired && h("p", {}, t("panel.retired", {why: panel.retired.reason})),
    panel.scan_again && h("p.warn", {}, "▲ ", tWith("panel.scan_again", "why", panel.scan_again)),
    facts(fact(t("panel.size"), sizeOf(panel)),
      ...(left.woods || []).map((wood) => fact(t("panel.woods"), `${wood.material || t("panel.unnamed")}, ${t("panel.for_plans", {area: squareCm(wood.free_mm2)})}`)),
      noted.shelf && fact(t("panel.shelf"), noted.shelf), thickness && fact(t("panel.thickness"), thickness),
      fact(t("panel.faces"), panel.faces.map((face) => t(`face.${face}`)).join(", ")),
      panel.parent && fact(t("panel.part_of"), link(`#panels/${code(panel.parent)}`, panel.parent)),
      panel.rms_mm !== null && fact(t("panel.fit"), `${panel.rms_mm.toFixed(3)} mm`),
      left.square && fact(t("panel.square"), `${Math.floor(left.square.side_mm)} mm`), left.circle && fact(t("panel.circle"), `${Math.floor(left.circle.diameter_mm)} mm`),
      ...(panel.treatments || []).map((one) => fact(t("panel.treated"), `${one.product}, ${one.on}`)),
      fact(t("panel.created"), dayTime(panel.created))),
    ...leasesOn(panel.id));
}

function areaCard(panel) {
  const book = panel.area_book_mm2;
  if (!book) return panel.mask === "unreadable" && h("section.card", {"aria-label": t("panel.part")}, h("p.warn", {}, `▲ ${t("panel.unreadable")}`));
  return h("section.card", {"aria-label": t("panel.part")}, h("div.areas", {}, ...["free", "reserved", "cut", "kerf", "suspect", "scrap", "unusable"].filter((name) => book[name] > 0).map((name) =>
    h("div", {}, h("span", {}, `${t(`area.${name}`)}, ${squareCm(book[name])}`), bar(book[name] / book.panel, {label: t(`area.${name}`)})))));
}

// For those who do not tap on a map.
function piecesCard() {
  const pieces = shown.allocations.filter((one) => one.piece && one.state !== "released");
  return h("details.card", {"data-key": "pieces"}, h("summary", {}, `${t("panel.pieces")} (${pieces.length})`),
    !pieces.length && empty(t("panel.no_pieces")),
    h("div.chips", {}, ...pieces.map((one) => h("button", {type: "button", "data-key": one.piece, "aria-pressed": String(shown.piece === one.piece), onclick: () => look(one.piece)}, `${one.mark}, ${t(`state.${one.state}`)}`))));
}
