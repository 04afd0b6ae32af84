// Set up: the four certificates. Each step says what to lay where, measures it, and tells how well it fits; a simulated
// cell's hands lay it.
import {h} from "../dom.js";
import {asSentence, dayTime, t} from "../words.js";
import {changed, isStale, mayDo, model} from "../model.js";
import {blockedBy, give, mayCommand} from "../commands.js";
import {blockedHint, button, fact, facts, hint, cellSays} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf, written} from "../fields.js";
import {doSteps, isBusy, run, workRow} from "../work.js";
import {layStep} from "../hands.js";
import {burnTicks} from "../ticks.js";
import {bedPicture, lookButton, lookStep} from "./setup_bed.js";

const mayMeasure = (place) => mayDo("maintainer") && !isStale() && !isBusy(place);
const measure = (place, device, body = {}) => ({text: t(`measure.${device}`), act: () => run(place, `/calibration/${device}`, body)});

const kKinds = {scanner: "scanner", camera: "camera", laser: "axes", kerf: "kerf"};  // what each step makes
const lengths = {max_mm: "calib.max", left_out_rms_mm: "calib.left_out", other_scan_rms_mm: "calib.other_scan", worst_predicted_mm: "calib.predicted", kerf_mm: "calib.kerf"};

// What a certificate says of itself, and what it does not know.
export function certificateFacts(one) {
  return facts(
    fact(t("calib.rms"), `${(one.rms_mm || 0).toFixed(3)} mm`),
    ...Object.entries(lengths).filter(([name]) => typeof one[name] === "number").map(([name, label]) => fact(t(label), `${one[name].toFixed(3)} mm`)),
    fact(t("calib.made"), `${dayTime(one.issued)}${one.made_on ? `, ${one.made_on}` : ""}`),
    one.expires && fact(t("calib.until"), dayTime(one.expires)),
    ...(one.doubts || []).map((doubt) => fact(t("calib.doubt"), cellSays(asSentence(doubt)), true)));
}

const step = (id, kind, body) => ({
  id,
  state: (about) => (about.certificate(kind) ? "done" : "open"),
  short(about) {
    const one = about.certificate(kind);
    const state = (model.cell.calibration || {})[kind];
    if (one) return t("calib.good", {mm: (kind === "kerf" ? one.kerf_mm || 0 : one.rms_mm).toFixed(3), what: t(kind === "kerf" ? "calib.kerf" : "calib.rms")});
    return state && state !== "missing" ? t(`certificate.${state}`) : "";
  },
  body(about) {
    const one = about.certificate(kind);
    const [acts, seen = []] = body(about, id);
    return [h("p", {}, t(`how.${id}`)), one && certificateFacts(one), one && hint(t("calib.again")), !mayDo("maintainer") && h("p.viewer", {}, t("setup.maintainer")), ...acts, workRow(id), ...seen];
  },
});

// What these buttons need of the chain. A look at the bed, or Reset, beside the reason tells when it is cured.
const kNeeds = {camera: ["camera"], laser: ["machine", "camera"]};
const inTheWay = (place) => blockedBy(...(kNeeds[place] || []));
const resetButton = () => mayCommand("reset") && button(t("devices.connect"), () => give("reset"), {small: t("devices.connect.small"), id: "connect"});
const cures = (place) => {
  const lock = inTheWay(place);
  return [blockedHint(lock), lock && lock.name === "machine" && h("div.commands", {}, resetButton())];
};

function act(about, place, label, steps, more = {}) {
  const how = {disabled: !mayMeasure(place), next: !about.certificate(kKinds[place]), needs: "maintainer", wide: true, ...more};
  return button(label, () => doSteps(place, steps()), {...how, next: how.next && !how.disabled});  // a shut one is no next step
}

// ---- scanner --------------------------------------------------------------------------------------------------------

export const scannerStep = step("scanner", "scanner", (about, place) => {
  const {grid_scans: scans} = about.setup.collected;
  if (about.hands) return [[h("div.commands", {}, act(about, place, t("setup.lay_and_measure"), () => [
    layStep("grid", "scanner"), measure(place, "scanner", {more: true}), layStep("grid", "scanner"), measure(place, "scanner")], {id: "do-scanner", small: t("setup.two_places")}))]];
  return [[
    scans > 0 && h("p.fact", {role: "status"}, t("scanner.scans", {n: scans})),
    h("div.commands", {},
      act(about, place, t("scanner.more"), () => [measure(place, "scanner", {more: true})], {next: scans === 0 && !about.certificate("scanner")}),
      act(about, place, t("scanner.last"), () => [measure(place, "scanner")], {next: scans > 0, id: "do-scanner"}))]];
});

// ---- camera ---------------------------------------------------------------------------------------------------------

const kViews = [{height_mm: 0, turn_deg: 0}, {height_mm: 0, turn_deg: 8}, {height_mm: 30, turn_deg: 0}, {height_mm: 30, turn_deg: 5}];
let blocks = "30";  // mm, as somebody measured them
const kBlocks = {least: 5};

