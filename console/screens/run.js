// One job through the laser: which panel and how, the bed, what is asked before the beam comes on, the commands, and
// what is cut, piece by piece.
import {h, svg} from "../dom.js";
import {asSentence, span, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, databaseSound, inCuttingOrder, isOver, loadJobs, mayChange, model, operates, panelOf} from "../model.js";
import {allConfirmed, askedNames, choose, clearing, command, confirmName, confirmedNames, give, isConfirmed, leadTo, mayClear, mayCommand, mayStart, panelFound, start, startable} from "../commands.js";
import {bar, button, card, empty, fact, facts, cellSays, jobWords, nowWords, viewerHint} from "../parts.js";
import {picture} from "../pictures.js";
import {bedCard, panelOnBed} from "./bed.js";
import {drawJobMap, jobKey, jobMap} from "./job_map.js";
import {pieceCards} from "./pieces.js";
import {sheetHands} from "./sheet_hands.js";
import {faultOf, numberField, numberOf, written} from "../fields.js";

// #run/3: with this job chosen, as a sentence of the cell's leads to it.
export function enter(job) { if (job) leadTo(Number(job)); }

export function draw() {
  if (!model.cell) return empty(t("connecting"));
  return h("div.columns.run", {},
    h("div.column", {role: "group", "aria-label": t("load")}, loadCard(), bedCard(), sheetHands("bed", (model.cell.load || {}).face_up || "back")),
    h("div.column.do", {role: "group", "aria-label": t("commands")}, commandsCard()),
    h("div.column", {role: "group", "aria-label": t("job")}, jobCard(), ...pieceCards(), jobsCard()));
}

export function drawn(place) {
  if (!model.cell) return;
  drawJobMap(place);
  focusMoved(place);
}

// ---- the panel ------------------------------------------------------------------------------------------------------

const kLying = {Execute: "load.cut", Completing: "load.cut", Stopping: "load.cut", Held: "load.held", Holding: "load.held", Unholding: "load.looked", Unsuspending: "load.looked"};

// What is said of the bed when no panel is asked for.
function bedWords() {
  const {cell} = model;
  const panel = panelOnBed();
  if (cell.state === "Complete") return t("load.take");
  if (panel && kLying[cell.state]) return t(kLying[cell.state], {panel});
  return t(kLying[cell.state] ? "load.some" : "load.none");
}

// One answer of the cell's is kept, the last one: null while it is on its way.
function lastOf(path) {
  let of = "", told = null, toldOf = "";
  return (id, version) => {
    const key = `${id} ${version}`;
    if (of !== key) {
      if (toldOf !== String(id)) told = null;  // what is known of another one
      toldOf = String(id);
      of = key;
      get(`${path}/${encodeURIComponent(id)}`).then((fresh) => { if (of === key) { told = fresh; changed(); } }, () => setTimeout(() => { if (of === key) { of = ""; changed(); } }, kAgainMs));
    }
    return told;
  };
}
const panelTold = lastOf("/panels"), jobTold = lastOf("/jobs");

// The tags and holes of the face that looks up from the bed, by which the camera finds the panel, where they are to be
// seen: from the back left and right change places.
function marksUp(panel, face) {
  const {width_mm: wide, height_mm: high} = panel;
  const at = ([x, y]) => [face === "back" ? wide - x : x, high - y];
  const line = (ring) => `M${ring.map((point) => at(point).map((mm) => mm.toFixed(1)).join(" ")).join("L")}Z`;
  return panel.fiducials.filter((one) => one.kind === "hole" || one.face === face).map((one) => {
    const [x, y] = at(one.centre_mm);
    if (one.kind === "hole") return svg("circle", {cx: x, cy: y, r: Math.max(2, wide / 100)});
    const side = Math.hypot(one.corners_mm[1][0] - one.corners_mm[0][0], one.corners_mm[1][1] - one.corners_mm[0][1]);
    return svg("g", {}, svg("path", {d: line(one.corners_mm)}), svg("text", {x, y, "font-size": (side * .4).toFixed(1)}, String(one.tag_id)));
  });
}

// No scan shows the back as it looks up from the bed.
function backView(known) {
  const panel = panelTold(known.id, known.mask_version);
  if (!panel) return null;
  const {width_mm: wide, height_mm: high} = panel;
  return svg("svg.back", {viewBox: `-2 -2 ${wide + 4} ${high + 4}`, role: "img", "aria-label": t("load.back_of", {panel: panel.id}), "data-back": panel.id},
    svg("rect", {x: 0, y: 0, width: wide, height: high}), ...marksUp(panel, "back"));
}

