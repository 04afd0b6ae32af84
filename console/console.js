// The operator's page: what it knows of the cell, and how old that is. When nothing comes any more it says so.
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

// ---- what has come --------------------------------------------------------------------------------------------------

function takeStatus(fresh) {
  const before = cell;
  cell = fresh;
  statusAt = performance.now();
  const jobBefore = before && before.job ? `${before.job.id} ${before.job.cut} ${before.job.suspect}` : "";
  const jobNow = cell.job ? `${cell.job.id} ${cell.job.cut} ${cell.job.suspect}` : "";
  const turned = !before || before.state !== cell.state;
  if (turned || before.panels !== cell.panels) loadPanels();
  if (turned) loadJobs();
  forgetStop();
  if (jobBefore !== jobNow) {
    loadPieces();
    recountJobs();
    if (!turned && performance.now() - listsAt > kListsMs) { loadJobs(); loadPanels(); }
  }
  show();
}

function takeTask(task) {
  if (!cell) return;
  cell.tasks = (cell.tasks || []).filter((known) => known.id !== task.id);
  if (task.state === "running") cell.tasks.push(task);
  if (task.state === "failed" && task.error) {
    showRefusal(task.error.message);
  }
  noteRedone(task);
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
  showMissing();
  showLost();
  showTasks();
  showFacts();
  showCommands();
  drawMap();
}

// ---- the age of it all ----------------------------------------------------------------------------------------------

function ago(ms) { return ms < 1500 ? "now" : `${minutes(ms / 1000)} ago`; }

function tick() {
  const age = performance.now() - statusAt;
  const dead = !cell || age > kStaleMs;
  document.body.classList.toggle("not-live", dead);
  // Nobody operates on what may be no longer true; STOP is not among these.
  if (dead) for (const button of document.querySelectorAll("main button, .shelf button")) button.disabled = true;
  if (!dead) showLeases();
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
$("do-frame").addEventListener("click", () => command("/api/v1/commands/frame",
    framePercent() > 0 ? {power: framePercent() / 100, confirmed: confirmedNames()} : {}, 120000));
$("frame-percent").addEventListener("input", () => { if (cell) showCommands(); });
$("do-recut").addEventListener("click", recutChosen);
$("lost-card").addEventListener("toggle", loadLost);
$("lost-job").addEventListener("change", loadLost);
$("lost-mark").addEventListener("change", showLost);
$("do-lost").addEventListener("click", nameLost);
$("archive-done").addEventListener("click", archiveDone);
$("show-archived").addEventListener("change", loadJobs);
enter().then(() => {
  poll();
  listen();
  loadJobs();
  showBed();
});
setInterval(tick, 500);
