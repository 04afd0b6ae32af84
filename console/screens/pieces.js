// What a person says of single pieces: not through, so cut again while the panel lies unmoved; what became of suspect
// ones; and which are lost, so that other wood is found for them.
import {h} from "../dom.js";
import {asSentence, dayTime, t} from "../words.js";
import {changed, databaseSound, isStale, loadJobs, mayChange, model, operates, piecesOf} from "../model.js";
import {allConfirmed, command, confirmedNames, recutMarks, sameThing} from "../commands.js";
import {button, card, link, tWith} from "../parts.js";
import {picture} from "../pictures.js";

export const kGone = ["scrap", "released", "unfilled"];
const canBeWhole = (job) => job.missing > 0 && !["cancelled", "running", "planned"].includes(job.state);

// Another picture when it is made again elsewhere.
const placeOf = (piece) => `${piece.panel} ${JSON.stringify((piece.panel_outline_mm || [])[0])}`;
export const woodOf = (piece) => picture(`/pieces/${piece.id}/picture.png?width=240`, t("wood_of", {mark: piece.mark}), {version: placeOf(piece), class: "wood"});

// Picture, mark with its passport, where it belongs, and what may be said of it.
const pieceRow = (job, piece, ...more) => h("li.piece", {"data-key": `${job.id}-${piece.mark}`},
  piece.panel ? woodOf(piece) : null,
  h("div", {}, piece.panel ? link(`#panels/${piece.panel}/${piece.id}`, piece.mark) : h("b", {}, piece.mark), h("div.dim", {}, `${job.name}, ${piece.panel || t("no_panel")}`)),
  ...more);

export const pieceCards = () => [recutCard(), suspectsCard(), missingCard(), lostCard()];

// ---- not through ----------------------------------------------------------------------------------------------------

// Of the panel that was cut last, whatever job the cell has to do with now.
function recutCard() {
  const {recut, state} = model.cell;
  const cut = recut ? piecesOf(recut.job).filter((piece) => piece.state === "cut" && piece.panel === recut.panel) : [];
  if (!cut.length || !["Suspended", "Complete", "Stopped", "Idle"].includes(state)) { recutMarks.clear(); return null; }
  const marks = [...recutMarks];
  return h("details.card", {"data-key": "recut"}, h("summary", {}, t("recut")), h("p.dim", {}, t("recut.about")),
    h("div.chips", {}, ...cut.map(({mark}) => h("label", {"data-key": mark},
      h("input", {type: "checkbox", checked: recutMarks.has(mark), onchange: (event) => { if (event.target.checked) recutMarks.add(mark); else recutMarks.delete(mark); changed(); }}), mark))),
    h("div.commands", {}, button(marks.length ? t("recut.do", {marks: marks.join(", ")}) : t("recut.choose"), async () => {
      if (await command(`/jobs/${recut.job}/recut`, {body: {pieces: marks, confirmed: confirmedNames()}})) recutMarks.clear();
      changed();
    }, {wide: true, disabled: !mayChange() || !marks.length || !allConfirmed()})));
}

// ---- suspect --------------------------------------------------------------------------------------------------------

function sighting({seen, gone_share, at}) {
  return t("seen", {day: dayTime(at), what: t(`seen.${seen}`, {share: `${Math.round(100 * gone_share)} %`})});
}

const kTakenMs = 5000;  // and by then the lists tell of what was said
const said = new Set();  // keys of pieces of which somebody has said it, while the lists do not tell yet
const list = sameThing();

const keyOf = ({job, piece}) => `${job.id}-${piece.mark}`;

// Whatever the cell does: what became of a piece can be said at any time.
function suspects() {
  const all = model.jobs.filter((job) => job.suspect > 0).flatMap((job) => piecesOf(job.id).filter((piece) => piece.state === "suspect").map((piece) => ({job, piece})));
  list.drawn(all.map(keyOf).join(" "));
  return all;
}

const mayBeSettled = (one) => operates() && !isStale() && !said.has(keyOf(one)) && list.isLooked();

async function settle(one, verdict) {
  const {job, piece} = one, key = keyOf(one);
  if (!mayBeSettled(one)) return;
  said.add(key);
  changed();
  const done = await command(`/jobs/${job.id}/pieces/${encodeURIComponent(piece.mark)}/settle`, {body: {verdict}});
  loadJobs();
  setTimeout(() => { said.delete(key); changed(); }, done ? kTakenMs : 0);
}

export const verdicts = (one) => h("span.choices", {}, ...["cut", "scrap", "released"].map((verdict) =>
  button(t(`verdict.${verdict}`), () => settle(one, verdict), {disabled: !mayBeSettled(one)})));

const suspectRow = (one) => pieceRow(one.job, one.piece, verdicts(one),
  one.piece.sighting && h("div.sighting", {}, sighting(one.piece.sighting)));

// One decision, for screens that are about something else: the next one comes when it is made.
export function oneSuspect() {
  const [one] = suspects();
  return one ? h("ul.list.decision", {}, suspectRow(one)) : null;
}

// What the last scan saw of many pieces, taken over at once: those that are out are cut; of those that lie in the panel
// no scan sees a kerf that was begun, so that somebody who has looked says that none is burnt.
function asSeenButton(all, seen, there) {
  const these = all.filter(({piece}) => piece.sighting && piece.sighting.seen === seen);
  if (these.length < 2) return null;
  const marks = these.map(({piece}) => piece.mark).join(", ");
  return button(t(`as_seen.${seen}`, {n: these.length}), () => {
    if (!these.every(mayBeSettled) || !confirm(t(`as_seen.${seen}.sure`, {marks}))) return;
    for (const job of new Set(these.map((one) => one.job.id))) settleAsSeen(job, these.filter((one) => one.job.id === job), there);
  }, {wide: true, disabled: !these.every(mayBeSettled), "data-seen": seen});
}

