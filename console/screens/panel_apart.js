// Two panels that are one sheet, a panel that was sawn apart, and how well its scans fit. Asked for once a panel is shown.
import {h} from "../dom.js";
import {asSentence, dayTime, t} from "../words.js";
import {askAll, kAgainMs} from "../link.js";
import {changed, followEvent, loadPanels, mayChange, model} from "../model.js";
import {command, isSure} from "../commands.js";
import {button, card, empty, fact, facts, cellSays, link} from "../parts.js";
import {fiducialName, offWords} from "./fiducial_words.js";

const code = encodeURIComponent;
let of = "", reason = "", merged = "";
let done = null;   // what the cell answered to the merge
let busy = false;  // it is told one thing at a time

const othersOf = (panel) => model.panels.filter((one) => one.id !== panel.id && !one.retired);

// What was chosen for one panel is not chosen for another, nor one that has left the stock meanwhile.
function begin(panel) {
  if (of !== panel.id) {
    of = panel.id;
    reason = merged = "";
    done = null;
    forgetScans();
  }
  if (!othersOf(panel).some((one) => one.id === merged)) merged = "";
}

export const enterApart = () => forgetScans();

export function apartCards(panel) {
  begin(panel);
  return panel.retired ? [] : [mergeCard(panel), splitCard(panel)];
}

// Asked first where `words` are given, of what is shown then. The reply, unless another panel is shown by now.
async function tell(panel, send, words, asShown = () => true) {
  if (busy || (words && !await isSure(words, () => !busy && of === panel.id && asShown()))) return null;
  busy = true;
  changed();
  const told = await send();
  busy = false;
  loadPanels();
  changed();
  return of === panel.id ? told : null;
}

// ---- one sheet under two names --------------------------------------------------------------------------------------

async function merge(panel) {
  const other = merged;
  const told = await tell(panel, () => command(`/panels/${code(panel.id)}/merge`, {body: {merged: other}}),
    t("merge.sure", {panel: panel.id, other}), () => merged === other);
  if (!told) return;
  merged = "";
  done = told;
}

function mergeCard(panel) {
  const others = othersOf(panel);
  const name = (one) => [one.id, one.name !== one.id && one.name, one.shelf].filter(Boolean).join(", ");
  return h("details.card", {"data-key": `merge-${panel.id}`}, h("summary", {}, t("merge")), h("p.dim", {}, t("merge.about", {panel: panel.id})), h("p.dim", {}, t("merge.then", {panel: panel.id})),
    h("div.form", {}, h("label", {}, t("merge.which"), h("select", {id: "merge-which", value: merged, onchange: (event) => { merged = event.target.value; done = null; changed(); }},
      h("option", {value: ""}, t(others.length ? "merge.choose" : "merge.none")), ...others.map((one) => h("option", {value: one.id}, name(one)))))),
    h("div.commands", {}, button(merged ? t("merge.do", {panel: panel.id, other: merged}) : t("merge.choose"), () => merge(panel), {id: "do-merge", wide: true, disabled: !mayChange() || busy || !merged})),
    done && h("p", {id: "merge-done", role: "status"}, t(`merge.done.${!done.other_face ? "same" : panel.scan_again ? "carried" : "back"}`, {panel: panel.id, other: done.merged})),
    done && (!done.other_face || panel.scan_again) && h("div.commands", {}, link(`#scan/${code(panel.id)}`, t("panel.scan"), {class: "go wide", id: "merge-scan"})));
}

// ---- sawn apart -----------------------------------------------------------------------------------------------------

async function split(panel) {
  const body = reason.trim() ? {reason: reason.trim()} : {};
  if (await tell(panel, () => command(`/panels/${code(panel.id)}/split`, {body}), t("split.sure", {panel: panel.id}))) reason = "";
}

const splitCard = (panel) => h("details.card", {"data-key": `split-${panel.id}`}, h("summary", {}, t("split")), h("p.dim", {}, t("split.about", {panel: panel.id})),
  h("div.form", {}, h("label", {}, t("split.why"), h("input", {type: "text", id: "split-why", maxlength: 500, value: reason, oninput: (event) => { reason = event.target.value; changed(); }}))),
  h("div.commands", {}, button(t("split.do", {panel: panel.id}), () => split(panel), {id: "do-split", wide: true, disabled: !mayChange() || busy})));

