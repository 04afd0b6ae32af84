// What an operator may do now, and doing it: every change goes through here and says when it was refused.
import {asSentence, t} from "./words.js";
import {ask} from "./link.js";
import {askStatus, changed, databaseSound, followStatus, inCuttingOrder, isOver, isStale, mayChange, model, operates} from "./model.js";

import {cellSays} from "./parts.js";

const refusal = document.getElementById("refusal");

// What the cell says, unless it is said otherwise; or parts of a sentence (tWith), of which each says what it is.
export function showRefusal(sentence, spoken = "en") {
  refusal.lang = spoken;
  const own = spoken !== "en" || !sentence;
  refusal.replaceChildren(...(Array.isArray(sentence) ? sentence : own ? [sentence ? asSentence(sentence) : ""] : [cellSays(asSentence(sentence))].flat()));
  refusal.hidden = !sentence;
  if (sentence) refusal.scrollIntoView({block: "nearest"});
}

// The reply, or null when it was refused, which is shown then; or told, where it is shown elsewhere.
export async function command(path, {method = "POST", body = null, timeoutMs = 20000, refused = showRefusal} = {}) {
  showRefusal("");
  let reply = null;
  try { reply = await ask(method, `/api/v1${path}`, {body, timeoutMs}); } catch (fault) { refused(fault.message); }
  await askStatus();
  return reply;
}

// ---- the unit's commands --------------------------------------------------------------------------------------------

const kAllowed = {
  "hold": ["Unsuspending", "Execute", "Unholding", "Stopping"],
  "unhold": ["Held"],
  "unsuspend": ["Suspended"],
  "stop": ["Suspended", "Held"],
  "stop-after-piece": ["Execute", "Holding", "Held", "Unholding"],
  "clear": ["Aborted"],
  "reset": ["Stopped", "Complete"],
};
// What begins something, and so needs a database that can keep it.
const kBegins = ["unhold", "unsuspend", "clear", "reset"];

export const panelFound = () => Boolean(model.cell && model.cell.load && model.cell.load.found) && !model.cell.framing;

export function mayCommand(name) {
  const {cell} = model;
  if (!cell || !operates() || !kAllowed[name].includes(cell.state)) return false;
  if (name === "unsuspend" && !(panelFound() && allConfirmed())) return false;
  return databaseSound() || !kBegins.includes(name);
}

// Answered once the cell has looked, homed or come to rest, which takes its time.
const kDoneMs = 120000;
export const give = (name) => command(`/commands/${name}`, {timeoutMs: kDoneMs, body: name === "unsuspend" ? {confirmed: [...confirmed]} : null});

// ---- what a button is about ------------------------------------------------------------------------------------------

// Of what a button is about: when it is another thing than at the last drawing, nothing is taken for a while, since it
// may have come under a finger. `is()`: it is known already, as somebody has just chosen it.
const kLookMs = 1000;
export function sameThing() {
  let last, since = -Infinity;
  return {
    drawn(thing) {
      if (last !== undefined && thing !== last) since = performance.now();
      last = thing;
    },
    is(thing) { last = thing; since = -Infinity; },
    isLooked: () => performance.now() - since >= kLookMs,
  };
}

// A question stops the whole page, and what it is about may have become another thing meanwhile: the cell is asked
// again once it is answered. `isShown()`: it is still what stood there.
export async function isSure(words, isShown) {
  if (!isShown() || !confirm(words)) return false;
  await askStatus();
  return !isStale() && isShown();
}

// ---- what is in the way ---------------------------------------------------------------------------------------------

// The first of these links of the chain that blocks: {name, sentence, remedy}.
export function blockedBy(...names) {
  const chain = (model.cell && model.cell.interlocks) || [];
  return names.map((name) => chain.find((one) => one.name === name && one.state === "blocks")).find(Boolean) || null;
}

// ---- what stopped it -------------------------------------------------------------------------------------------------

// Clear is about what stopped the cell as it is told beside the button: where that becomes another thing, as when STOP
// follows a fault, nothing is taken until somebody can have read it.
const stopped = sameThing();
const whatStopped = () => (model.cell && model.cell.state === "Aborted" ? `Aborted ${model.cell.reason || ""}` : "");
followStatus(() => stopped.drawn(whatStopped()));
export const mayClear = () => mayCommand("clear") && stopped.isLooked() && !isStale();
// For a button that is drawn now.
export function clearing() {
  const shown = whatStopped();
  return () => (mayClear() && whatStopped() === shown ? give("clear") : null);
}

// ---- which job ------------------------------------------------------------------------------------------------------

let chosen = 0;  // what Start starts; 0 = the one under way, else the one that the next step leads to, else the first of the queue
const target = sameThing();
export function choose(job) { chosen = job; target.is(job); changed(); }
// A way led to it, which is not yet seen.
export function leadTo(job) { chosen = job; changed(); }

// As Start is drawn now.
export function startable() {
  const open = model.jobs.filter((job) => !isOver(job));
  const wanted = [chosen, model.cell && model.cell.job && model.cell.job.id, model.cell && model.cell.next_step && model.cell.next_step.job];
  return wanted.map((id) => open.find((job) => job.id === id)).find(Boolean) || inCuttingOrder(open).find((job) => job.queue_place) || open[0] || null;
}
// Another job than the one that the next step names, since somebody chose it here.
export function chosenInstead() {
  const next = model.cell && model.cell.next_step, job = next && next.job ? startable() : null;
  return job && job.id === chosen && job.id !== next.job ? job : null;
}
export function mayStart(job) {
  target.drawn(job ? job.id : 0);
  return mayChange() && model.cell.state === "Idle" && Boolean(job) && target.isLooked();
}
export const start = (job) => command(`/jobs/${job}/start`);

// ---- before the beam comes on ---------------------------------------------------------------------------------------

const confirmed = new Set();
let askedFor = "";
export const recutMarks = new Set();

// What is asked by name for what the operator may begin now. A tick is good for one beginning: another panel, set-up or
// state asks again.
export function askedNames() {
  const {cell} = model;
  const names = cell && (cell.state === "Suspended" || recutMarks.size) ? cell.confirm || [] : [];
  const key = JSON.stringify([names, cell && cell.state, cell && cell.load && [cell.load.panel, cell.load.setup]]);
  if (askedFor !== key) { askedFor = key; confirmed.clear(); }
  return names;
}
followStatus(askedNames);  // also while another screen is shown, or none
export const isConfirmed = (name) => confirmed.has(name);
export function confirmName(name, is) {
  if (is) confirmed.add(name); else confirmed.delete(name);
  changed();
}
export const confirmedNames = () => [...confirmed];
export const allConfirmed = () => askedNames().every((name) => confirmed.has(name));

export const kSteps = {  // where the step of `next_step` is done
  calibrate_scanner: "setup", calibrate_camera: "setup", calibrate_laser: "setup", calibrate_kerf: "setup",
  accept: "scan", scan: "scan", plan: "new", make_job: "new", reset: "run", start: "run", load: "run", confirm: "run", unhold: "run",
  clear: "run", settle: "run", redo: "run",
};
export const screenName = (screen) => t(`screen.${screen}`);