async function settleAsSeen(job, these, there) {
  const keys = these.map(keyOf);
  for (const key of keys) said.add(key);
  changed();
  const done = await command(`/jobs/${job}/settle-as-seen`, {body: {...(there && {there}), pieces: these.map(({piece}) => piece.mark)}});
  loadJobs();
  setTimeout(() => { for (const key of keys) said.delete(key); changed(); }, done ? kTakenMs : 0);
}

function suspectsCard() {
  const all = suspects();
  return all.length ? card(`▲ ${t("suspects")}`, h("p.dim", {}, t("suspects.about")),
    h("div.commands", {}, asSeenButton(all, "cut", ""), !all.some(({piece}) => piece.sighting && piece.sighting.seen === "cut") && asSeenButton(all, "still_there", "released")),
    h("ul.list", {}, ...all.map(suspectRow))) : null;
}

// ---- missing --------------------------------------------------------------------------------------------------------

const redoing = new Map();  // job by the task that looks for its wood
let redone = null;  // says what came of the last one, and of which job: () => nodes

// Other wood for these marks, or for all that are missing. `lost`: for one that was cut, which somebody says is lost.
export async function redo(job, marks, {lost: isLost = false} = {}) {
  const begun = await command(`/jobs/${job}/redo`, {body: marks ? {pieces: marks, ...(isLost && {lost: true})} : {}});
  if (begun) redoing.set(begun.task, job);
  changed();
}

// How much worse the picture gets is told before anything is cut.
function followRedoing() {
  for (const [id, job] of redoing) {
    const task = model.tasks.get(id);
    if (!task || task.state === "running") continue;
    redoing.delete(id);
    const {result, error} = task, of = () => `${t("job.number", {n: job})}: `;
    redone = null;  // whoever gave it up has no answer, and none of before
    if (error && task.state !== "cancelled") redone = () => ["▲ ", of(), tWith("redo.failed", "why", asSentence(error.message))];
    if (result && result.redone) {
      const change = 100 * (result.cost_per_pixel / result.cost_per_pixel_before - 1);
      redone = () => `${of()}${t("redone", {n: result.redone.length, marks: result.redone[0].mark})} ${t("redone.cost", {share: Math.abs(change).toFixed(2), where: t(change > 0 ? "redone.farther" : "redone.nearer")})}`;
    }
    loadJobs();
  }
}

export const cannotRedo = (job) => !mayChange() || [...redoing.values()].includes(job);

// What came of the last redo.
export function redoneNote() {
  followRedoing();
  return redone && h("p", {role: "status", "data-key": "redone"}, redone());
}

// It was called lost by mistake: somebody looks at it again.
async function takeBack(job, piece) {
  await command(`/jobs/${job.id}/pieces/${encodeURIComponent(piece.mark)}/settle`, {body: {verdict: "suspect"}});
  loadJobs();
}

function missingCard() {
  const note = redoneNote();
  const wanting = model.jobs.filter(canBeWhole);
  // Nothing is missing any more: what came of it is no warning.
  if (!wanting.length) return note && card(t("missing.found"), note);
  const rows = wanting.flatMap((job) => [
    h("li", {"data-key": `job-${job.id}`}, h("b", {}, job.name), h("span", {}, t("attention.missing", {n: job.missing})),
      job.missing > 1 && button(t("missing.all"), () => redo(job.id, null), {disabled: cannotRedo(job.id)})),
    ...piecesOf(job.id).filter((piece) => kGone.includes(piece.state)).map((piece) =>
      pieceRow(job, piece, button(t("missing.one"), () => redo(job.id, [piece.mark]), {disabled: cannotRedo(job.id)}),
        piece.state === "scrap" && button(t("missing.take_back"), () => takeBack(job, piece), {disabled: cannotRedo(job.id)}))),
  ]);
  return card(`▲ ${t("missing")}`, h("p.dim", {}, t("missing.about")), h("ul.list", {}, ...rows), note);
}

// ---- lost -----------------------------------------------------------------------------------------------------------

// A piece that was cut, and then fell into the exhaust or broke: redo takes it as lost.
let lost = {job: 0, mark: ""};

function lostCard() {
  const of = model.jobs.filter((job) => job.cut > 0 && !job.now).reverse();
  if (!of.length) return null;
  const job = of.find((one) => one.id === lost.job) || of[0];
  const open = lost.open ? piecesOf(job.id).filter((piece) => piece.state === "cut") : [];
  const piece = open.find((one) => one.mark === lost.mark);
  return h("details.card", {"data-key": "lost", ontoggle: (event) => { lost.open = event.target.open; changed(); }},
    h("summary", {}, t("lost")), h("p.dim", {}, t("lost.about")),
    h("div.choices", {},
      h("select", {"aria-label": t("lost.job"), value: String(job.id), onchange: (event) => { lost = {job: Number(event.target.value), mark: "", open: true}; changed(); }},
        ...of.map((one) => h("option", {value: one.id}, `${t("job.number", {n: one.id})}, ${one.name}`))),
      h("select", {"aria-label": t("lost.piece"), value: piece ? piece.mark : "", onchange: (event) => { lost = {...lost, job: job.id, mark: event.target.value}; changed(); }},
        h("option", {value: ""}, t("lost.choose")), ...open.map((one) => h("option", {value: one.mark}, one.mark))),
      piece ? woodOf(piece) : null,
      button(t("lost.do"), () => { if (confirm(t("lost.sure", {mark: piece.mark}))) redo(job.id, [piece.mark], {lost: true}); }, {id: "do-lost", disabled: !piece || cannotRedo(job.id) || !databaseSound()})));
}
