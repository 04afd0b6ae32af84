// Set up: the devices, and whether they answer; what has to be printed.
import {h} from "../dom.js";
import {t} from "../words.js";
import {changed, model} from "../model.js";
import {give, mayCommand} from "../commands.js";
import {button, hint} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf} from "../fields.js";
import {openFile} from "../work.js";
import {chooseParts} from "./setup_choose.js";
import {bedPicture, lookButton} from "./setup_bed.js";

export const devicesStep = {
  id: "devices",
  state: (about) => (about.hands || (model.cell.laser || {}).connected || about.certificate("axes") ? "done" : "open"),
  short: (about) => (about.hands ? t("devices.simulated") : ""),
  body(about) {
    return [
      h("p", {}, t(about.hands ? "devices.about_simulated" : "devices.about")),
      ...chooseParts(),
      h("div.commands", {},
        lookButton(),
        button(t("devices.connect"), () => give("reset"), {disabled: !mayCommand("reset"), small: t("devices.connect.small"), id: "connect"})),
      bedPicture()];
  },
};

// ---- what is printed ------------------------------------------------------------------------------------------------

let tags = {width_mm: "240", height_mm: "160", panels: "1"};
const kTags = {width_mm: {least: 1}, height_mm: {least: 1}, panels: {least: 1, whole: true}};
const faultOfTags = () => firstFault(...Object.entries(kTags).map(([name, rules]) => ({label: t(`print.${name}`), text: tags[name], rules})));
const openTags = (event) => {
  event.preventDefault();
  if (!faultOfTags()) openFile(`/fiducials/panel?${new URLSearchParams(Object.keys(kTags).map((name) => [name, String(numberOf(tags[name]))]))}`);
};
export function tagForm() {
  const bad = faultOfTags();
  return h("form.form", {onsubmit: openTags},
    h("div.pair", {}, ...Object.entries(kTags).map(([name, rules]) => numberField(t(`print.${name}`), tags[name], (text) => { tags[name] = text; changed(); }, rules))),
    bad && hint(faultWords(bad)),
    h("div.commands", {}, h("button.wide", {type: "submit", disabled: Boolean(bad)}, t("print.tags"))));
}
export const gridButton = () => h("div.commands", {}, button(t("print.grid"), () => openFile("/fiducials/grid"), {wide: true}));

export const printStep = {
  id: "print",
  state: (about) => (about.hands || about.certificate("scanner") ? "done" : "open"),
  short: (about) => (about.hands ? t("print.simulated") : ""),
  body: (about) => [
    about.hands && h("p", {}, t("print.about_simulated")),
    h("p", {}, t("print.about_grid")), gridButton(),
    h("p", {}, t("print.about_tags")), tagForm()],
};
