// Set up: how wood is cut, the first panel into stock, a first small picture, and the first cut.
import {h} from "../dom.js";
import {asSentence, squareCm, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, isOver, loadJobs, loadPanels, mayChange, model} from "../model.js";
import {allConfirmed, blockedBy, choose, clearing, command, give, mayClear, mayCommand, panelFound} from "../commands.js";
import {bar, blockedHint, button, empty, fact, facts, hint, cellSays, link} from "../parts.js";
import {isShown, picture} from "../pictures.js";
import {doubtRows, keepDoubts, mayOverrule, openDoubts, overruled, withStrips} from "../doubts.js";
import {doSteps, isBusy, over, Refused, run, workRow} from "../work.js";
import {lay, layStep} from "../hands.js";
import {bedCard} from "./bed.js";
import {lookButton} from "./setup_bed.js";
import {checkList, sightWords} from "./run.js";
import {jobKey, jobMap} from "./job_map.js";

// ---- recipes --------------------------------------------------------------------------------------------------------

export const recipesStep = {
  id: "recipes",
  state: () => "done",  // as shipped, until somebody sets one
  short: () => t("recipes.as_shipped"),
  body: () => [h("p", {}, t("recipes.about")), link("#settings", t("next.go", {screen: t("screen.settings")}), {class: "go"})],
};

// ---- wood -----------------------------------------------------------------------------------------------------------

const inStock = () => model.panels.filter((panel) => !panel.retired);
const withBack = () => inStock().find((panel) => panel.faces.includes("back"));
const withoutBack = () => inStock().find((panel) => !panel.faces.includes("back"));

let waiting = [], waitingFor = "";  // proposals
function followProposals() {
  const over = [...model.tasks.values()].filter((task) => task.state !== "running").length;
  const now = `${over} ${model.panels.length} ${(model.cell.next_step || {}).step}`;
  if (now === waitingFor) return;
  waitingFor = now;
  get("/proposals").then(({proposals}) => { if (waitingFor === now) { waiting = proposals; keepDoubts(proposals); changed(); } }, () => setTimeout(() => { if (waitingFor === now) { waitingFor = ""; changed(); } }, kAgainMs));
}

const stocked = async (work) => { const made = await work; loadPanels(); return made; };
const scanStep = (place, body) => ({text: t("wood.scanning"), act: () => stocked(run(place, "/scans", body))});

function proposal(place, seen) {
  // The button may be of a moment ago.
  const accept = () => !openDoubts(seen).length && mayOverrule(seen) && doSteps(place, [{text: t("scan.accept"), act: () => stocked(run(place, `/proposals/${seen.number}/accept`, overruled(seen)))}]);
  // Nobody accepts what has not been shown yet.
  const path = `/proposals/${seen.number}/picture.png`;
  const shown = isShown(document.querySelector("img.seen"), path);
  const may = mayChange() && shown && mayOverrule(seen) && !openDoubts(seen).length;
  return [
    h("p", {}, t("wood.look")),
    !shown && empty(t("wood.picture_comes")),
    withStrips(seen, picture(path, t("scan.picture_of", {n: seen.number}), {version: String(seen.number), class: "seen", "data-key": `proposal-${seen.number}`}), shown),
    facts(fact(t("scan.size"), `${seen.size_mm.map((side) => side.toFixed(1)).join(" × ")} mm`), fact(t("scan.usable"), squareCm(seen.usable_mm2))),
    doubtRows(seen),
    h("div.commands", {},
      button(t("scan.accept"), accept, {id: "do-accept", disabled: !may || isBusy(place), next: may}),
      button(t("scan.refuse"), () => command(`/proposals/${seen.number}/refuse`, {body: {}}), {disabled: !mayChange() || isBusy(place)}))];
}

