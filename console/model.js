// What the page knows of the cell, and how old that is. Screens read it and are told when it changes.
import {ask, askAll, get, kAgainMs, kPollMs, listen} from "./link.js";
import {followStop} from "./stop.js";

export const model = {
  cell: null,     // the last GET /status
  cellAt: 0,      // when it came, in ms of performance.now()
  role: "",       // nobody, viewer, operator, maintainer, admin; "" until the cell has said
  session: {who: "", user: null, expires_at: null, accounts: false},  // the last GET /session
  jobs: [],       // in sight; with archived ones when `archived`
  archived: false,
  panels: [],     // all, retired ones too
  plans: [],      // newest first
  tasks: new Map(),   // by id, as they were told last
  pieces: new Map(),  // by job, of those that were asked for
  opened: 0,      // how often the stream of events was: with each life of the daemon once more
  bedLooks: 0,    // how often the bed was photographed since the page was opened
  bedAt: 0,       // when it was last, in ms of performance.now(); 0 = before that
};

const kStaleMs = 6000;
const kListsMs = 5000;  // between two looks at jobs and panels while pieces are being cut

const kRanks = ["nobody", "viewer", "operator", "maintainer", "admin"];
export const mayDo = (role) => kRanks.indexOf(model.role) >= kRanks.indexOf(role);
export const operates = () => mayDo("operator");
export const databaseSound = () => !model.cell || !model.cell.database || model.cell.database.state === "good";
export const mayChange = () => operates() && databaseSound() && !isStale();
export const isStale = () => !model.cell || performance.now() - model.cellAt > kStaleMs;
export const panelOf = (id) => model.panels.find((panel) => panel.id === id);
export const jobOf = (id) => model.jobs.find((job) => job.id === id);
// The one that is being cut, those that wait, as they stand in the queue, then all others, the newest first.
const kBehind = 1e9;
const placeOf = (job) => (job.state === "running" ? 0 : job.queue_place || kBehind);
export const inCuttingOrder = (jobs) => [...jobs].sort((a, b) => placeOf(a) - placeOf(b) || b.id - a.id);
export const isOver = (job) => ["complete", "incomplete", "cancelled"].includes(job.state);

// ---- who wants to know ----------------------------------------------------------------------------------------------

const followers = [];
let due = false;
export const follow = (told) => followers.push(told);
// At once with each status, none left out: a page that nobody sees is drawn by no browser.
const statusFollowers = [];
export const followStatus = (told) => statusFollowers.push(told);
// At once with each event of this type, and when the stream of events has begun anew and nobody knows what it was.
const eventFollowers = [];
export const followEvent = (type, told) => eventFollowers.push({type, told});
export function changed() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    for (const told of followers) told();
  });
}

// ---- what has come --------------------------------------------------------------------------------------------------

let listsAt = 0;

function takeStatus(fresh) {
  const before = model.cell;
  model.cell = fresh;
  model.cellAt = performance.now();
  followStop(fresh.state);
  for (const told of statusFollowers) told();
  for (const task of fresh.tasks || []) model.tasks.set(task.id, task);
  const count = (cell) => (cell && cell.job ? `${cell.job.id} ${cell.job.cut} ${cell.job.suspect}` : "");
  const turned = !before || before.state !== fresh.state;
  if (turned || before.panels !== fresh.panels) loadPanels();
  if (turned) loadJobs();
  if (count(before) !== count(fresh)) {
    if (fresh.job) renewPieces(fresh.job.id);
    if (!turned && performance.now() - listsAt > kListsMs) { loadJobs(); loadPanels(); }
  }
  changed();
}

// An event tells that a task is done; what came of it is asked for.
async function takeTask(told) {
  let task = told;
  try { if (told.state === "done") task = await get(`/tasks/${told.id}`); } catch (fault) { if (fault.status !== 404) setTimeout(() => takeTask(told), kAgainMs); }
  model.tasks.set(task.id, task);
  if (task.state !== "running") {
    if (model.cell) model.cell.tasks = (model.cell.tasks || []).filter((known) => known.id !== task.id);
    if (task.kind === "plan" || task.kind === "job") loadPlans();
  }
  changed();
}

