// Set up: which laser, scanner and camera the cell has and who said so; what is plugged in, and choosing it for the next
// start. What somebody has written into the configuration file stays.
import {h} from "../dom.js";
import {asSentence, span, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, isStale, mayChange, mayDo, model} from "../model.js";
import {command} from "../commands.js";
import {button, fact, facts, hint, cellSays, later} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf} from "../fields.js";
import {doSteps, isBusy, workAt, workRow} from "../work.js";
import {areSought, findScanners, scannersFound, scannersRow} from "../scanners.js";
import {areCamerasSought, camerasFound, camerasRow, findCameras, isTrying, lastTrial} from "../cameras.js";

const kDevices = ["laser", "scanner", "camera"];
const kRealLaser = "a laser is at this port", kSimulation = "a simulation takes its place";  // by their names in the API
const kRest = ["Stopped", "Idle", "Complete"];
const kRefusalMs = 10000;

let devices = null;   // the last GET /devices, and the life of the daemon that told it
let toldIn = -1;
let asked = "";       // what was so when it was asked for
let found = null;     // {lasers, pictures}, once somebody looked
let restartedIn = -1; // the life of the daemon in which it was told to restart
const through = later(() => import("./setup_trial.js"));  // looking through a camera
const picked = {}, sure = {};  // by device: what is marked in its list, and whether what is asked of it is ticked
let more = {board: "m2", travel_x_mm: "", travel_y_mm: "", dpi: ""};

// A restart that is refused may be possible as soon as a task or a check has ended, which no event tells: it is asked
// again while the page says so.
let refusal = 0;
function followRefusal() {
  if (refusal) return;
  refusal = setTimeout(() => { refusal = 0; asked = ""; changed(); }, kRefusalMs);
}