export const woodStep = {
  id: "wood",
  state: () => (withBack() ? "done" : "open"),
  short: () => (inStock().length ? t(withBack() ? "wood.there" : "wood.no_back", {panel: (withBack() || withoutBack()).id}) : ""),
  body(about) {
    followProposals();
    const place = "wood";
    const begin = (label, steps, small) => h("div.commands", {}, button(label, () => doSteps(place, steps()), {id: "do-wood", wide: true, small, disabled: !mayChange() || isBusy(place), next: mayChange() && !isBusy(place)}));
    const half = withoutBack();
    const now = waiting.length ? proposal(place, waiting[0])
      : withBack() && !half ? [h("p", {}, t("wood.there", {panel: withBack().id})), link(`#panels/${withBack().id}`, t("scan.open"), {class: "go"})]
      : half ? [h("p", {}, t("how.wood_back", {panel: half.id})),
                begin(t(about.hands ? "wood.turn_and_scan" : "wood.scan_back"), () => [...(about.hands ? [layStep("panel", "scanner", {face: "back"})] : []), scanStep(place, {face: "back", panel: half.id})])]
      : [h("p", {}, t("how.wood")),
         begin(t(about.hands ? "wood.lay_and_scan" : "scan.do"), () => [...(about.hands ? [layStep("panel", "scanner")] : []), scanStep(place, {face: "show"})])];
    return [...now, workRow(place)];
  },
};

// ---- a first picture ------------------------------------------------------------------------------------------------

const openJob = () => model.jobs.find((job) => !isOver(job));
const cutJob = () => model.jobs.find((job) => job.cut > 0);
let file = null;

// Something small with light, dark and edges; drawn here, so that nothing has to be at hand.
function testPicture() {
  const canvas = document.createElement("canvas");
  canvas.width = 300;
  canvas.height = 400;
  const paper = canvas.getContext("2d");
  const ground = paper.createLinearGradient(0, 0, 300, 400);
  ground.addColorStop(0, "#f2e2c4");
  ground.addColorStop(1, "#8a6038");
  paper.fillStyle = ground;
  paper.fillRect(0, 0, 300, 400);
  paper.fillStyle = "#3a2414";
  paper.beginPath();
  paper.arc(150, 170, 90, 0, 2 * Math.PI);
  paper.fill();
  paper.fillRect(135, 240, 30, 130);
  return new Promise((made) => canvas.toBlob(made, "image/png"));
}

async function makeJob(place) {
  const query = new URLSearchParams({name: t(file ? "first.own_name" : "first.name"), size_mm: "30", patch_mm: "10"});
  const begun = await command(`/jobs?${query}`, {body: file || await testPicture(), timeoutMs: 60000});
  if (!begun) throw new Refused("");
  const task = await over(begun.task);
  if (task.state !== "done") throw new Refused(task.error.message);
  choose(task.result.job);
  loadJobs();
}

export const pictureStep = {
  id: "picture",
  state: () => (model.jobs.some((job) => job.state !== "cancelled") ? "done" : "open"),
  short() { const job = openJob(); return job ? t("first.planned", {name: job.name, n: job.pieces}) : ""; },
  body() {
    const place = "picture", job = openJob();
    return [
      h("p", {}, t("how.picture")),
      job && picture(`/jobs/${job.id}/preview.png?width=400`, job.name, {version: job.newest_plan, class: "target"}),
      !job && h("details", {}, h("summary", {}, t("first.own")), h("div.form", {}, h("label.file", {}, t("picture.file"),
        h("input", {type: "file", accept: "image/*", onchange: (event) => { [file] = event.target.files; changed(); }})))),
      !job && h("div.commands", {}, button(t(file ? "first.do_own" : "first.do"), () => doSteps(place, [{text: t("picture.wait"), act: () => makeJob(place)}]),
        {id: "do-picture", wide: true, small: t("first.small"), disabled: !mayChange() || isBusy(place), next: mayChange() && !isBusy(place)})),
      workRow(place)];
  },
};

// ---- the cut --------------------------------------------------------------------------------------------------------

const kWaitMs = 120000;

