// Set up: a camera of this computer is looked through before it is chosen. Its automatics say how it should be set, and
// what is chosen is what the picture was taken with.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, isStale, mayChange, model} from "../model.js";
import {button, hint} from "../parts.js";
import {faultWords, firstFault, numberField} from "../fields.js";
import {picture} from "../pictures.js";
import {isTrying, lastTrial, trialRow, tryCamera} from "../cameras.js";

const kReadable = ["RGB3", "BGR3", "YUYV", "UYVY", "NV12", "GREY", "MJPG", "JPEG"];  // the best first, as the driver has them
const kRest = ["Stopped", "Idle", "Complete", "Aborted"];
// Of Linux's own names for settings those that have a word here; the others are told by their names.
const kNamed = ["exposure_time_absolute", "focus_absolute", "gain", "white_balance_temperature"];

let size = "", sizedFor = "";  // "": the best, else "1920 1080 YUYV"; and the camera that it was picked for
let figures = {}, of = 0;       // what is typed, by name, and the trial that it stands for

const pixels = ({width, height}) => width * height;
// Each that can be read, the largest first; one that takes any size between two has its largest.
const sizesOf = (camera) => camera.formats.filter(({code}) => kReadable.includes(code)).map(({code, most_width: width, most_height: height}) => ({code, width, height}))
  .sort((a, b) => pixels(b) - pixels(a) || kReadable.indexOf(a.code) - kReadable.indexOf(b.code));

// "1920 × 1080, 640 × 480", for the list of cameras.
export const sizeWords = (camera) => [...new Set(sizesOf(camera).map(({width, height}) => `${width} × ${height}`))].slice(0, 4).join(", ");

// What it cannot be locked in, by the names that Linux gives settings; a lens that does not move has none either.
export function lackWords(camera) {
  const has = (part) => camera.controls.some(({name}) => name.includes(part));
  return [!has("exposure") && t("trial.no_exposure"), !has("focus") && t("trial.no_focus")].filter(Boolean);
}

export const settingWords = (name) => (kNamed.includes(name) ? t(`trial.${name}`) : name);

// Its last one; what is typed becomes what that was taken with.
function trialOf(camera) {
  const last = lastTrial();
  if (!last || last.device !== camera.device) return null;
  if (of !== last.trial) figures = {...last.settings}, of = last.trial;
  return last;
}
const changes = (trial) => Object.entries(trial.settings).some(([name, value]) => figures[name] !== value);

// Of the camera that is marked, once its picture was taken with what is typed; null until then.
export function chosenTrial(camera) {
  const trial = trialOf(camera);
  return trial && !changes(trial) ? trial : null;
}

export function trialPart(camera) {
  const trial = trialOf(camera);
  if (sizedFor !== camera.device) size = "", sizedFor = camera.device;
  const shut = isTrying() || !mayChange() || isStale() || !kRest.includes(model.cell.state);
  const [width, height, format] = size.split(" ");
  const sized = size ? {width: Number(width), height: Number(height), format} : {};
  const all = sizesOf(camera);
  return h("div.form", {"data-key": "trial"},
    h("label", {}, t("trial.size"), h("select", {id: "trial-size", value: size, onchange: (event) => { size = event.target.value; changed(); }},
      h("option", {value: ""}, t("trial.best")), ...all.map((one) => h("option", {value: `${one.width} ${one.height} ${one.code}`}, `${one.width} × ${one.height}, ${one.code}`)))),
    h("div.commands", {}, button(t(trial ? "trial.again" : "trial.take"), () => tryCamera({device: camera.device, ...sized}), {wide: true, id: "try-camera", disabled: shut, small: t("trial.small")})),
    trialRow(),
    trial && shown(trial, camera, shut));
}

function shown(trial, camera, shut) {
  const control = (name) => camera.controls.find((one) => one.name === name) || {};
  const rules = (name) => ({whole: true, least: control(name).least, most: control(name).most});
  const names = Object.keys(trial.settings);
  const bad = firstFault(...names.map((name) => ({label: settingWords(name), text: figures[name], rules: rules(name)})));
  const anew = changes(trial);
  const again = () => tryCamera({device: trial.device, width: trial.width, height: trial.height, format: trial.format, settings: names.map((name) => `${name}=${figures[name].trim()}`)});
  return h("section.trial", {"data-key": `trial-${trial.trial}`, "aria-label": t("trial.picture")},
    h("div.view", {}, picture(`/cameras/trial.jpg?trial=${trial.trial}`, t("trial.picture"))),
    h("p.dim", {}, t("trial.taken", {width: trial.width, height: trial.height, format: trial.format})),
    ...trial.doubts.map((doubt) => h("p.warn", {"data-doubt": doubt}, `▲ ${asSentence(t(`trial.doubt.${doubt}`))}`)),
    names.length > 0 && h("div.pair", {}, ...names.map((name) => numberField(settingWords(name), figures[name], (text) => { figures[name] = text; changed(); }, {...rules(name), id: `trial-${name}`}))),
    names.includes("exposure_time_absolute") && h("p.dim", {}, t("trial.flicker")),
    bad && hint(faultWords(bad)),
    anew && h("div.commands", {}, button(t("trial.with"), again, {wide: true, id: "try-figures", disabled: shut || Boolean(bad), small: t("trial.with.small")})));
}

// Why the camera that is marked cannot be chosen yet.
export function trialLacks(camera) {
  const trial = trialOf(camera);
  if (isTrying()) return "";
  return trial ? (chosenTrial(camera) ? "" : t("trial.changed")) : t("trial.first");
}
