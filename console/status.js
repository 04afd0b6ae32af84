// The status in words and marks: state, load, job, tasks, machine.
"use strict";

// Marks and classes besides the words: shape as well as colour.
const kLooks = {
  Execute: ["▶", ""], Idle: ["●", ""], Complete: ["✓", "attention"], Stopped: ["■", ""],
  Held: ["❚❚", "attention"], Suspended: ["◆", "attention"], Aborted: ["✖", "alarm"], Aborting: ["✖", "alarm"],
};

// For states that come without a reason of their own.
function reasonOf() {
  const what = cell.job ? cell.job.name : "the job";
  switch (cell.state) {
    case "Execute": return `Cutting ${what}.`;
    case "Suspended": return cell.load && cell.load.found ? "The panel is found. The cell waits for your word." : "The cell waits for a panel on the bed.";
    case "Idle": return "Ready for a job.";
    case "Stopped": return "At rest. Reset makes the cell ready.";
    case "Held": return `${what} is paused, its position kept.`;
    case "Complete": return `${what} is done.`;
    default: return "";
  }
}

const asSentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) + (/[.!?)]$/.test(text) ? "" : ".") : "");

function showState() {
  const [mark, look] = kLooks[cell.state] || ["…", ""];
  $("state").className = "state " + look;
  $("state-mark").textContent = mark;
  $("state-word").textContent = cell.state;
  $("state-reason").textContent = asSentence(cell.reason) || reasonOf();
  document.title = `${cell.state} – cell`;
  $("role").textContent = role === "viewer" ? "view only" : `you operate (${role})`;
}

function showLoad() {
  const load = cell.load;
  setPicture($("load-picture"), load ? `/api/v1/panels/${encodeURIComponent(load.panel)}/map.png?width=400` : "");
  $("load-panel").textContent = !load ? "Nothing to load" : load.found ? `Panel ${load.panel} is on the bed` : `Load panel ${load.panel}`;
  $("load-how").textContent = !load ? ""
      : load.face_up === "back" ? "Face down: the veneer looks at the bed, the plain back with its tags looks up at you."
                                : "Face up: the veneer looks up at you.";
  const facts = [];
  if (load && load.how) facts.push(fact("Lay it", load.how, false));
  if (load && load.setups > 1) facts.push(fact("Set-up", `${load.setup} of ${load.setups}: the panel is larger than the bed`, false));
  if (load && load.focus_mm > 0) facts.push(fact("Focus", `${load.focus_mm.toFixed(1)} mm above the bed`, false));
  if (load && load.estimate_s > 0) facts.push(fact("Takes", `about ${minutes(load.estimate_s)}`, false));
  $("load-facts").replaceChildren(...facts);
  const mark = load && load.found ? "✓ " : "◆ ";
  $("load-found").textContent = !load ? "" : mark + asSentence(load.sentence || (load.found ? "found" : "not found yet"));
  for (const card of $("panels").children) card.classList.toggle("wanted", Boolean(load) && card.dataset.panel === load.panel);
}

function minutes(seconds) {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`;
}

function showJob() {
  const job = cell.job;
  $("job-bar").hidden = !job;
  $("job-name").textContent = job ? job.name : "No job under way";
  $("job-count").textContent = "";
  $("job-now").textContent = "";
  $("job-next").textContent = asSentence(cell.next || "");
  if (!job) return;
  const share = (count) => `${job.pieces > 0 ? (100 * count) / job.pieces : 0}%`;
  $("job-cut").style.width = share(job.cut);
  $("job-suspect").style.width = share(job.suspect);
  const suspect = job.suspect > 0 ? `, ▲ ${job.suspect} suspect: look at them before use` : "";
  $("job-count").textContent = `${job.cut} of ${job.pieces} pieces cut${suspect}`;
  const now = [];
  if (job.now) now.push(job.now);
  if (typeof job.eta_s === "number") now.push(`about ${minutes(job.eta_s)} left`);
  $("job-now").textContent = now.join(", ");
}

function bar(share) {
  const outer = document.createElement("div");
  outer.className = "bar";
  const inner = document.createElement("div");
  inner.style.width = `${Math.round(100 * share)}%`;
  outer.append(inner);
  return outer;
}

function showTasks() {
  const running = (cell.tasks || []).filter((task) => task.state === "running");
  $("tasks-card").hidden = running.length === 0;
  $("tasks").replaceChildren(...running.map((task) => {
    const item = document.createElement("li");
    item.append(`${task.kind}: ${task.text || "…"}`, bar(task.progress || 0));
    return item;
  }));
}

function fact(label, text, bad) {
  const item = document.createElement("li");
  if (bad) item.className = "bad";
  const mark = document.createElement("span");
  mark.textContent = bad ? "▲" : "";
  const name = document.createElement("span");
  name.className = "label";
  name.textContent = label;
  const value = document.createElement("span");
  value.textContent = text;
  item.append(mark, name, value);
  return item;
}

// What stands at the laser's port when it is no laser.
const kControllers = {twin: "the simulated cell", file: "records to a file, no laser", test: "a test controller, no laser"};

function showFacts() {
  const laser = cell.laser || {};
  const facts = [];
  const words = [laser.state, laser.connected && laser.homed === false ? "not homed" : ""].filter(Boolean).join(", ");
  facts.push(laser.connected ? fact("Laser", words || "connected", false) : fact("Laser", laser.why_not_connected || "not connected yet: Reset connects it", Boolean(laser.why_not_connected)));
  if (laser.connected) facts.push(fact("Beam", laser.beam_on ? "ON" : "off", Boolean(laser.beam_on) && cell.state !== "Execute"));
  if (laser.refusal) facts.push(fact("No beam", laser.refusal, true));
  if (laser.controller && laser.controller !== "real") facts.push(fact("Controller", kControllers[laser.controller] || laser.controller, false));
  facts.push(fact("Lid", cell.lid || "unknown", cell.lid === "open"));
  const turned = Object.entries(laser.overrides_wanted || {}).filter(([, percent]) => percent !== 100);
  if (turned.length) facts.push(fact("Overrides", turned.map(([what, percent]) => `${what} ${percent} %`).join(", "), true));
  if (Array.isArray(laser.position_mm)) facts.push(fact("Head", laser.position_mm.map((v) => v.toFixed(1)).join(" / ") + " mm", false));
  const calibration = Object.entries(cell.calibration || {});
  const lacking = calibration.filter(([, state]) => state !== "valid");
  if (calibration.length && !lacking.length) facts.push(fact("Calibration", "valid", false));
  for (const [device, state] of lacking) facts.push(fact("Calibration", `${device}: ${state.replaceAll("_", " ")}`, true));
  const database = cell.database || {};
  if (database.state && database.state !== "good") facts.push(fact("Database", asSentence(database.sentence || database.state), database.state === "damaged"));
  if (laser.firmware) facts.push(fact("Firmware", laser.firmware, false));
  $("facts").replaceChildren(...facts);
}

// Only asks for a picture when it is another one, and shows it only once it is there.
async function setPicture(image, path) {
  if (image.dataset.path === path) return;
  image.dataset.path = path;
  image.hidden = true;
  const url = path ? await pictureUrl(path) : "";
  if (image.dataset.path !== path) return;  // another one was wanted meanwhile
  if (url) putPicture(image, url);
  image.hidden = !url;
  if (path && !url) setTimeout(() => { if (image.dataset.path === path) image.dataset.path = ""; }, 5000);
}
