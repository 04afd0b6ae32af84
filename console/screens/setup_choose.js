// Set up: which laser, scanner and camera the cell has and who said so; what is plugged in, and choosing it for the next
// start. What somebody has written into the configuration file stays.
import {h} from "../dom.js";
import {asSentence, span, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, isStale, mayChange, mayDo, model} from "../model.js";
import {command} from "../commands.js";
import {button, fact, facts} from "../parts.js";
import {doSteps, isBusy, run, workRow} from "../work.js";

const kDevices = ["laser", "scanner", "camera"];
const kRealLaser = "a laser is at this port";  // by its name in the API
const kRest = ["Stopped", "Idle", "Complete", "Aborted"];

let devices = null;   // the last GET /devices
let asked = "";       // what was so when it was asked for
let found = null;     // {lasers, pictures, scanners}, once somebody looked
let restarting = false;
const picked = {};    // by device: what is marked in its list
let more = {board: "m2", travel_x_mm: "300", travel_y_mm: "200", dpi: "300"}, sure = false;

// Anew with another life of the daemon, another state (a restart may be possible then), and another role.
function follow() {
  const now = JSON.stringify([model.opened, model.cell.state, model.role, (model.cell.tasks || []).length]);
  if (now === asked) return;
  asked = now;
  get("/devices").then((fresh) => { devices = fresh; restarting = false; changed(); },
    () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

export const chooseParts = () => {
  follow();
  if (!devices) return [];
  const open = kDevices.some((name) => devices[name].set_by !== "file");
  return [
    open && h("div.commands", {}, button(t("choose.look"), look, {wide: true, disabled: !mayChange() || isBusy("devices"), id: "look-devices"})),
    workRow("devices"),
    ...kDevices.map(part),
    devices.problem && h("p.warn", {}, `▲ ${t("choose.problem")} ${asSentence(devices.problem)}`),
    devices.next && restartPart(),
  ];
};

const words = (name, one) => [one.kind === "sim" ? t("kind.sim") : t(`kind.${one.kind}`), one.kind === "sim" ? "" : one.port || one.device || t("choose.the_only_one"), name === "scanner" && one.kind === "sane" ? `${one.dpi} dpi` : ""].filter(Boolean).join(", ");

function part(name) {
  const now = devices[name];
  const then = devices.next && devices.next[name];
  const turns = then && JSON.stringify(then) !== JSON.stringify(now);
  const real = model.cell.laser || {};
  return h("section.device", {"data-key": `device-${name}`, "data-device": name, "aria-label": t(name)},
    h("h3", {}, t(name)),
    facts(
      fact(t("choose.now"), words(name, now)),
      name === "laser" && now.kind !== "sim" && fact(t("choose.answers"), real.connected ? t("laser.connected") : real.why_not_connected || t("devices.not_asked"), Boolean(real.why_not_connected)),
      turns && fact(t("choose.next"), words(name, then), true)),
    (!turns || now.set_by === "file") && h("p.dim", {}, t(`choose.by.${now.set_by}`, {file: devices.file})),
    now.set_by !== "file" && found && choices(name, then || now));
}

// ---- what there is to choose ----------------------------------------------------------------------------------------

const look = () => doSteps("devices", [
  {text: t("choose.looking"), act: async () => { const {lasers, pictures} = await get("/devices/found"); found = {lasers, pictures, scanners: []}; changed(); }},
  {text: t("choose.scanners"), act: async () => { found.scanners = (await run("devices", "/scanners", {})).scanners; changed(); }},
]);

// Each: {key, body, label, small, problem}
function options(name) {
  const simulated = {key: "sim", body: {kind: "sim"}, label: t("choose.sim")};
  if (name === "laser") return [...found.lasers.map((one) => ({key: one.port, body: {kind: one.kind, port: one.port}, label: `${t(`kind.${one.kind}`)}${one.name ? `, ${one.name}` : ""}`, small: [one.port, one.lasting ? "" : t("choose.passing")].filter(Boolean).join(" – ")})), simulated];
  if (name === "scanner") return [...found.scanners.map((one) => ({key: one.name, body: {kind: "sane", device: one.make || one.name}, label: one.make || one.name, small: one.name, problem: one.problem})), simulated];
  return [...found.pictures.map((one) => ({key: one.device, body: {kind: "file", device: one.device}, label: one.device.split("/").pop(), small: `${one.device}, ${t("choose.age", {span: span(one.age_s)})}`})), simulated];
}

function choices(name, is) {
  const all = options(name);
  const mark = all.find((one) => one.key === picked[name]);
  const busy = !mayDo("maintainer") || isStale() || !kRest.includes(model.cell.state);
  const real = name === "laser" && mark && mark.body.kind !== "sim";
  const number = (key, least, most) => h("label", {}, t(`choose.${key}`), h("input", {type: "number", min: least, max: most, step: "any", value: more[key], oninput: (event) => { more[key] = event.target.value; changed(); }}));
  return h("div", {"data-key": "choices"},
    all.length === 1 && h("p.dim", {}, t(`choose.none.${name}`)),
    (all.length > 1 || is.kind !== "sim") && h("div.jobs", {role: "radiogroup", "aria-label": t("choose.which", {device: t(name)})}, ...all.map((one) => h("label", {"data-key": one.key},
      h("input", {type: "radio", name: `choose-${name}`, value: one.key, checked: picked[name] === one.key, onchange: () => { picked[name] = one.key; sure = false; changed(); }}),
      h("span", {}, h("b", {}, one.label), one.small && h("small", {}, one.small), one.problem && h("small", {}, ` ▲ ${asSentence(one.problem)}`))))),
    real && mark.body.kind === "lihuiyu" && h("div.form", {},
      h("label", {}, t("choose.board"), h("select", {value: more.board, onchange: (event) => { more.board = event.target.value; changed(); }}, ...["m2", "m3"].map((one) => h("option", {value: one}, one.toUpperCase())))),
      h("div.pair", {}, number("travel_x_mm", 50, 2000), number("travel_y_mm", 50, 2000))),
    name === "scanner" && mark && mark.body.kind === "sane" && h("div.form", {}, number("dpi", 75, 1200)),
    real && h("fieldset.confirm", {"data-key": "sure"}, h("legend", {}, t("confirm")), h("label", {},
      h("input", {type: "checkbox", id: "sure-laser", checked: sure, onchange: (event) => { sure = event.target.checked; changed(); }}), t("choose.sure"))),
    mark && h("div.commands", {}, button(t("choose.take", {device: t(name)}), () => take(name, mark.body), {wide: true, id: `choose-${name}`, needs: "maintainer",
      disabled: busy || (real && !sure) || (mark.body.kind === "sim" && is.kind === "sim"), small: t("choose.take.small")})));
}

async function take(name, body) {
  const whole = {...body};
  if (name === "laser" && body.kind !== "sim") whole.confirmed = [kRealLaser];
  if (body.kind === "lihuiyu") Object.assign(whole, {board: more.board, travel_x_mm: Number(more.travel_x_mm), travel_y_mm: Number(more.travel_y_mm)});
  if (body.kind === "sane") whole.dpi = Number(more.dpi) || 300;
  const told = await command(`/devices/${name}`, {body: whole});
  if (!told) return;
  devices = told;
  delete picked[name];
  sure = false;
  changed();
}

// ---- the next start -------------------------------------------------------------------------------------------------

async function restart() {
  restarting = Boolean(await command("/restart"));
  changed();
}

const restartPart = () => h("div.note", {"data-key": "restart", role: "status"},
  h("p", {}, t("choose.counts")),
  restarting ? h("p", {}, t("choose.restarting"))
    : devices.restart_refused ? h("p.dim", {}, asSentence(devices.restart_refused))
      : h("div.commands", {}, button(t("choose.restart"), restart, {wide: true, id: "restart", needs: "maintainer", disabled: !mayDo("maintainer") || isStale(), small: t("choose.restart.small")})));
