// The laser alone, and what is plugged in: the test pattern, the corner that somebody shows it, and which scanners answer.
// Asked for with Settings only.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, isStale, mayChange, mayDo, model, operates} from "../model.js";
import {command, isSure} from "../commands.js";
import {button, card, empty, hint, inEnglish} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf} from "../fields.js";
import {burnTicks} from "../ticks.js";
import {doSteps, isBusy, run, workAt, workRow} from "../work.js";

// ---- test pattern ---------------------------------------------------------------------------------------------------

let size = "50";
const kSize = {least: 10, most: 10000};
const ticks = burnTicks("confirm-pattern");
const kStrokes = ["Execute", "Holding", "Held", "Unholding"];  // a task that is given up ends none of them
const findsHome = () => (model.cell.laser || {}).finds_home !== false;

// Where nothing was asked by name, no tap on its own burns.
async function burn(begin) {
  const of = size, confirmed = ticks.take();
  const asShown = () => ticks.ready() && size === of && !isBusy("pattern");
  if (confirmed.length || await isSure(t("pattern.sure"), asShown)) begin(t("pattern.burn"), {dry: false, confirmed});
}

export function patternCard() {
  const bad = firstFault({label: t("pattern.size"), text: size, rules: kSize});
  const begin = (text, body) => { if (!bad) doSteps("pattern", [{text, act: () => run("pattern", "/laser/test-pattern", {size_mm: numberOf(size), ...body})}]); };
  const free = mayDo("maintainer") && mayChange() && !isBusy("pattern") && !bad;
  const {result, task} = workAt("pattern"), busy = isBusy("pattern"), runs = busy && kStrokes.includes(model.cell.state);
  const small = t(findsHome() ? "card.burns" : "pattern.moves");
  return card(t("pattern"), h("p.dim", {}, t("pattern.about", {where: t(findsHome() ? "pattern.middle" : "pattern.corner")})),
    h("div.form", {}, numberField(t("pattern.size"), size, (text) => { size = text; changed(); }, {...kSize, id: "pattern-size"})),
    ticks.list(), bad && hint(faultWords(bad)),
    h("div.commands", {},
      button(t("pattern.dry"), () => begin(t("pattern.dry"), {dry: true}), {disabled: !free, needs: "maintainer", small, id: "pattern-dry"}),
      button(t("pattern.burn"), () => burn(begin), {disabled: !free || !ticks.ready(), needs: "maintainer", wide: true, small, id: "pattern-burn"}),
      busy && !runs && task > 0 && button(t("task.cancel"), () => command(`/tasks/${task}`, {method: "DELETE"}), {disabled: !operates() || isStale(), id: "pattern-cancel"})),
    runs && h("p.warn", {id: "pattern-runs", role: "status"}, `▲ ${t("pattern.runs")}`), workRow("pattern"), result && hint(t(result.dry ? "pattern.ran" : "pattern.done")));
}

// ---- where the head stands ------------------------------------------------------------------------------------------

const kRests = ["Stopped", "Idle", "Complete", "Aborted"];
const mayTell = () => !findsHome() && kRests.includes(model.cell.state) && !isBusy("pattern") && !isBusy("card");
let telling = false, told = "";  // in which state it was taken

async function here() {
  if (telling) return;
  telling = true;
  told = "";
  try {
    if (await isSure(t("corner.sure"), mayTell) && await command("/laser/corner")) told = model.cell.state;
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

const find = () => doSteps("scanners", [{text: t("choose.scanners"), act: () => run("scanners", "/scanners", {})}]);

export function scannersCard() {
  const {result} = workAt("scanners"), found = result && result.scanners;
  return card(t("scanners"), h("p.dim", {}, t("scanners.about")),
    h("div.commands", {}, button(t("scanners.find"), find, {id: "find-scanners", wide: true, disabled: !mayChange() || isBusy("scanners")})),
    workRow("scanners"),
    found && (!found.length ? empty(t("choose.none.scanner")) : h("ul.list", {}, ...found.map((one) => h("li", {"data-key": one.name, class: one.problem ? "bad" : ""},
      h("div", {}, h("b", {}, one.make || one.name), h("div.dim", {}, one.name), one.problem && h("div", {}, "▲ ", inEnglish(asSentence(one.problem)))))))));
}