// Homing takes its time and is answered at its end.
async function begin(job) {
  if (["Stopped", "Complete"].includes(model.cell.state) && !await command("/commands/reset", {timeoutMs: kWaitMs})) throw new Refused("");
  if (!await command(`/jobs/${job.id}/start`)) throw new Refused("");
}

export const cutStep = {
  id: "cut",
  state: () => (cutJob() && !["Execute", "Held", "Suspended"].includes(model.cell.state) ? "done" : "open"),
  short() { const {job} = model.cell; return job ? t("job.progress", {cut: job.cut, n: job.pieces}) : ""; },
  body(about) {
    const {cell} = model, place = "cut", {load, state} = cell, job = openJob();
    const under = cell.job && !["Stopped", "Idle", "Aborted"].includes(state);
    const wide = {wide: true};
    const lock = blockedBy("machine", "camera"), mayBegin = mayChange() && !isBusy(place) && !lock;
    const go = [];
    if (!under && job && state !== "Aborted") go.push(h("p", {}, t("how.cut")), blockedHint(lock),
      lock && h("div.commands", {}, lookButton(), lock.name === "machine" && mayCommand("reset") && button(t("devices.connect"), () => give("reset"), {small: t("devices.connect.small"), id: "connect"})),
      h("div.commands", {}, button(t("first.begin"), () => doSteps(place, [{text: t("first.begin"), act: () => begin(job)}]),
      {...wide, id: "do-begin", small: t("devices.connect.small"), disabled: !mayBegin || !["Stopped", "Idle", "Complete"].includes(state), next: mayBegin})));
    if (load) go.push(h("p.big", {}, t(load.found ? "load.on" : "load.lay", {panel: load.panel})), h("p", {}, t(load.face_up === "back" ? "load.back" : "load.show")),
      h("p.fact", {}, `${load.found ? "✓" : "◆"} `, sightWords(load)));
    if (load && !load.found && about.hands) go.push(h("div.commands", {}, button(t("hands.lay.panel.bed"), () => doSteps(place, [{text: t("hands.lay.panel.bed"), act: () => lay("panel", "bed", {face: load.face_up})}]),
      {...wide, id: "do-lay", disabled: isBusy(place), next: !isBusy(place)})));
    if (state === "Suspended") go.push(checkList(), h("div.commands", {}, button(t("do.unsuspend"), () => give("unsuspend"),
      {...wide, "data-command": "unsuspend", small: t("do.unsuspend.small"), disabled: !mayCommand("unsuspend"), next: mayCommand("unsuspend")}), hint(panelFound() && !allConfirmed() ? t("confirm.first") : "")));
    if (under) go.push(bar(cell.job.pieces ? cell.job.cut / cell.job.pieces : 0, {label: t("job.progress", {cut: cell.job.cut, n: cell.job.pieces})}),
      h("p", {}, t("job.progress", {cut: cell.job.cut, n: cell.job.pieces})));
    if (state === "Execute") go.push(h("div.commands", {}, button(t("do.hold"), () => give("hold"), {disabled: !mayCommand("hold")})));
    if (state === "Aborted") go.push(h("p.warn", {}, "▲ ", cellSays(asSentence(cell.reason))), h("div.commands", {}, button(t("do.clear"), clearing(), {...wide, id: "do-clear", small: t("first.clear"), disabled: !mayClear(), next: mayClear()})));
    if (state === "Held") go.push(h("p.warn", {}, t("first.look_at_run")), link("#run", t("next.go", {screen: t("screen.run")}), {class: "go"}));
    if (cutJob() && !["Execute", "Suspended"].includes(state)) go.push(h("p.big", {role: "status"}, t("first.cut", {n: cutJob().cut})), h("div.choices", {},
      link(`#assembly/${cutJob().id}`, t("next.go", {screen: t("screen.assembly")}), {class: "go"}), link("#new", t("next.go", {screen: t("screen.new")}), {class: "go"})));
    if (!go.length) go.push(empty(t("first.no_job")));
    return [...go, workRow(place), under && bedCard(), under && cell.job && jobMap(cell.job.id), under && jobKey()];
  },
};
