// Two panels that are one sheet, a panel that was sawn apart, and how well its scans fit. Asked for once a panel is shown.
import {h} from "../dom.js";
import {dayTime, t} from "../words.js";
import {askAll, kAgainMs} from "../link.js";
import {changed, loadPanels, mayChange, model} from "../model.js";
import {command, isSure} from "../commands.js";
import {button, card, empty, fact, facts, link} from "../parts.js";

const code = encodeURIComponent;
let of = "", reason = "", merged = "", done = "";
let scans = null, scansOf = "";

// What was chosen for one panel is not chosen for another.
function begin(panel) {
  if (of === panel.id) return;
  of = panel.id;
  reason = merged = done = "";
}

const isShown = (panel) => () => of === panel.id;

export function apartCards(panel) {
  begin(panel);
  if (panel.retired) return [panel.retired.sawn && sawnCard(panel)];
  return [mergeCard(panel), splitCard(panel)];
}

// ---- one sheet under two names --------------------------------------------------------------------------------------

async function merge(panel) {
  const other = merged;
  if (!await isSure(t("merge.sure", {panel: panel.id, other}), () => isShown(panel)() && merged === other)) return;
  if (await command(`/panels/${code(panel.id)}/merge`, {body: {merged: other}})) { merged = ""; done = t("merge.done", {panel: panel.id, other}); }
  loadPanels();
  changed();
}

function mergeCard(panel) {
  const others = model.panels.filter((one) => one.id !== panel.id && !one.retired);
  const name = (one) => [one.id, one.name !== one.id && one.name, one.shelf].filter(Boolean).join(", ");
  return h("details.card", {"data-key": `merge-${panel.id}`}, h("summary", {}, t("merge")), h("p.dim", {}, t("merge.about", {panel: panel.id})),
    h("div.form", {}, h("label", {}, t("merge.which"), h("select", {id: "merge-which", value: merged, onchange: (event) => { merged = event.target.value; done = ""; changed(); }},
      h("option", {value: ""}, t(others.length ? "merge.choose" : "merge.none")), ...others.map((one) => h("option", {value: one.id}, name(one)))))),
    h("div.commands", {}, button(merged ? t("merge.do", {panel: panel.id, other: merged}) : t("merge.choose"), () => merge(panel), {id: "do-merge", wide: true, disabled: !mayChange() || !merged})),
    done && h("p", {role: "status"}, done));
}

// ---- sawn apart -----------------------------------------------------------------------------------------------------

async function split(panel) {
  if (!await isSure(t("split.sure", {panel: panel.id}), isShown(panel))) return;
  if (await command(`/panels/${code(panel.id)}/split`, {body: reason.trim() ? {reason: reason.trim()} : {}})) reason = "";
  loadPanels();
  changed();
}

const splitCard = (panel) => h("details.card", {"data-key": `split-${panel.id}`}, h("summary", {}, t("split")), h("p.dim", {}, t("split.about", {panel: panel.id})),
  h("div.form", {}, h("label", {}, t("split.why"), h("input", {type: "text", id: "split-why", maxlength: 500, value: reason, oninput: (event) => { reason = event.target.value; changed(); }}))),
  h("div.commands", {}, button(t("split.do", {panel: panel.id}), () => split(panel), {id: "do-split", wide: true, disabled: !mayChange()})));

// Until a part of it is in stock it can be taken back.
function sawnCard(panel) {
  const parts = panel.parts || [];
  const back = async () => { await command(`/panels/${code(panel.id)}/restore`, {body: {}}); loadPanels(); };
  return card(t("split.is"), h("p", {}, t(parts.length ? "split.parts" : "split.next")),
    parts.length > 0 && h("div.choices", {}, ...parts.map((one) => link(`#panels/${code(one)}`, one, {class: "go"}))),
    h("div.commands", {}, link("#scan", t("split.scan"), {class: "go"}), !parts.length && button(t("split.back"), back, {id: "unsplit", disabled: !mayChange()})));
}

// ---- how well its scans fit -----------------------------------------------------------------------------------------

function loadScans(panel) {
  const key = `${panel.id} ${panel.mask_version} ${panel.faces.length}`;
  if (scansOf === key) return;
  if (!scansOf.startsWith(`${panel.id} `)) scans = null;
  scansOf = key;
  askAll(`/panels/${code(panel.id)}/registration`, "scans").then((all) => { if (scansOf === key) { scans = all; changed(); } },
    () => setTimeout(() => { if (scansOf === key) { scansOf = ""; changed(); } }, kAgainMs));
}

const fitOf = ({rms_mm, max_mm}) => (typeof rms_mm !== "number" ? t("fit.one")
  : [t("fit.rms", {mm: rms_mm.toFixed(3)}), typeof max_mm === "number" && t("fit.max", {mm: max_mm.toFixed(3)})].filter(Boolean).join(", "));
const marksOf = (panel, face) => {
  const on = (kind) => (panel.fiducials || []).filter((one) => one.face === face && one.kind === kind).length;
  return [t("fit.tags", {n: on("tag")}), on("hole") > 0 && t("fit.holes", {n: on("hole")})].filter(Boolean).join(", ");
};

// The newest first.
export function fitCard(panel) {
  loadScans(panel);
  const count = scans ? ` (${scans.length})` : "";
  return h("details.card", {"data-key": `fit-${panel.id}`}, h("summary", {}, `${t("fit")}${count}`), h("p.dim", {}, t("fit.about")),
    facts(...panel.faces.map((face) => fact(t("fit.marks", {face: t(`face.${face}`)}), marksOf(panel, face)))),
    scans === null ? empty(t("map.loading")) : h("ul.list", {}, ...scans.slice().reverse().map((one) => h("li", {"data-key": one.id},
      h("div", {}, h("b", {}, t("fit.scan", {n: one.id, face: t(`face.${one.face}`)})), h("div.dim", {}, `${dayTime(one.taken)}, ${fitOf(one)}`))))));
}
