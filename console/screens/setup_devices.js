// Set up: which devices the cell has and whether they answer; what has to be printed.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, mayChange, model} from "../model.js";
import {give, mayCommand} from "../commands.js";
import {button, fact, facts, hint} from "../parts.js";
import {doSteps, isBusy, openFile, run, workAt, workRow} from "../work.js";
import {bedPicture, lookButton} from "./setup_bed.js";

const kindOf = (device) => t(`kind.${device.kind}`);

export const devicesStep = {
  id: "devices",
  state: (about) => (about.hands || (model.cell.laser || {}).connected || about.certificate("axes") ? "done" : "open"),
  short: (about) => (about.hands ? t("devices.simulated") : ""),
  body(about) {
    const {scanner, camera, laser} = about.setup.devices;
    const now = model.cell.laser || {};
    return [
      h("p", {}, t(about.hands ? "devices.about_simulated" : "devices.about")),
      facts(
        fact(t("scanner"), `${kindOf(scanner)}: ${scanner.device}`),
        fact(t("camera"), `${kindOf(camera)}: ${camera.device}`),
        fact(t("laser"), `${kindOf(laser)}: ${laser.device}, ${now.connected ? t("laser.connected") : now.why_not_connected || t("devices.not_asked")}`, Boolean(now.why_not_connected))),
      h("div.commands", {},
        lookButton(),
        button(t("devices.connect"), () => give("reset"), {disabled: !mayCommand("reset"), small: t("devices.connect.small"), id: "connect"}),
        !about.hands && button(t("devices.find"), findScanners, {wide: true, disabled: !mayChange() || isBusy("scanners")})),
      workRow("scanners"), found(),
      bedPicture(),
      !about.hands && hint(t("devices.file"))];
  },
};

const findScanners = () => doSteps("scanners", [{text: t("devices.find"), act: () => run("scanners", "/scanners", {})}]);

// What to write for each: the file is the owner's, and the daemon may not change it.
function found() {
  const {result} = workAt("scanners");
  if (!result) return null;
  if (!result.scanners.length) return h("p.warn", {}, t("devices.no_scanner"));
  return h("ul.list", {}, ...result.scanners.map((one) => h("li", {"data-key": one.name},
    h("div", {}, h("b", {}, one.make || one.name), one.problem ? h("p", {}, `▲ ${asSentence(one.problem)}`)
      : h("pre", {}, `[scanner]\nkind = "sane"\ndevice = "${one.make || one.name}"\ndpi = 300`)))));
}

// ---- what is printed ------------------------------------------------------------------------------------------------

let tags = {width_mm: "240", height_mm: "160", panels: "1"};
export const tagForm = () => h("form.form", {onsubmit: (event) => { event.preventDefault(); openFile(`/fiducials/panel?${new URLSearchParams(tags)}`); }},
  h("div.pair", {}, ...["width_mm", "height_mm", "panels"].map((name) => h("label", {}, t(`print.${name}`),
    h("input", {type: "number", min: 1, required: true, value: tags[name], oninput: (event) => { tags[name] = event.target.value; changed(); }})))),
  h("div.commands", {}, h("button.wide", {type: "submit"}, t("print.tags"))));
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
