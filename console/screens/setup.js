// From the unpacked machine to the first cut piece, step by step: what is there, what is missing and why, what the
// camera sees. What is done is read from the cell, so that it can be left and gone on with anywhere.
import {h} from "../dom.js";
import {t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, model} from "../model.js";
import {button, card, empty, viewerHint} from "../parts.js";
import {hasHands} from "../hands.js";
import {devicesStep, printStep} from "./setup_devices.js";
import {cameraStep, kerfStep, laserStep, scannerStep} from "./setup_calibrate.js";
import {drawJobMap} from "./job_map.js";
import {cutStep, pictureStep, recipesStep, woodStep} from "./setup_wood.js";

// Each: {id, state(about) -> "done" or "open", short(about) -> one line, body(about) -> nodes}
const kSteps = [devicesStep, printStep, scannerStep, cameraStep, laserStep, kerfStep, recipesStep, woodStep, pictureStep, cutStep];
const kMarks = {done: "✓", now: "▶", open: "○"};

let setup = null;         // the last GET /setup
let certificates = [];    // newest first
let asked = "";           // what was so when they were asked for
let chosen = "";          // a step that was opened by hand

export async function enter(step) {
  chosen = kSteps.some((one) => one.id === step) ? step : "";
  asked = "";
}

// Anew whenever it may be otherwise.
function follow() {
  const {cell} = model;
  const over = [...model.tasks.values()].filter((task) => task.state !== "running").length;
  const now = JSON.stringify([cell.calibration, cell.state, over]);
  if (now === asked) return;
  asked = now;
  Promise.all([get("/setup"), get("/certificates?limit=100")]).then(([fresh, {certificates: list}]) => {
    setup = fresh;
    certificates = list;
    changed();
  }, () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

export function draw() {
  if (!model.cell) return empty(t("connecting"));
  follow();
  if (!setup) return empty(t("connecting"));
  const about = {setup, hands: hasHands(), certificate: (kind) => certificates.find((one) => one.kind === kind && one.state === "valid") || null};
  const now = kSteps.find((step) => step.state(about) !== "done");
  const shown = kSteps.find((step) => step.id === chosen) || now || cutStep;
  const done = kSteps.filter((step) => step.state(about) === "done").length;
  return [
    viewerHint(),
    h("div.columns.guide", {},
      h("div.column", {}, card(t("setup.steps", {done, n: kSteps.length}),
        h("ol.steps", {}, ...kSteps.map((step, n) => row(step, n, about, now, shown))))),
      h("div.column", {},
        !now && h("p.note.good", {role: "status"}, t("setup.done")),
        h("section.card", {"aria-label": t(`setup.${shown.id}`), "data-key": `step-${shown.id}`, "data-step": shown.id},
          h("h2.title", {}, `${kSteps.indexOf(shown) + 1}. ${t(`setup.${shown.id}`)}`),
          ...[shown.body(about)].flat(Infinity).filter(Boolean)),
        shown !== now && now && button(t("setup.to_now", {step: t(`setup.${now.id}`)}), () => { chosen = ""; changed(); }))),
  ];
}

export const drawn = (place) => { if (model.cell && model.cell.job) drawJobMap(place); };

function row(step, n, about, now, shown) {
  const state = step === now ? "now" : step.state(about);
  return h("li", {"data-key": step.id, class: `is-${state}`},
    h("button", {type: "button", "aria-current": step === shown ? "step" : null, onclick: () => { chosen = step.id; changed(); }},
      h("span.mark", {"aria-hidden": "true"}, kMarks[state]),
      h("span", {}, h("b", {}, `${n + 1}. ${t(`setup.${step.id}`)}`), h("small", {}, step.short(about) || t(`setup.state.${state}`)))));
}
