// The operator's page. It asks for the status every two seconds and listens to the event stream in between; when
// neither answers it says so. STOP is a plain POST and waits for neither.
"use strict";

const $ = (id) => document.getElementById(id);
const kPollMs = 2000;
const kStaleMs = 6000;
const kListsMs = 5000;  // between two looks at jobs and panels while pieces are being cut

let cell = null;        // the last GET /status
let statusAt = 0;       // when it came, in ms of performance.now()
let role = "viewer";
let jobs = [];
let panels = [];
let chosenJob = 0;      // what Start starts; 0 = the one under way, else the newest
let listsAt = 0;

// ---- speaking with the daemon ----------------------------------------------------------------------------------

async function ask(method, path, timeoutMs = 5000, body = null) {
  const giveUp = new AbortController();
  const timer = setTimeout(() => giveUp.abort(), timeoutMs);
  try {
    const asked = {method, signal: giveUp.signal, cache: "no-store"};
    if (body) Object.assign(asked, {body: JSON.stringify(body), headers: {"Content-Type": "application/json"}});
    const reply = await fetch(path, asked);
    const told = await reply.json().catch(() => ({}));
    if (reply.ok) return told;
    const sentence = told.error && told.error.message ? told.error.message : `the cell answered ${reply.status}`;
    throw Object.assign(new Error(sentence), {answered: true});
  } catch (fault) {
    if (fault.answered) throw fault;
    throw new Error("The cell does not answer. Is veneerd running?");
  } finally {
    clearTimeout(timer);
  }
}

async function poll() {
  try {
    takeStatus(await ask("GET", "/api/v1/status"));
    const session = await ask("GET", "/api/v1/session");
    if (session.role !== role) { role = session.role; show(); }
  } catch (fault) {
    // The age of the data tells.
  }
  setTimeout(poll, kPollMs);
}

function listen() {
  const socket = new WebSocket(`ws://${location.host}` + "/api/v1/events");
  socket.onopen = () => { loadJobs(); loadPanels(); showBed(); };
  socket.onmessage = (message) => {
    let event;
    try { event = JSON.parse(message.data); } catch (fault) { return; }
    if (event.type === "status" && event.status) takeStatus(event.status);
    if (event.type === "task" && event.task) takeTask(event.task);
    if (event.type === "job") loadJobs();
    if (event.type === "panel") loadPanels();
    if (event.type === "bed") showBed();
  };
  socket.onclose = () => setTimeout(listen, kPollMs);
}

// ---- STOP -------------------------------------------------------------------------------------------------------

function clockTime() { return new Date().toLocaleTimeString("en-GB"); }

function noteStop(text, bad) {
  $("stop-note").textContent = text;
  $("stop-note").classList.toggle("dead", bad);
  $("stop-note").hidden = false;
}

async function stop(event) {
  event.preventDefault();
  noteStop(`STOP pressed at ${clockTime()}, not confirmed yet.`, true);
  for (let tries = 0; tries < 20; ++tries) {
    try {
      await ask("POST", "/api/v1/stop", 1000);
      noteStop(`STOP confirmed at ${clockTime()}: beam off, the cell is aborting.`, false);
      return;
    } catch (fault) {
      noteStop(`STOP is NOT confirmed (${fault.message}). Use the emergency stop on the machine.`, true);
      await new Promise((again) => setTimeout(again, 200));
    }
  }
}

// ---- commands ---------------------------------------------------------------------------------------------------

// Was it taken? A refusal is shown.
async function command(path, body = null, timeoutMs = 20000) {
  $("refusal").hidden = true;
  let taken = true;
  try {
    await ask("POST", path, timeoutMs, body);
  } catch (fault) {
    taken = false;
    $("refusal").textContent = fault.message;
    $("refusal").hidden = false;
  }
  try { takeStatus(await ask("GET", "/api/v1/status")); } catch (fault) { /* the age of the data tells */ }
  return taken;
}

const kAllowed = {
  "hold": ["Execute"],
  "unhold": ["Held"],
  "unsuspend": ["Suspended"],
  "stop": ["Suspended", "Held"],
  "stop-after-piece": ["Execute", "Holding", "Held", "Unholding"],
  "clear": ["Aborted"],
  "reset": ["Stopped", "Complete"],
};

