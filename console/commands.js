// What the operator may do now, what is expected next, and what is asked before the beam comes on.
"use strict";

function showRefusal(sentence) {
  $("refusal").textContent = asSentence(sentence);
  $("refusal").hidden = false;
}

// Was it taken? A refusal is shown.
async function command(path, body = null, timeoutMs = 20000, method = "POST") {
  $("refusal").hidden = true;
  let taken = true;
  try {
    await ask(method, path, timeoutMs, body);
  } catch (fault) {
    taken = false;
    showRefusal(fault.message);
  }
  try { takeStatus(await ask("GET", "/api/v1/status")); } catch (fault) { /* the age of the data tells */ }
  return taken;
}

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
const databaseSound = () => !cell.database || cell.database.state === "good";

// What the operator is expected to do, and in which words.
function nextStep() {
  const load = cell.load;
  if (!databaseSound()) return ["", asSentence(cell.database.sentence)];
  switch (cell.state) {
    case "Stopped": return ["reset", "Reset homes the laser: hands off the machine."];
    case "Complete": return ["reset", cell.job ? "The job is done: take the pieces out, then Reset." : "Take out what is on the bed, then Reset."];
    case "Idle": return startable() ? ["start", "Start asks for the panel first. Nothing moves before you say go on."] : ["", ""];
    case "Suspended":
      if (!load || !load.found) return ["", "Load the panel. Its tags are looked for as soon as it lies there."];
      if (cell.framing) return ["", "The frame is being traced: the head moves. STOP ends it."];
      if (!allConfirmed()) return ["", "Tick what you have seen to; the laser does not begin before."];
      return ["unsuspend", "Is it flat, clamped, and nothing in the way? Then go on: the laser will move."];
    case "Held": return ["unhold", "Unhold looks whether the panel lies as it did, then goes on exactly where it stopped."];
    case "Aborted": return ["clear", "When the cause is gone: Clear, then Reset, then Start for the remaining pieces."];
    default: return ["", ""];
  }
}

const isOver = (job) => ["complete", "incomplete", "cancelled"].includes(job.state);

function startable() {
  const open = jobs.filter((job) => !isOver(job));
  const current = cell && cell.job ? cell.job.id : 0;
  return open.find((job) => job.id === chosenJob) || open.find((job) => job.id === current) || open[open.length - 1] || null;
}

function showCommands() {
  const operator = role !== "viewer";
  const [next, hint] = nextStep();
  const found = Boolean(cell.load && cell.load.found) && !cell.framing;
  for (const button of $("commands").querySelectorAll("[data-command]")) {
    const name = button.dataset.command;
    let allowed = kAllowed[name].includes(cell.state);
    if (name === "unsuspend" && !(found && allConfirmed())) allowed = false;
    if (kBegins.includes(name) && !databaseSound()) allowed = false;
    button.disabled = !operator || !allowed;
    button.classList.toggle("next", operator && allowed && name === next);
  }
  const job = startable();
  const start = $("do-start");
  start.textContent = job ? `Start “${job.name}”` : "Start";
  start.disabled = !operator || cell.state !== "Idle" || !job || !databaseSound();
  start.classList.toggle("next", !start.disabled && next === "start");
  for (const button of document.querySelectorAll("[data-changes]")) button.disabled = !operator || !databaseSound();
  $("frame").hidden = cell.state !== "Suspended";
  const percent = framePercent();
  $("do-frame").disabled = !operator || !found || !databaseSound() || (percent > 0 && !allConfirmed());
  const first = percent > 0 && found && !allConfirmed() ? ": first tick what is seen to" : "";
  $("do-frame").textContent = percent > 0 ? `Trace the frame at ${percent} % power${first}` : "Trace the frame, dark";
  if (cell.load && cell.load.frame_max_power) $("frame-percent").max = 100 * cell.load.frame_max_power;
  $("hint").textContent = operator ? hint
      : "You may look, and press STOP. To operate from this browser, run “veneerctl console” on the cell's machine and open the link it prints.";
}

// ---- before the beam comes on ---------------------------------------------------------------------------------------

const framePercent = () => Math.max(0, Number($("frame-percent").value) || 0);

// What is asked by name for what the operator may begin now.
const askedNames = () => (cell.state === "Suspended" || recutMarks.size ? cell.confirm || [] : []);

const confirmBoxes = () => [...$("confirm-names").querySelectorAll("input")];
const confirmedNames = () => confirmBoxes().filter((box) => box.checked).map((box) => box.value);
const allConfirmed = () => confirmedNames().length === askedNames().length;

// A tick is good for one beginning: another panel, set-up or state asks again.
function showConfirm() {
  const names = askedNames();
  const load = cell.load;
  const key = JSON.stringify([names, cell.state, load && load.panel, load && load.setup]);
  $("confirm").hidden = names.length === 0;
  if ($("confirm").dataset.key === key) return;
  $("confirm").dataset.key = key;
  $("confirm-names").replaceChildren(...names.map((name) => {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.value = name;
    box.onchange = show;
    label.append(box, asSentence(name).replace(/\.$/, ""));
    return label;
  }));
}
