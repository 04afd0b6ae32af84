// The hands of a simulated cell, for any of its sheets: on Scan and Run, beside what people would lay down there.
import {h} from "../dom.js";
import {t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, model} from "../model.js";
import {command} from "../commands.js";
import {button, hint} from "../parts.js";
import {hasHands, lay, lift} from "../hands.js";
import {doSteps, isBusy, workRow} from "../work.js";

let sheets = [], asked = "", chosen = "";

function follow() {
  const now = `${model.cell.state} ${model.panels.length} ${model.bedLooks}`;
  if (now === asked) return;
  asked = now;
  get("/sim/sheets").then((told) => { ({sheets} = told); changed(); }, () => setTimeout(() => { if (asked === now) again(); }, kAgainMs));
}

const again = () => { asked = ""; changed(); };

export function sheetHands(on, face) {
  if (!hasHands()) return null;
  follow();
  const place = `hands-${on}`;
  const names = [...new Set(["panel", ...sheets.map((one) => one.name)])];
  const sheet = names.includes(chosen) ? chosen : "panel";
  const there = sheets.find((one) => one.where === on);
  const step = (text, act) => doSteps(place, [{text, act: async () => { await act(); again(); }}]);
  return h("details.card", {"data-key": place}, h("summary", {}, t("hands")),
    h("p.dim", {}, t("hands.about")),
    h("p", {}, there ? t(`hands.lies.${on}`, {sheet: there.name}) : t(`hands.empty.${on}`)),
    h("div.form", {}, h("label", {}, t("hands.sheet"), h("select", {value: sheet, onchange: (event) => { chosen = event.target.value; changed(); }}, ...names.map((name) => h("option", {value: name}, name))))),
    h("div.commands", {},
      button(t(`hands.lay.other.${on}`, {sheet}), () => step(t(`hands.lay.other.${on}`, {sheet}), () => lay(sheet, on, {face})), {disabled: isBusy(place), wide: true, "data-hands": `lay-${on}`}),
      button(t(`hands.lift.${on}`), () => step(t(`hands.lift.${on}`), () => lift(on)), {disabled: isBusy(place) || !there}),
      button(t("hands.new_panel"), () => step(t("hands.new_panel"), () => command("/sim/sheets", {body: {name: newName()}, timeoutMs: 60000})), {disabled: isBusy(place)})),
    workRow(place), hint(t(`face.${face}`) && t(on === "bed" ? "hands.face_up" : "hands.face_down", {face: t(`face.${face}`)})));
}

function newName() {
  for (let n = 2; ; ++n) if (!sheets.some((one) => one.name === `panel-${n}`)) return `panel-${n}`;
}
