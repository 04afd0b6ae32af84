// The shelf: every panel with what is left of it; and, with a number behind the address, one panel.
import {h} from "../dom.js";
import {sizeOf, squareCm, t} from "../words.js";
import {changed, model, panelOf} from "../model.js";
import {picture} from "../pictures.js";
import {empty, tWith} from "../parts.js";
import {leasesOn} from "./leases.js";
import {drawPanel, enterPanel, panelDrawn} from "./panel.js";
import {unsavedOn} from "./panel_brush.js";

let search = "";
let retired = false;

export function enter(panel, piece) { if (panel) enterPanel(panel, piece); }
export function drawn(place, panel) { if (panel) panelDrawn(place, panel); }

export function draw(panel, piece) {
  if (panel) return drawPanel(panel, piece);
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const there = model.panels.filter((one) => retired || !one.retired);
  const found = there.filter((one) => words.every((word) => named(one).includes(word)));
  return [
    h("div.tools", {},
      h("label", {}, t("panels.search"), h("input", {type: "search", value: search, placeholder: t("panels.search_hint"), oninput: (event) => { search = event.target.value; changed(); }})),
      h("label.tick", {}, h("input", {type: "checkbox", checked: retired, onchange: (event) => { retired = event.target.checked; changed(); }}), t("panels.retired"))),
    h("div.panels", {}, ...found.map(panelCard)),
    !found.length && empty(t(there.length ? "panels.none_found" : "panels.none")),
  ];
}

const named = (panel) => [panel.id, panel.name, panel.parent, panel.shelf, ...panel.woods].filter(Boolean).join(" ").toLowerCase();
export const fullName = (panel) => (panel.name && panel.name !== panel.id ? `${panel.id} ${panel.name}` : panel.id);

// By its area book, as everywhere; of a mask that nobody has counted, or can read, there is none.
export function woodOf(panel) {
  const book = panel.area_book_mm2;
  if (book) return h("div.dim", {}, t("panel.free", {free: squareCm(book.free), reserved: squareCm(book.reserved)}));
  return panel.mask === "unreadable" ? h("div.warn", {}, `▲ ${t("panel.unreadable")}`) : h("div.dim", {}, t("panel.uncounted"));
}

function panelCard(panel) {
  const wanted = model.cell && model.cell.load && model.cell.load.panel === panel.id;
  const known = panelOf(panel.id);
  return h("a.panel", {href: `#panels/${panel.id}`, "data-key": panel.id, class: wanted ? "wanted" : ""},
    picture(`/panels/${encodeURIComponent(panel.id)}/stock.jpg?width=480`, t("panels.stock", {panel: panel.id}), {version: `${panel.free_mm2} ${panel.cut_mm2} ${panel.reserved_mm2}`, whenSeen: true}),
    h("b", {}, fullName(panel)),
    h("div", {}, sizeOf(panel) + (panel.parent ? `, ${t("panel.remnant", {parent: panel.parent})}` : "")),
    (panel.woods.length > 0 || panel.shelf) && h("div", {}, [panel.woods.join(", "), panel.shelf && `${t("panel.shelf")} ${panel.shelf}`].filter(Boolean).join("; ")),
    woodOf(panel),
    ...leasesOn(panel.id),
    known.retired && h("div", {}, t("panel.retired", {why: known.retired.reason})),
    panel.scan_again && h("div.warn", {}, "▲ ", tWith("panel.scan_again", "why", panel.scan_again)),
    unsavedOn(panel.id) > 0 && h("div.warn", {}, `▲ ${t("brush.unsaved", {n: unsavedOn(panel.id)})}`),
    panel.open_differences > 0 && h("div.warn", {}, `▲ ${t("panel.differences", {n: panel.open_differences})}`));
}
