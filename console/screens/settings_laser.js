// The laser alone, and what is plugged in: the test pattern, the corner that somebody shows it, and which scanners answer.
// Asked for with Settings only.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, isStale, mayChange, mayDo, model, operates} from "../model.js";
import {command} from "../commands.js";
import {button, card, empty, hint, inEnglish} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf} from "../fields.js";
import {burnTicks} from "../ticks.js";
import {doSteps, isBusy, run, workAt, workRow} from "../work.js";

// ---- test pattern ---------------------------------------------------------------------------------------------------

let size = "50";
const kSize = {least: 1, most: 10000};
const ticks = burnTicks("confirm-pattern");

export function patternCard() {
  const bad = firstFault({label: t("pattern.size"), text: size, rules: kSize});
  const begin = (text, body) => { if (!bad) doSteps("pattern", [{text, act: () => run("pattern", "/laser/test-pattern", {size_mm: numberOf(size), ...body})}]); };
  const free = mayDo("maintainer") && mayChange() && !isBusy("pattern") && !bad;
  const {result, task} = workAt("pattern");
  return card(t("pattern"), h("p.dim", {}, t("pattern.about")),
    h("div.form", {}, numberField(t("pattern.size"), size, (text) => { size = text; changed(); }, {...kSize, id: "pattern-size"})),
    ticks.list(), bad && hint(faultWords(bad)),
    h("div.commands", {},
      button(t("card.dry"), () => begin(t("card.dry"), {dry: true}), {disabled: !free, needs: "maintainer", id: "pattern-dry"}),
      button(t("card.burn"), () => begin(t("card.burn"), {dry: false, confirmed: ticks.take()}), {disabled: !free || !ticks.ready(), needs: "maintainer", wide: true, small: t("card.burns"), id: "pattern-burn"}),
      isBusy("pattern") && task > 0 && button(t("task.cancel"), () => command(`/tasks/${task}`, {method: "DELETE"}), {disabled: !operates() || isStale(), id: "pattern-cancel"})),
    workRow("pattern"), result && hint(t(result.dry ? "pattern.ran" : "pattern.done")));
}

// ---- where the head stands ------------------------------------------------------------------------------------------

// Only a laser without homing switches is told.
export function cornerPart() {
  const {laser = {}} = model.cell;
  if (laser.finds_home !== false) return null;
  const here = () => { if (confirm(t("corner.sure"))) command("/laser/corner"); };
  return h("div.note", {"data-key": "corner"}, h("p", {}, t("corner.about")),
    h("div.commands", {}, button(t("corner.do"), here, {id: "do-corner", wide: true, disabled: !mayChange()})));
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