// What is to be done with it stands before what it was. Until a part of it is in stock it can be taken back.
export function sawnCard(panel) {
  if (!panel.retired || !panel.retired.sawn) return null;
  begin(panel);
  const parts = panel.parts || [];
  return card(t("split.is"), h("p", {}, t(parts.length ? "split.parts" : "split.next")),
    parts.length > 0 && h("div.choices", {}, ...parts.map((one) => link(`#panels/${code(one)}`, one, {class: "go"}))),
    h("div.commands", {}, link(`#scan/part/${code(panel.id)}`, t("split.scan"), {class: "go wide", id: "scan-part"}), !parts.length && button(t("split.back"), () => tell(panel, () => command(`/panels/${code(panel.id)}/restore`, {body: {}})), {id: "unsplit", wide: true, disabled: !mayChange() || busy})));
}

// ---- how well its scans fit -----------------------------------------------------------------------------------------

let scans = null, fault = "";
let asked = null;      // the last question; answers to earlier ones are old
let unfolded = false;  // nobody waits for what nobody sees

function forgetScans() {
  scans = asked = null;
  fault = "";
  unfolded = false;
}

// What was told stays until something else is.
followEvent("panel", () => { asked = null; changed(); });
async function loadScans(panel) {
  if (asked || !unfolded) return;
  const mine = asked = {};
  let told = null, why = "";
  try { told = await askAll(`/panels/${code(panel.id)}/registration`, "scans"); } catch (refused) { why = refused.message; }
  if (asked !== mine) return;
  fault = why;
  if (told) scans = told; else setTimeout(() => { if (asked === mine) { asked = null; changed(); } }, kAgainMs);
  changed();
}

const fitOf = ({rms_mm, max_mm}) => (typeof rms_mm !== "number" ? t("fit.one")
  : [t("fit.rms", {mm: rms_mm.toFixed(3)}), typeof max_mm === "number" && t("fit.max", {mm: max_mm.toFixed(3)})].filter(Boolean).join(", "));
const marksOf = (panel, face) => {
  const on = (kind) => (panel.fiducials || []).filter((one) => one.face === face && one.kind === kind).length;
  return [t("fit.tags", {n: on("tag")}), on("hole") > 0 && t("fit.holes", {n: on("hole")})].filter(Boolean).join(", ");
};

// Those that lie farthest off first, and those of which nobody knows last.
const farFirst = (a, b) => (b.off_mm ?? -1) - (a.off_mm ?? -1);
const eachMark = (panel, face) => (panel.fiducials || []).filter((one) => one.face === face).sort(farFirst)
  .map((one) => h("li", {class: one.over_limit ? "warn" : ""}, `${fiducialName(one)}: ${offWords(one)}`));

// The newest first.
export function fitCard(panel) {
  begin(panel);
  loadScans(panel);
  const count = scans ? ` (${scans.length})` : "";
  return h("details.card", {"data-key": `fit-${panel.id}`, ontoggle: (event) => { unfolded = event.target.open; changed(); }}, h("summary", {}, `${t("fit")}${count}`), h("p.dim", {}, t("fit.about")),
    facts(...panel.faces.map((face) => fact(t("fit.marks", {face: t(`face.${face}`)}), marksOf(panel, face), (panel.fiducials || []).some((one) => one.face === face && one.over_limit)))),
    ...panel.faces.map((face) => [eachMark(panel, face), face]).filter(([each]) => each.length > 0).map(([each, face]) => h("ul.marks", {"data-marks": face, "aria-label": t("fit.marks", {face: t(`face.${face}`)})}, ...each)),
    fault && h("p.fault", {id: "fit-fault", role: "alert"}, "▲ ", cellSays(asSentence(fault))),
    scans ? h("ul.list", {}, ...scans.slice().reverse().map((one) => h("li", {"data-key": one.id},
      h("div", {}, h("b", {}, t("fit.scan", {n: one.id, face: t(`face.${one.face}`)})), h("div.dim", {}, `${dayTime(one.taken)}, ${fitOf(one)}`))))) : !fault && empty(t("fit.coming")));
}