function showView(known, wanted) {
  const panel = wanted && panelTold(known.id, known.mask_version);
  return h("div.view", {},
    picture(`/panels/${encodeURIComponent(known.id)}/map.jpg?width=320`, t("load.wood", {panel: known.id}), {version: known.mask_version}),
    panel && svg("svg.tags", {viewBox: `0 0 ${panel.width_mm} ${panel.height_mm}`, preserveAspectRatio: "none", role: "img", "aria-label": t("load.tags_of", {panel: known.id}), "data-show": known.id}, ...marksUp(panel, "show")));
}

// How well the panel was found that is being cut; the status tells it only before.
function fitUnderWay(panel) {
  const {job} = model.cell, told = job && jobTold(job.id, `${panel} ${model.cell.state} ${job.cut > 0}`);
  const run = told && told.runs.find((one) => one.panel === panel && !one.ended);
  return run && run.pose_rms_mm;
}

function loadCard() {
  const {load} = model.cell;
  const panel = load ? load.panel : panelOnBed();
  const known = panel && panelOf(panel);
  const rows = [];
  if (load) {
    if (load.how) rows.push(fact(t("load.how"), cellSays(load.how)));
    if (load.setups > 1) rows.push(fact(t("load.setup"), t("load.setups", {n: load.setup, of: load.setups})));
    if (load.focus_mm > 0) rows.push(fact(t("load.focus"), t("load.focus_mm", {mm: load.focus_mm.toFixed(1)})));
    if (load.estimate_s > 0) rows.push(fact(t("load.takes"), t("load.about", {span: span(load.estimate_s)})));
    if (load.found) rows.push(fact(t("load.fit"), `${load.rms_mm.toFixed(3)} mm`));
  } else if (panel) {
    const fit = fitUnderWay(panel);
    if (typeof fit === "number") rows.push(fact(t("load.fit"), `${fit.toFixed(3)} mm`));
  }
  return h("section.card", {"aria-label": t("load"), "data-card": "load"}, h("h2", {}, t("load")), h("div.load", {},
    known && (load && load.face_up === "back" ? backView(known) : showView(known, Boolean(load))),
    h("div", {},
      h("p.big", {}, load ? t(load.found ? "load.on" : "load.lay", {panel}) : bedWords()),
      load && h("p", {}, t(load.face_up === "back" ? "load.back" : "load.show")),
      load && known && known.shelf && h("p", {}, `${t("panel.shelf")}: ${known.shelf}`),
      facts(...rows),
      load && h("p.fact", {}, `${load.found ? "✓" : "◆"} `, sightWords(load)))));
}

export const sightWords = (load) => cellSays(asSentence(load.sentence)) || asSentence(t(load.found ? "load.found" : "load.not_found"));

// ---- commands -------------------------------------------------------------------------------------------------------

let framePower = "0";  // %, as somebody typed it

const kStepCommand = {reset: "reset", start: "start", confirm: "unsuspend", unhold: "unhold", stop: "stop", clear: "clear"};

function commandsCard() {
  const {cell} = model;
  const step = kStepCommand[(cell.next_step || {}).step];
  const job = startable(), may = mayStart(job);
  const one = (name, key, more = {}) => button(t(`do.${key}`), () => give(name), {disabled: !mayCommand(name), next: step === name && mayCommand(name), "data-command": name, ...more});
  return card(t("commands"), viewerHint(), h("div.commands", {},
    button(job ? t("do.start_job", {n: job.id, name: job.name}) : t("do.start"), () => start(job.id), {wide: true, id: "do-start", disabled: !may, next: step === "start" && may}),
    frame(cell), checkList(),
    one("unsuspend", "unsuspend", {wide: true, small: t("do.unsuspend.small")}),
    one("hold", "hold"), one("unhold", "unhold"),
    one("stop-after-piece", "after", {wide: true}),
    one("stop", "stop", {wide: true, small: t("do.stop.small")}),
    button(t("do.clear"), clearing(), {disabled: !mayClear(), next: step === "clear" && mayClear(), "data-command": "clear"}), one("reset", "reset")),
    !databaseSound() && h("p.hint", {}, cellSays(asSentence(cell.database.sentence))));
}

// Traced dark, or with so much power that it leaves a line: that is asked for like a cut.
function frame(cell) {
  if (cell.state !== "Suspended") return null;
  // Told and used alike: to a tenth.
  const rules = {least: 0, most: Math.floor(1000 * ((cell.load && cell.load.frame_max_power) || 0) + 1e-6) / 10};
  const bad = Boolean(faultOf(framePower, rules)), permille = bad ? 0 : Math.round(10 * numberOf(framePower));
  const ready = mayChange() && panelFound() && !bad;
  const label = permille <= 0 ? t("do.frame") : t(ready && !allConfirmed() ? "do.frame_first" : "do.frame_power", {percent: written(permille / 10)});
  return h("div.frame.wide", {"data-key": "frame"},
    // Answered when the frame is traced.
    button(label, () => command("/commands/frame", {timeoutMs: 120000, body: permille > 0 ? {power: permille / 1000, confirmed: confirmedNames()} : {}}),
      {disabled: !ready || (permille > 0 && !allConfirmed())}),
    numberField(t("frame.power"), framePower, (text) => { framePower = text; changed(); }, {...rules, id: "frame-power"}));
}