// What the operator is expected to do, and in which words.
function nextStep() {
  const load = cell.load;
  switch (cell.state) {
    case "Stopped": return ["reset", "Reset homes the laser: hands off the machine."];
    case "Complete": return ["reset", "The job is done: take the pieces out, then Reset."];
    case "Idle": return startable() ? ["start", "Start asks for the panel first. Nothing moves before you say go on."] : ["", ""];
    case "Suspended":
      if (!load || !load.found) return ["", "Load the panel. Its tags are looked for as soon as it lies there."];
      if (cell.framing) return ["", "The frame is being traced: the head moves. STOP ends it."];
      if (!allConfirmed()) return ["", "Tick what you have seen to; the laser does not begin before."];
      return ["unsuspend", "Is it flat, clamped, and nothing in the way? Then go on: the laser will move."];
    case "Held": return ["unhold", "Unhold goes on exactly where it stopped."];
    case "Aborted": return ["clear", "When the cause is gone: Clear, then Reset, then Start for the remaining pieces."];
    default: return ["", ""];
  }
}

const kOver = ["complete", "completed", "done", "cancelled", "ended"];
const isOver = (job) => kOver.includes(String(job.state).toLowerCase());

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
    button.disabled = !operator || !allowed;
    button.classList.toggle("next", operator && allowed && name === next);
  }
  const job = startable();
  const start = $("do-start");
  start.textContent = job ? `Start “${job.name}”` : "Start";
  start.disabled = !operator || cell.state !== "Idle" || !job;
  start.classList.toggle("next", !start.disabled && next === "start");
  $("frame").hidden = cell.state !== "Suspended";
  $("do-frame").disabled = !operator || !found;
  const percent = framePercent();
  $("do-frame").textContent = percent > 0 ? `Trace the frame at ${percent} % power` : "Trace the frame, dark";
  if (cell.load && cell.load.frame_max_power) $("frame-percent").max = 100 * cell.load.frame_max_power;
  $("hint").textContent = operator ? hint
      : "You may look, and press STOP. To operate from this browser, run “veneerctl console” on the cell's machine and open the link it prints.";
}

// ---- before the beam comes on ------------------------------------------------------------------------------------

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

// ---- showing ----------------------------------------------------------------------------------------------------

function takeStatus(fresh) {
  const before = cell;
  cell = fresh;
  statusAt = performance.now();
  const jobBefore = before && before.job ? `${before.job.id} ${before.job.cut} ${before.job.suspect}` : "";
  const jobNow = cell.job ? `${cell.job.id} ${cell.job.cut} ${cell.job.suspect}` : "";
  const turned = !before || before.state !== cell.state;
  if (turned || before.panels !== cell.panels) loadPanels();
  if (turned) loadJobs();
  if (jobBefore !== jobNow) {
    loadPieces();
    if (!turned && performance.now() - listsAt > kListsMs) { loadJobs(); loadPanels(); }
  }
  show();
}

function takeTask(task) {
  if (!cell) return;
  cell.tasks = (cell.tasks || []).filter((known) => known.id !== task.id);
  if (task.state === "running") cell.tasks.push(task);
  if (task.state === "failed" && task.error) {
    $("refusal").textContent = task.error.message;
    $("refusal").hidden = false;
  }
  showTasks();
}

function show() {
  if (!cell) return;
  showState();
  showLoad();
  showToolpath();
  showConfirm();
  showJob();
  showRecut();
  showSuspects();
  showTasks();
  showFacts();
  showCommands();
  drawMap();
}

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
  $("state-reason").textContent = cell.reason || reasonOf();
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
  if (!job) return;
  const share = (count) => `${job.pieces > 0 ? (100 * count) / job.pieces : 0}%`;
  $("job-cut").style.width = share(job.cut);
  $("job-suspect").style.width = share(job.suspect);
  const suspect = job.suspect > 0 ? `, ▲ ${job.suspect} suspect: look at them before use` : "";
  $("job-count").textContent = `${job.cut} of ${job.pieces} pieces cut${suspect}`;
  const now = [];
  if (job.current_piece) now.push(`piece ${job.current_piece}`);
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

function showFacts() {
  const laser = cell.laser || {};
  const facts = [];
  const words = [laser.state, laser.connected && laser.homed === false ? "not homed" : ""].filter(Boolean).join(", ");
  facts.push(laser.connected ? fact("Laser", words || "connected", false) : fact("Laser", "does not answer: power? cable?", true));
  if (laser.connected) facts.push(fact("Beam", laser.beam_on ? "ON" : "off", Boolean(laser.beam_on) && cell.state !== "Execute"));
  facts.push(fact("Lid", cell.lid || "unknown", cell.lid !== "closed"));
  if (Array.isArray(laser.position_mm)) facts.push(fact("Head", laser.position_mm.map((v) => v.toFixed(1)).join(" / ") + " mm", false));
  const calibration = Object.entries(cell.calibration || {});
  const lacking = calibration.filter(([, state]) => state !== "valid");
  if (calibration.length && !lacking.length) facts.push(fact("Calibration", "valid", false));
  for (const [device, state] of lacking) facts.push(fact("Calibration", `${device}: ${state}`, true));
  if (laser.firmware) facts.push(fact("Firmware", laser.firmware, false));
  $("facts").replaceChildren(...facts);
}