export const cameraStep = step("camera", "camera", (about, place) => {
  const taken = about.setup.collected.view_heights_mm;
  const rest = kViews.slice(taken.length);
  const left = rest.length ? rest : kViews.slice(-1);  // the fit failed: the last one once more
  const [view] = left;
  const bad = view.height_mm > 0 ? firstFault({label: t("camera.blocks"), text: blocks, rules: kBlocks}) : null;
  const height = view.height_mm > 0 ? numberOf(blocks) : 0;
  const off = {disabled: !mayMeasure(place) || Boolean(inTheWay(place)) || (Boolean(bad) && !about.hands)};
  const photograph = ({height_mm}, last) => measure(place, "camera", {height_mm, more: !last});
  // What the camera sees of the first one is shown; the others are alike.
  const viewSteps = (one, n) => [layStep("grid", "bed", one), ...(n === 0 ? [lookStep()] : []), photograph(one, n === left.length - 1)];
  if (about.hands) return [
    [cures(place), h("div.commands", {}, inTheWay(place) && lookButton(), act(about, place, t("setup.lay_and_measure"), () => left.flatMap(viewSteps), {id: "do-camera", small: t("setup.four_views"), ...off}))],
    bedPicture()];
  return [[
    h("p.fact", {role: "status"}, t("camera.view", {n: Math.min(taken.length + 1, 4)})),
    h("p", {}, t(`camera.view.${Math.min(taken.length, 3)}`)),
    view.height_mm > 0 && h("div.form", {}, numberField(t("camera.blocks"), blocks, (text) => { blocks = text; changed(); }, kBlocks)),
    cures(place),
    h("div.commands", {}, lookButton(), act(about, place, t("camera.take"), () => [photograph({height_mm: height}, left.length <= 1)], {id: "do-camera", wide: false, ...off}))],
    bedPicture()];
});

// ---- laser ----------------------------------------------------------------------------------------------------------

const kBoardSides = {width: {least: .1}, height: {least: .1}, thickness: {least: .1}};
const board = {thickness: "", width: "490", height: "290"};
// By their names in the API. Where the laser was never calibrated nothing but somebody's word tells where the board lies;
// that it is not seen is said once the cell has looked.
const kBoard = "board on the bed", kUnseen = "board not seen";
let placed = false, byHands = false;
const wasUnseen = () => [...model.tasks.values()].some((task) => task.kind === "calibrate laser" && task.error && task.error.message.includes(kUnseen));
const ticks = burnTicks("confirm", () => [...(byHands ? [] : [kBoard]), ...(wasUnseen() ? [kUnseen] : [])], () => (byHands || placed ? [] : [kBoard]));

export const laserStep = step("laser", "axes", (about, place) => {
  if (!board.thickness) board.thickness = written(about.setup.panel_thickness_mm);
  placed = Boolean(about.certificate("axes"));
  byHands = Boolean(about.hands);  // those lay it there themselves
  const body = () => ({height_mm: numberOf(board.thickness), board_width_mm: numberOf(board.width), board_height_mm: numberOf(board.height), confirmed: [...ticks.take(), ...(byHands ? [kBoard] : [])]});
  const field = (name) => numberField(t(`board.${name}`), board[name], (text) => { board[name] = text; changed(); }, {...kBoardSides[name], id: `board-${name}`});
  const bad = about.hands ? null : firstFault(...Object.entries(kBoardSides).map(([name, rules]) => ({label: t(`board.${name}`), text: board[name], rules})));
  return [[
    !about.certificate("camera") && h("p.warn", {}, t("laser.camera_first")),
    !about.hands && h("div.form", {}, h("div.pair", {}, field("width"), field("height"), field("thickness"))),
    ticks.list(),
    h("p.warn", {}, `▲ ${t("laser.burns")}`),
    about.certificate("camera") && cures(place), bad && hint(faultWords(bad)),
    h("div.commands", {}, lookButton(), act(about, place, t(about.hands ? "laser.lay_and_burn" : "laser.burn"), () => [
      ...(about.hands ? [layStep("board", "bed")] : []), measure(place, "laser", body()), lookStep()],
    {id: "do-laser", wide: false, disabled: !mayMeasure(place) || !ticks.ready() || !about.certificate("camera") || Boolean(bad) || Boolean(inTheWay(place))}))],
    bedPicture()];
});

// ---- kerf -----------------------------------------------------------------------------------------------------------

export const kerfStep = step("kerf", "kerf", (about, place) => [[
  !about.certificate("axes") && h("p.warn", {}, t("kerf.laser_first")),
  h("div.commands", {}, act(about, place, t(about.hands ? "setup.lay_and_measure" : "kerf.measure"), () => [
    ...(about.hands ? [layStep("board", "scanner", {face: "back", part: "left"})] : []), measure(place, "kerf")],
  {id: "do-kerf", disabled: !mayMeasure(place) || !about.certificate("axes")}))]]);