function take(event) {
  for (const {type, told} of eventFollowers) if (type === event.type || event.type === "open") told();
  if (event.type === "open") { loadJobs(); loadPanels(); loadPlans(); ++model.opened; ++model.bedLooks; model.bedAt = 0; changed(); }
  if (event.type === "status" && event.status) takeStatus(event.status);
  if (event.type === "task" && event.task) takeTask(event.task);
  if (event.type === "job") { loadJobs(); loadPanels(); renewPieces(event.job); }  // it takes wood, or gives it back
  if (event.type === "panel") { loadPanels(); loadPlans(); for (const job of model.pieces.keys()) renewPieces(job); }
  if (event.type === "bed") { ++model.bedLooks; model.bedAt = event.missed ? 0 : performance.now(); changed(); }
}

// One look at a time; whoever asks meanwhile gets another one after it. What was not answered is asked again. Resolves
// once a look that began after the call was answered.
export function loader(load) {
  let underWay = false, waiting = [];
  async function look() {
    underWay = true;
    const told = waiting;
    waiting = [];
    let answered = true;
    try { await load(); changed(); } catch (fault) { answered = false; }
    underWay = false;
    if (answered) told.forEach((tell) => tell());
    else waiting.push(...told);
    if (answered ? waiting.length > 0 : waiting.length > told.length) look();
    else if (!answered && mayDo("viewer")) setTimeout(() => { if (!underWay) look(); }, kAgainMs);
  }
  return () => new Promise((tell) => {
    waiting.push(tell);
    if (!underWay) look();
  });
}

let countedLater = 0;
export const loadPanels = loader(async () => {
  listsAt = performance.now();
  model.panels = await askAll("/panels", "panels");
  // What is being counted is told by nobody when it is.
  clearTimeout(countedLater);
  if (model.panels.some((panel) => panel.mask === "uncounted")) countedLater = setTimeout(loadPanels, kAgainMs);
});
export const loadJobs = loader(async () => { model.jobs = await askAll(model.archived ? "/jobs?archived=true" : "/jobs", "jobs"); });
const kPlansAtOnce = 200;
let plansWanted = kPlansAtOnce;
export const loadPlans = loader(async () => { model.plans = await askAll("/plans", "plans", plansWanted); });
export const mayHaveMorePlans = () => model.plans.length >= plansWanted;
export function loadMorePlans(all) {
  plansWanted = all ? Infinity : plansWanted + kPlansAtOnce;
  return loadPlans();
}
// Each event asks for as many as are wanted: the newest again, and `kept` of them that are looked at.
export function fewerPlans(kept) {
  plansWanted = kPlansAtOnce * Math.ceil((kept + 1) / kPlansAtOnce);
  model.plans = model.plans.slice(0, plansWanted);
}

const pieceLoaders = new Map();
// Resolves as a loader does.
export async function renewPieces(job) {
  if (pieceLoaders.has(job)) await pieceLoaders.get(job)();
}
// The job's pieces as known; asked for with the first call, and kept up to date from then on.
export function piecesOf(job) {
  if (!pieceLoaders.has(job)) {
    pieceLoaders.set(job, loader(async () => { model.pieces.set(job, await askAll(`/jobs/${job}/pieces`, "pieces")); }));
    renewPieces(job);
  }
  return model.pieces.get(job) || [];
}

export async function askStatus() {
  try { takeStatus(await get("/status")); } catch (fault) { /* the age of the data tells */ }
}

// Whoever has not signed in on another machine is shown nothing but how to.
async function askSession() {
  try {
    const session = await ask("GET", "/api/v1/session");
    const before = model.role;
    model.session = session;
    model.role = session.role;
    if (session.role === "nobody") model.cell = null;
    if (before !== session.role) changed();
  } catch (fault) { /* as before */ }
}

let started = false;
async function poll() {
  if (mayDo("viewer")) {
    if (!started) { started = true; listen(take); loadJobs(); }
    await askStatus();
  }
  setTimeout(() => askSession().then(poll), kPollMs);
}

export async function begin() {
  await askSession();
  await poll();
}