// Only asks for a picture when it is another one, and shows it only once it is there.
function setPicture(image, path) {
  if (image.dataset.path === path) return;
  image.dataset.path = path;
  if (!path) { image.hidden = true; image.removeAttribute("src"); return; }
  image.onload = () => { image.hidden = false; };
  image.onerror = () => { image.hidden = true; };
  image.src = path;
}

// ---- panels and jobs --------------------------------------------------------------------------------------------

const squareCm = (mm2) => `${Math.round((mm2 || 0) / 100)} cm²`;

async function loadPanels() {
  listsAt = performance.now();
  try { panels = (await ask("GET", "/api/v1/panels")).panels || []; } catch (fault) { return; }
  showPanels();
}

function showPanels() {
  $("panel-count").textContent = panels.length ? `(${panels.length})` : "– none yet: lay one on the scanner and run “veneerctl panel scan”";
  $("panels").replaceChildren(...panels.map((panel) => {
    const card = document.createElement("div");
    card.className = "panel" + (cell && cell.load && cell.load.panel === panel.id ? " wanted" : "");
    card.dataset.panel = panel.id;
    const image = document.createElement("img");
    image.alt = `Free, reserved and cut wood of ${panel.id}`;
    image.src = `/api/v1/panels/${encodeURIComponent(panel.id)}/stock.png?width=640&at=${Date.now()}`;
    const name = document.createElement("b");
    name.textContent = panel.name && panel.name !== panel.id ? `${panel.id} ${panel.name}` : panel.id;
    const size = document.createElement("div");
    size.textContent = `${Math.round(panel.width_mm)} × ${Math.round(panel.height_mm)} mm` + (panel.parent ? `, remnant of ${panel.parent}` : "");
    const wood = document.createElement("div");
    wood.className = "dim";
    wood.textContent = `${squareCm(panel.free_mm2)} free, ${squareCm(panel.reserved_mm2)} reserved`;
    card.append(image, name, size, wood);
    return card;
  }));
}

async function loadJobs() {
  try { jobs = (await ask("GET", "/api/v1/jobs")).jobs || []; } catch (fault) { return; }
  showJobs();
  if (cell) showCommands();
}

function showJobs() {
  if (!jobs.length) {
    $("jobs").textContent = "None yet: “veneerctl job new PICTURE” plans one.";
    return;
  }
  const chosen = startable();
  $("jobs").replaceChildren(...jobs.slice().reverse().map((job) => {
    const row = document.createElement("label");
    const radio = document.createElement("input");
    radio.type = "radio";
    radio.name = "job";
    radio.disabled = isOver(job);
    radio.checked = Boolean(chosen) && chosen.id === job.id;
    radio.onchange = () => { chosenJob = job.id; if (cell) showCommands(); };
    const image = document.createElement("img");
    image.alt = "";
    image.src = `/api/v1/jobs/${job.id}/preview.png?width=120`;
    const words = document.createElement("span");
    const name = document.createElement("b");
    name.textContent = job.name;
    words.append(name, `job ${job.id}, ${job.state}, ${job.cut} of ${job.pieces} cut` + (job.suspect ? `, ▲ ${job.suspect} suspect` : ""));
    row.append(radio, image, words);
    return row;
  }));
}

// ---- the picture that fills up ----------------------------------------------------------------------------------

const map = {job: 0, pieces: [], preview: null, box: null, loading: false, again: false};

async function loadPieces() {
  const job = cell && cell.job;
  if (!job) return;
  if (map.loading) { map.again = true; return; }
  map.loading = true;
  try {
    if (map.job !== job.id) {
      map.preview = new Image();
      map.preview.onload = drawMap;
      map.preview.src = `/api/v1/jobs/${job.id}/preview.png?width=900`;
      map.job = job.id;
    }
    map.pieces = (await ask("GET", `/api/v1/jobs/${job.id}/pieces`)).pieces || [];
    map.box = boxOf(map.pieces);
    show();
  } catch (fault) {
    // Tried again with the next piece.
  }
  map.loading = false;
  if (map.again) { map.again = false; setTimeout(loadPieces, 1000); }
}