// Anew with another life of the daemon, another state (a restart may be possible then), and another role.
function follow() {
  const now = JSON.stringify([model.opened, model.cell.state, model.role, (model.cell.tasks || []).length]);
  if (now === asked) return;
  asked = now;
  const life = model.opened;
  get("/devices").then((fresh) => { devices = fresh; toldIn = life; changed(); },
    () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

export const chooseParts = () => {
  follow();
  if (!devices) return [];
  if (devices.problem) followRefusal();
  const open = kDevices.some(isOpen);
  const is = (name) => ((devices.next || devices)[name]).kind;
  return [
    open && kDevices.every((name) => is(name) === "sim") && h("p", {}, t("choose.open")),
    open && h("div.commands", {}, button(t("choose.look"), look, {wide: true, disabled: !mayChange() || isBusy("devices") || areSought() || areCamerasSought() || isTrying(), id: "look-devices"})),
    workRow("devices"), scannersRow(), camerasRow(),
    ...kDevices.map(part),
    is("laser") !== "sim" && (is("scanner") === "sim" || is("camera") === "sim") && h("p.warn", {}, `▲ ${t("choose.mixed")}`),
    devices.problem && h("p.warn", {}, `▲ ${t("choose.problem")} `, cellSays(asSentence(devices.problem))),
    devices.next && restartPart(),
  ];
};

const isOpen = (name) => devices.choose && devices[name].set_by !== "file";
const words = (name, one) => [t(`kind.${one.kind}`), one.kind === "sim" ? "" : one.port || one.device, name === "scanner" && one.kind === "sane" ? `${one.dpi} dpi` : "", one.kind === "v4l2" ? `${one.width} × ${one.height}, ${one.format}` : ""].filter(Boolean).join(", ");

function part(name) {
  const now = devices[name];
  const then = devices.next && devices.next[name];
  const turns = then && JSON.stringify(then) !== JSON.stringify(now);
  const laser = model.cell.laser || {};
  return h("section.device", {"data-key": `device-${name}`, "data-device": name, "aria-label": t(name)},
    h("h3", {}, t(name)),
    facts(
      fact(t("choose.now"), words(name, now)),
      name === "laser" && now.kind !== "sim" && fact(t("choose.answers"), laser.connected ? t("laser.connected") : laser.why_not_connected || t("devices.not_asked"), Boolean(laser.why_not_connected)),
      turns && fact(t("choose.next"), words(name, then), true)),
    (!turns || now.set_by === "file") && h("p.dim", {}, t(`choose.by.${now.set_by}`, {file: devices.file || t("choose.file")})),
    isOpen(name) && found && choices(name, [now, then || now].some((one) => one.kind !== "sim")));
}

// ---- what there is to choose ----------------------------------------------------------------------------------------

// What was ticked was said of what was plugged in before.
const forget = () => { for (const name of kDevices) sure[name] = false; };
async function look() {
  forget();
  await doSteps("devices", [{text: t("choose.looking"), act: async () => { const {lasers, pictures} = await get("/devices/found"); found = {lasers, pictures}; }}]);
  if (workAt("devices").fault) return;
  through.ask();
  findScanners();
  findCameras();
}

// Each: {key, body, label, small, problem, said: by the page itself, refused}
function options(name) {
  const simulated = {key: "sim", body: {kind: "sim"}, label: t("choose.sim")};
  if (name === "laser") return [...found.lasers.map((one) => ({key: one.port, body: {kind: one.kind, port: one.port}, label: `${t(`kind.${one.kind}`)}${one.name ? `, ${one.name}` : ""}`, small: [one.port, one.named_by === "socket" ? t("choose.socket") : ""].filter(Boolean).join(" – "), problem: one.refusal, refused: Boolean(one.refusal)})), simulated];
  if (name === "scanner") return [...(scannersFound() || []).map((one) => ({key: one.name, body: {kind: "sane", device: one.make}, label: one.make || one.name, small: one.name, problem: one.make ? one.problem : t("choose.no_make"), said: !one.make, refused: !one.make})), simulated];
  return [...(through.part && camerasFound() || []).map(cameraOption), ...found.pictures.map((one) => ({key: one.device, body: {kind: "file", device: one.device}, label: one.device.split("/").pop(), small: `${one.device}, ${t("choose.age", {span: span(one.age_s)})}`})), simulated];
}

// Only under a name that lasts; and one that could not even be asked gives no pictures.
function cameraOption(one) {
  const {sizeWords, lackWords} = through.part;
  const said = !one.device;
  return {key: one.device || one.node, body: {kind: "v4l2", device: one.device}, camera: one, label: one.name || one.node, small: [one.device || one.node, one.named_by === "socket" ? t("choose.socket") : "", sizeWords(one)].filter(Boolean).join(" – "),
    problem: said ? t("choose.no_name") : one.problem, said, refused: said || Boolean(one.problem), remarks: said || one.problem ? [] : lackWords(one)};
}

const kTravel = {least: 50, most: 2000}, kDpi = {least: 75, most: 1200, whole: true, optional: true};
const field = (key, rules) => ({label: t(`choose.${key}`), text: more[key], rules});

function choices(name, isReal) {
  const all = options(name);
  const mark = all.find((one) => one.key === picked[name]);
  const asking = (name === "scanner" && !scannersFound()) || (name === "camera" && !camerasFound());
  const sought = name === "scanner" ? areSought() : areCamerasSought();
  const camera = mark && mark.camera;
  const real = name === "laser" && mark && mark.body.kind !== "sim", board = real && mark.body.kind === "lihuiyu";
  const backToSim = mark && mark.body.kind === "sim" && isReal;
  const isSane = name === "scanner" && mark && mark.body.kind === "sane";
  const bad = board ? firstFault(field("travel_x_mm", kTravel), field("travel_y_mm", kTravel)) : isSane ? firstFault(field("dpi", kDpi)) : null;
  const lacks = (camera && !through.part.chosenTrial(camera)) || bad || ((real || backToSim) && !sure[name]) || (mark && mark.body.kind === "sim" && !isReal);
  const busy = !mayDo("maintainer") || isStale() || !kRest.includes(model.cell.state);
  const number = (key, rules, placeholder = "") => numberField(t(`choose.${key}`), more[key], (text) => { more[key] = text; changed(); }, {...rules, placeholder, id: `choose-${key}`});
  return h("div", {"data-key": "choices"},
    asking ? (sought && h("p.dim", {}, t(`choose.asking.${name}`))) : all.length === 1 && h("p.dim", {}, t(`choose.none.${name}`, {folder: devices.camera_folder || ""})),
    (all.length > 1 || isReal) && h("div.jobs", {role: "radiogroup", "aria-label": t("choose.which", {device: t(name)})}, ...all.map((one) => h("label", {"data-key": one.key},
      h("input", {type: "radio", name: `choose-${name}`, value: one.key, checked: picked[name] === one.key, disabled: Boolean(one.refused), onchange: () => { picked[name] = one.key; sure[name] = false; changed(); }}),
      h("span", {}, h("b", {}, one.label), one.small && h("small", {}, one.small), one.problem && h("small", {}, " ▲ ", one.said ? asSentence(one.problem) : cellSays(asSentence(one.problem))),
        ...(one.remarks || []).map((remark) => h("small", {}, ` ▲ ${asSentence(remark)}`)))))),
    camera && through.part.trialPart(camera),
    board && h("div.form", {},
      h("label", {}, t("choose.board"), h("select", {value: more.board, onchange: (event) => { more.board = event.target.value; changed(); }}, ...["m2", "m3"].map((one) => h("option", {value: one}, one.toUpperCase())))),
      h("div.pair", {}, number("travel_x_mm", kTravel), number("travel_y_mm", kTravel)),
      h("p.dim", {}, t("choose.travel"))),
    isSane && h("div.form", {}, number("dpi", kDpi, String(devices.scanner.dpi))),
    (real || backToSim) && h("fieldset.confirm", {"data-key": "sure"}, h("legend", {}, t("confirm")), h("label", {},
      h("input", {type: "checkbox", id: `sure-${name}`, checked: Boolean(sure[name]), onchange: (event) => { sure[name] = event.target.checked; changed(); }}), h("span", {}, t(real ? "choose.sure" : `choose.simulate.${name}`)))),
    bad && hint(faultWords(bad)),
    camera && hint(through.part.trialLacks(camera)),
    mark && h("div.commands", {}, button(t("choose.take", {device: t(name)}), () => take(name, mark.body, backToSim), {wide: true, id: `choose-${name}`, needs: "maintainer",
      disabled: busy || Boolean(lacks), small: t("choose.take.small")})));
}

async function take(name, body, backToSim) {
  const whole = {...body};
  if (name === "laser" && body.kind !== "sim") whole.confirmed = [kRealLaser];
  if (backToSim) whole.confirmed = [kSimulation];
  if (body.kind === "lihuiyu") Object.assign(whole, {board: more.board, travel_x_mm: numberOf(more.travel_x_mm), travel_y_mm: numberOf(more.travel_y_mm)});
  if (body.kind === "sane" && more.dpi.trim()) whole.dpi = numberOf(more.dpi);
  if (body.kind === "v4l2") whole.trial = lastTrial().trial;
  const told = await command(`/devices/${name}`, {body: whole});
  if (!told) return;
  devices = told;
  toldIn = model.opened;
  delete picked[name];
  sure[name] = false;
  changed();
}

// ---- the next start -------------------------------------------------------------------------------------------------

async function restart() {
  const life = toldIn;
  if (await command("/restart")) restartedIn = life;
  changed();
}

function restartPart() {
  const refused = restartedIn !== toldIn && devices.restart_refused;
  if (refused) followRefusal();
  return h("div.note", {"data-key": "restart", role: "status"},
    h("p", {}, t("choose.counts")),
    restartedIn === toldIn ? h("p", {}, t("choose.restarting")) : refused ? h("p", {}, cellSays(asSentence(refused))) : h("div.commands", {}, button(t("choose.restart"), restart, {wide: true, id: "restart", needs: "maintainer", disabled: !mayDo("maintainer") || isStale(), small: t("choose.restart.small")})));
}
