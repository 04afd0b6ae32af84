// Long work that a screen begins: waited for, told while it goes on, and what it failed at. It goes on in the cell
// when the screen is left, and is there again when one comes back.
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {get, headersOf, pause, untilStop} from "./link.js";
import {changed, model} from "./model.js";
import {command, showRefusal} from "./commands.js";
import {bar, cellSays} from "./parts.js";

const kLookMs = 200;
const kAskMs = 2000;  // of the cell itself, when no event tells

// The task once it is over.
export async function over(id) {
  for (let asked = performance.now(); ; await pause(kLookMs)) {
    const task = model.tasks.get(id);
    if (task && task.state !== "running" && (task.state !== "done" || "result" in task)) return task;
    if (performance.now() - asked < kAskMs) continue;
    asked = performance.now();
    try { model.tasks.set(id, await get(`/tasks/${id}`)); } catch (fault) { if (fault.answered) return {state: "failed", error: {message: fault.message}}; }
  }
}

// One thing at a time for each place of a screen that begins work: {task, text, fault, own, result}.
const places = new Map();
export const workAt = (place) => places.get(place) || {};
export const isBusy = (place) => Boolean(workAt(place).busy);
const note = (place, what) => { places.set(place, {...workAt(place), ...what}); changed(); };
export const forgetWork = (place) => { places.delete(place); changed(); };

// By the cell, unless it is in the page's own words.
export class Refused extends Error {
  constructor(sentence, {own = false} = {}) {
    super(sentence);
    this.own = own;
  }
}

// A request that begins a task; throws when it is refused, or when the task fails. What it was done for.
export async function run(place, path, body, timeoutMs = 20000) {
  const begun = await command(path, {body, timeoutMs});
  if (!begun) throw new Refused("");  // said already
  if (!begun.task) return begun;
  note(place, {task: begun.task});
  const task = await over(begun.task);
  if (task.state !== "done") throw task.error ? new Refused(task.error.message) : new Refused(t("work.failed"), {own: true});
  return task.result;
}

// Steps one after another, each {text, act}; the first that fails ends them, and is told.
export async function doSteps(place, steps) {
  if (isBusy(place)) return;
  note(place, {busy: true, task: 0, fault: "", result: null});
  try {
    for (const [n, {text, act}] of steps.entries()) {
      note(place, {text: steps.length > 1 ? `${n + 1} / ${steps.length}: ${text}` : text, task: 0});
      note(place, {result: await act()});
    }
  } catch (fault) {
    note(place, {fault: fault.message, own: Boolean(fault.own)});
  }
  note(place, {busy: false, task: 0, text: ""});
}

// What goes on there, or what went wrong.
export function workRow(place) {
  const {busy, text, task: id, fault, own} = workAt(place);
  if (fault) return h("p.fault", {role: "alert"}, "▲ ", own ? asSentence(fault) : cellSays(asSentence(fault)));
  if (!busy) return null;
  const task = model.tasks.get(id);
  const running = task && task.state === "running";
  return h("div.task", {role: "status"}, h("p", {}, text, running && task.text && [" – ", cellSays(task.text)]), bar(running ? task.progress || 0 : 0, {label: text}));
}

const kReadMs = 60000;  // by then the tab has it

// A file that needs this console's header: fetched, and opened as what it is.
export async function openFile(path) {
  const tab = window.open("", "_blank");
  try {
    const reply = await fetch(`/api/v1${path}`, {headers: headersOf({}), signal: untilStop()});
    if (!reply.ok) throw new Error(((await reply.json().catch(() => ({}))).error || {}).message || String(reply.status));
    const url = URL.createObjectURL(await reply.blob());
    tab.location = url;
    setTimeout(() => URL.revokeObjectURL(url), kReadMs);
  } catch (fault) {
    if (tab) tab.close();
    showRefusal(fault.message);
  }
}
