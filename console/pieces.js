// What a person says of single pieces: not through, so cut again while the panel lies unmoved; and what became of the
// suspect ones.
"use strict";

const recutMarks = new Set();

function chip(mark) {
  const label = document.createElement("label");
  const box = document.createElement("input");
  box.type = "checkbox";
  box.checked = recutMarks.has(mark);
  box.onchange = () => {
    if (box.checked) recutMarks.add(mark); else recutMarks.delete(mark);
    show();
  };
  label.append(box, mark);
  return label;
}

function showRecut() {
  const recut = cell.recut;
  const cut = recut ? map.pieces.filter((piece) => piece.state === "cut" && piece.panel === recut.panel) : [];
  const there = cut.length > 0 && ["Suspended", "Complete", "Stopped"].includes(cell.state);
  $("recut-card").hidden = !there;
  if (!there) recutMarks.clear();
  const shown = cut.map((piece) => piece.mark).join(" ");
  if ($("recut-marks").dataset.shown !== shown) {
    $("recut-marks").dataset.shown = shown;
    $("recut-marks").replaceChildren(...cut.map((piece) => chip(piece.mark)));
  }
  $("do-recut").textContent = recutMarks.size ? `Cut ${[...recutMarks].join(", ")} again` : "Choose the pieces first";
  $("do-recut").disabled = role === "viewer" || !recutMarks.size || !allConfirmed() || !databaseSound();
}

async function recutChosen() {
  const pieces = [...recutMarks];
  if (await command(`/api/v1/jobs/${cell.job.id}/recut`, {pieces, confirmed: confirmedNames()})) recutMarks.clear();
  $("recut-marks").dataset.shown = "";
  show();
}

const kVerdicts = [["cut", "good"], ["scrap", "lost"], ["released", "never touched"]];

// Of every job, also of one that was broken off in another life of the cell.
let suspects = [];  // {job, mark, panel}

async function loadSuspects() {
  const found = [];
  for (const job of jobs.filter((known) => known.suspect > 0)) {
    let pieces = [];
    try { pieces = await askAll(`/api/v1/jobs/${job.id}/pieces`, "pieces"); } catch (fault) { return; }
    for (const piece of pieces) if (piece.state === "suspect") found.push({job, mark: piece.mark, panel: piece.panel});
  }
  suspects = found;
  if (cell) showSuspects();
}

function verdictButton({job, mark}, verdict, words) {
  const button = document.createElement("button");
  button.textContent = words;
  button.disabled = role === "viewer";
  button.onclick = async () => {
    await command(`/api/v1/jobs/${job.id}/pieces/${encodeURIComponent(mark)}/settle`, {verdict});
    loadPieces();
    loadJobs();
  };
  return button;
}

function showSuspects() {
  const atRest = ["Stopped", "Idle", "Complete", "Aborted"].includes(cell.state);
  $("suspects-card").hidden = suspects.length === 0 || !atRest;
  const shown = `${role} ${suspects.map(({job, mark}) => `${job.id}:${mark}`).join(" ")}`;
  if ($("suspects").dataset.shown === shown) return;
  $("suspects").dataset.shown = shown;
  $("suspects").replaceChildren(...suspects.map((piece) => {
    const item = document.createElement("li");
    const name = document.createElement("b");
    name.textContent = piece.mark;
    const where = document.createElement("span");
    where.className = "dim";
    where.textContent = `${piece.job.name}, ${piece.panel || "no panel"}`;
    item.append(name, where, ...kVerdicts.map(([verdict, words]) => verdictButton(piece, verdict, words)));
    return item;
  }));
}

// ---- pieces that are lost -------------------------------------------------------------------------------------------

const missingJobs = () => jobs.filter((job) => job.missing > 0 && !["cancelled", "running", "planned"].includes(job.state));
const redoing = new Map();  // job by the task that looks for its wood

function redoButton(job) {
  const button = document.createElement("button");
  button.textContent = "Find other wood";
  button.disabled = role === "viewer" || [...redoing.values()].includes(job.id) || !databaseSound();
  button.onclick = async () => {
    button.disabled = true;
    $("refusal").hidden = true;
    try {
      const started = await ask("POST", `/api/v1/jobs/${job.id}/redo`, 20000, {});
      redoing.set(started.task, job.id);
    } catch (fault) { showRefusal(fault.message); }
    showMissing();
  };
  return button;
}

function showMissing() {
  const wanting = missingJobs();
  $("missing-card").hidden = wanting.length === 0 && !$("missing-note").textContent;
  $("missing").replaceChildren(...wanting.map((job) => {
    const item = document.createElement("li");
    const name = document.createElement("b");
    name.textContent = job.name;
    const told = document.createElement("span");
    told.textContent = job.missing === 1 ? "1 piece is missing" : `${job.missing} pieces are missing`;
    item.append(name, told, redoButton(job));
    return item;
  }));
}

// How much worse the picture gets is told before anything is cut.
function noteRedone(task) {
  const id = redoing.get(task.id);
  if (!id || task.state === "running") return;
  redoing.delete(task.id);
  const result = task.result;
  if (result && result.redone) {
    const marks = result.redone.map((piece) => piece.mark);
    const change = 100 * (result.cost_per_pixel / result.cost_per_pixel_before - 1);
    $("missing-note").textContent = `${marks.length > 6 ? `${marks.length} pieces have` : marks.length === 1 ? `${marks[0]} has` : `${marks.join(", ")} have`} other wood now. The picture is ${Math.abs(change).toFixed(2)} % ${change > 0 ? "farther from" : "nearer to"} what was asked for than it was planned. Start cuts ${marks.length === 1 ? "it" : "them"}.`;
  }
  loadJobs();
  loadPanels();
}