export function checkList() {
  const names = askedNames();
  if (!names.length) return null;
  return h("fieldset.confirm.wide", {"data-key": "confirm"}, h("legend", {}, t("confirm")),
    ...names.map((name) => h("label", {"data-key": name},
      h("input", {type: "checkbox", value: name, checked: isConfirmed(name), disabled: !operates(), onchange: (event) => confirmName(name, event.target.checked)}), asSentence(name).replace(/\.$/, ""))));
}

// ---- jobs -----------------------------------------------------------------------------------------------------------

function jobCard() {
  const {cell} = model;
  const {job} = cell;
  if (!job) return card(t("job"), empty(t("job.none")));
  return card(t("job"), h("p.big", {}, job.name),
    bar(job.pieces ? job.cut / job.pieces : 0, {suspect: job.pieces ? job.suspect / job.pieces : 0, label: t("job.progress", {cut: job.cut, n: job.pieces})}),
    h("p", {id: "job-count"}, t("job.progress", {cut: job.cut, n: job.pieces}) + (job.suspect ? `, ▲ ${t("job.suspect", {n: job.suspect})}` : "")),
    h("p.dim", {}, nowWords(job)),
    jobMap(job.id), jobKey());
}

let moved = null;  // the job that was given another place, by which button, and where it stood
let said = "";     // of the newest move, to those who hear the page

// A row that is put elsewhere loses the focus, and so does a button that is shut by being pressed: the job keeps it.
function focusMoved(place) {
  const job = moved && model.jobs.find(({id}) => id === moved.id);
  if (!job || job.queue_place === moved.from) return;
  const [same, other] = [moved.way, moved.way === "earlier" ? "later" : "earlier"].map((way) => place.querySelector(`#${way}-${moved.id}`));
  if ([document.body, same, null].includes(document.activeElement)) (same && !same.disabled ? same : other || same)?.focus();
  moved = null;
}

async function move(job, way, before) {
  const asked = moved = {id: job.id, way, from: job.queue_place};
  const done = await command(`/jobs/${job.id}/move`, {body: before ? {before: before.id} : {}});
  const place = done ? done.jobs.indexOf(job.id) + 1 : 0;
  if (done) said = t("jobs.moved", {n: job.id, place, all: done.jobs.length});
  if ((!done || place === asked.from) && moved === asked) moved = null;
  loadJobs();
}

// Which of the jobs that wait is cut next, and which after it.
function places(job) {
  const queue = inCuttingOrder(model.jobs).filter((one) => one.queue_place), at = queue.indexOf(job);
  if (at < 0 || queue.length < 2) return null;
  const one = (way, shut, before) => button(t(`jobs.${way}`), () => move(job, way, before), {id: `${way}-${job.id}`, "aria-label": t(`jobs.${way}_job`, {n: job.id, name: job.name}), disabled: shut || !mayChange()});
  return h("div.job-places", {}, one("earlier", at === 0, queue[at - 1]), one("later", at + 1 === queue.length, queue[at + 2]));
}

function jobsCard() {
  const chosen = startable();
  const inSight = inCuttingOrder(model.jobs.filter((job) => !job.archived));
  const done = inSight.filter((job) => !job.suspect && ["complete", "cancelled"].includes(job.state)).length;
  return card(t("jobs"),
    !inSight.length && empty(t("jobs.none")),
    h("div.jobs", {role: "radiogroup", "aria-label": t("jobs")}, ...inSight.map((job) => h("div.job-row", {"data-key": `job-${job.id}`},
      h("label", {"data-key": job.id},
        h("input", {type: "radio", name: "job", disabled: isOver(job), checked: Boolean(chosen) && chosen.id === job.id, onchange: () => choose(job.id)}),
        picture(`/jobs/${job.id}/preview.png?width=120`, "", {version: job.newest_plan, whenSeen: true}),
        h("span", {}, h("b", {}, job.name), h("span", {}, jobWords(job)))),
      places(job)))),
    h("p.unseen", {role: "status", id: "queue-said"}, said),
    done > 0 && h("div.commands", {}, button(t("jobs.archive", {n: done}), async () => { await command("/jobs/archive-done"); loadJobs(); }, {wide: true, disabled: !mayChange()})));
}