function boxOf(pieces) {
  const box = {left: Infinity, right: -Infinity, low: Infinity, high: -Infinity};
  for (const piece of pieces) {
    for (const [x, y] of piece.artwork_outline_mm || []) {
      box.left = Math.min(box.left, x); box.right = Math.max(box.right, x);
      box.low = Math.min(box.low, y); box.high = Math.max(box.high, y);
    }
  }
  return box.right > box.left && box.high > box.low ? box : null;
}

function tracePiece(pen, piece, scale, box) {
  pen.beginPath();
  for (const [x, y] of piece.artwork_outline_mm || []) pen.lineTo((x - box.left) * scale, (box.high - y) * scale);
  pen.closePath();
}

function hatch(pen) {
  const tile = document.createElement("canvas");
  tile.width = tile.height = 10;
  const ink = tile.getContext("2d");
  ink.fillStyle = "#e69f00";
  ink.fillRect(0, 0, 10, 10);
  ink.strokeStyle = "#15181a";
  ink.lineWidth = 3;
  ink.beginPath();
  for (const start of [-10, 0, 10]) { ink.moveTo(start, 10); ink.lineTo(start + 10, 0); }
  ink.stroke();
  return pen.createPattern(tile, "repeat");
}

// The plan's preview; what is not cut yet is veiled.
function drawMap() {
  const job = cell && cell.job;
  const there = Boolean(job && map.job === job.id && map.box);
  $("job-map").hidden = $("job-key").hidden = !there;
  if (!there) return;
  const canvas = $("job-map");
  const scale = 900 / (map.box.right - map.box.left);
  canvas.width = 900;
  canvas.height = Math.round((map.box.high - map.box.low) * scale);
  const pen = canvas.getContext("2d");
  if (map.preview && map.preview.complete && map.preview.naturalWidth > 0) pen.drawImage(map.preview, 0, 0, canvas.width, canvas.height);
  const suspect = hatch(pen);
  let now = null;
  for (const piece of map.pieces) {
    if (piece.mark === job.current_piece) now = piece;
    if (piece.state === "cut") continue;
    tracePiece(pen, piece, scale, map.box);
    pen.fillStyle = piece.state === "suspect" ? suspect : "rgba(216, 218, 219, 0.78)";
    pen.fill();
    pen.strokeStyle = "rgba(90, 96, 100, 0.5)";
    pen.lineWidth = 1;
    pen.stroke();
  }
  if (!now) return;
  tracePiece(pen, now, scale, map.box);
  pen.strokeStyle = "#15181a";
  pen.lineWidth = 6;
  pen.stroke();
}

// ---- the age of it all ------------------------------------------------------------------------------------------

function ago(ms) { return ms < 1500 ? "now" : `${minutes(ms / 1000)} ago`; }

function tick() {
  const age = performance.now() - statusAt;
  const dead = !cell || age > kStaleMs;
  document.body.classList.toggle("not-live", dead);
  // Nobody operates on what may be no longer true; STOP is not among these.
  if (dead) for (const button of document.querySelectorAll("main button")) button.disabled = true;
  $("live").classList.toggle("off", dead);
  $("live").textContent = !cell ? "connecting" : dead ? "▲ SCREEN NOT LIVE" : `live, data ${age < 1500 ? "now" : `${(age / 1000).toFixed(0)} s old`}`;
  $("dead").hidden = !dead || performance.now() < kStaleMs;
  $("dead").textContent = cell
      ? `This screen is not live: what it shows is ${minutes(age / 1000)} old. STOP is still tried when pressed; the emergency stop on the machine always works.`
      : "This screen has heard nothing from the cell yet. STOP is still tried when pressed.";
  $("bed-age").textContent = bedAt ? ago(performance.now() - bedAt) : "";
}

$("stop").addEventListener("submit", stop);
$("do-start").addEventListener("click", () => { const job = startable(); if (job) command(`/api/v1/jobs/${job.id}/start`); });
for (const button of document.querySelectorAll("[data-command]")) {
  const name = button.dataset.command;
  const body = () => (name === "unsuspend" ? {confirmed: confirmedNames()} : null);
  button.addEventListener("click", () => command(`/api/v1/commands/${name}`, body()));
}
// Answered when the frame is traced.
$("do-frame").addEventListener("click", () => command("/api/v1/commands/frame", {power: framePercent() / 100}, 120000));
$("frame-percent").addEventListener("input", () => { if (cell) showCommands(); });
$("do-recut").addEventListener("click", recutChosen);
poll();
listen();
loadJobs();
showBed();
setInterval(tick, 500);
