// The laser alone, and what is plugged in: test card and pattern, the corner that somebody shows it, which scanners answer.
// Asked for with Settings only.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, isStale, mayChange, model, operates} from "../model.js";
import {burns, cornerMoves, findsHome, isFree, kCard, kPattern} from "../burns.js";
import {command, isSure} from "../commands.js";
import {button, card, empty, hint, cellSays} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf} from "../fields.js";
import {burnTicks} from "../ticks.js";
import {areSought, findScanners, scannersFound, scannersRow} from "../scanners.js";
import {run, workAt} from "../work.js";

export {burnsNow} from "../burns.js";

// ---- test card ------------------------------------------------------------------------------------------------------

let operation = "cut", drawing = null;
const ticksOfCard = burnTicks("confirm-card");

export function testCard() {
  const of = operation, {result} = workAt("card");
  const {buttons, row} = burns("card", kCard, ticksOfCard, "card.sure", () => operation === of, (body) => run("card", "/laser/test-card", {operation: of, ...body}));
  return card(t("card"), h("p.dim", {}, t("card.about")),
    h("div.form", {}, h("label", {}, t("recipe.operation"), h("select", {id: "card-operation", value: operation, onchange: (event) => { operation = event.target.value; showDrawing(null); }}, ...["cut", "engrave"].map((one) => h("option", {value: one}, t(`operation.${one}`)))))),
    drawing && h("img.target", {src: drawing, alt: t("card.alt")}),
    ticksOfCard.list(),
    h("div.commands", {}, button(t("card.draw"), showCard, {wide: true, disabled: !operates() || isStale()}), ...buttons),
    row, result && hint(t(result.dry ? "card.ran" : "card.done")));
}

function showDrawing(svg) {
  if (drawing) URL.revokeObjectURL(drawing);
  drawing = svg && URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
  changed();
}

async function showCard() {
  const of = operation, drawn = await command("/test-card", {body: {operation: of}});
  if (operation === of) showDrawing(drawn && drawn.svg);
}

// ---- test pattern ---------------------------------------------------------------------------------------------------

let size = "50";
const kSize = {least: 10, most: 10000};
const ticksOfPattern = burnTicks("confirm-pattern");
const faultOfSize = () => firstFault({label: t("pattern.size"), text: size, rules: kSize});

export function patternCard() {
  const of = size, bad = faultOfSize(), {result} = workAt("pattern");
  const {buttons, row} = burns("pattern", kPattern, ticksOfPattern, "pattern.sure", () => size === of && !faultOfSize(), (body) => run("pattern", "/laser/test-pattern", {size_mm: numberOf(of), ...body}));
  return card(t("pattern"), h("p.dim", {}, t("pattern.about", {where: t(findsHome() ? "pattern.middle" : "pattern.corner")})),
    h("div.form", {}, numberField(t("pattern.size"), size, (text) => { size = text; changed(); }, {...kSize, id: "pattern-size"})),
    ticksOfPattern.list(), bad && hint(faultWords(bad)),
    h("div.commands", {}, ...buttons), row, result && hint(t(result.dry ? "pattern.ran" : "pattern.done")));
}

// ---- where the head stands ------------------------------------------------------------------------------------------

const kRests = ["Stopped", "Idle", "Complete", "Aborted"];
const mayTell = () => !findsHome() && kRests.includes(model.cell.state) && isFree();
let telling = false, told = "";  // in which state it was taken

async function here() {
  if (telling) return;
  telling = true;
  told = "";
  try {
    if (!await isSure(t("corner.sure"), mayTell)) return;
    cornerMoves();  // at once: it may be taken before it is answered, or without
    if (await command("/laser/corner")) told = model.cell.state;
    cornerMoves();
  } finally { telling = false; }
  changed();
}

// Only a laser without homing switches is told. Idle it counts from there at once.
export function cornerPart() {
  const {state} = model.cell;
  if (findsHome()) return null;
  return h("div.note", {"data-key": "corner"}, h("p", {}, t(state === "Idle" ? "corner.arrows" : "corner.about")),
    h("div.commands", {}, button(t("corner.do"), here, {id: "do-corner", wide: true, disabled: !mayChange() || !mayTell() || telling})),
    told !== "" && told === state && h("p", {id: "corner-taken", role: "status"}, t(state === "Idle" ? "corner.counts" : "corner.taken")));
}

// ---- scanners -------------------------------------------------------------------------------------------------------

export function scannersCard() {
  const found = scannersFound();
  return card(t("scanners"), h("p.dim", {}, t("scanners.about")),
    h("div.commands", {}, button(t("scanners.find"), findScanners, {id: "find-scanners", wide: true, disabled: !mayChange() || areSought()})),
    scannersRow(),
    found && (!found.length ? empty(t("choose.none.scanner")) : h("ul.list", {}, ...found.map((one) => h("li", {"data-key": one.name, class: one.problem ? "bad" : ""},
      h("div", {}, h("b", {}, one.make || one.name), one.make && h("div.dim", {}, one.name), one.problem && h("div", {}, "▲ ", cellSays(asSentence(one.problem)))))))));
}
