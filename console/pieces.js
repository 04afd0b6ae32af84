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

// Of the panel that was cut last, whatever job the cell has to do with now.
let recutPieces = {key: "", job: 0, pieces: []};

async function loadRecut() {
  const recut = cell.recut;
  const key = recut ? `${recut.job} ${recut.panel} ${recut.pieces}` : "";
  if (recutPieces.key === key) return;
  recutPieces = {key, job: recut ? recut.job : 0, pieces: []};
  if (!recut) return;
  try {
    const pieces = await askAll(`/api/v1/jobs/${recut.job}/pieces`, "pieces");
    if (recutPieces.key !== key) return;
    recutPieces.pieces = pieces.filter((piece) => piece.state === "cut" && piece.panel === recut.panel);
    showRecut();
  } catch (fault) { recutPieces.key = ""; }
}

function showRecut() {
  loadRecut();
  const cut = cell.recut ? recutPieces.pieces : [];
  const there = cut.length > 0 && ["Suspended", "Complete", "Stopped", "Idle"].includes(cell.state);
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
  if (await command(`/api/v1/jobs/${cell.recut.job}/recut`, {pieces, confirmed: confirmedNames()})) recutMarks.clear();
  $("recut-marks").dataset.shown = "";
  show();
}

const kVerdicts = [["cut", "good"], ["scrap", "lost"], ["released", "never touched"]];

// What is to be said of single pieces, of every job, also of one that was broken off in another life of the cell.
let suspects = [];  // {job, piece}
let missing = [];   // the same, of jobs that are not given up
let lookedAt = "";  // for which jobs these were read

async function loadSuspects() {
  const of = jobs.filter((job) => job.suspect > 0 || canBeWhole(job));
  const key = JSON.stringify(of.map((job) => [job.id, job.state, job.suspect, job.missing, job.cut]));
  if (key === lookedAt) return;
  const doubtful = [], gone = [];
  for (const job of of) {
    let pieces = [];
    try { pieces = await askAll(`/api/v1/jobs/${job.id}/pieces`, "pieces"); } catch (fault) { return; }
    for (const piece of pieces) {
      if (piece.state === "suspect") doubtful.push({job, piece});
      if (canBeWhole(job) && kGone.includes(piece.state)) gone.push({job, piece});
    }
  }
  [suspects, missing, lookedAt] = [doubtful, gone, key];
  if (cell) { showSuspects(); showMissing(); }
}

const kGone = ["scrap", "released", "unfilled"];
const canBeWhole = (job) => job.missing > 0 && !["cancelled", "running", "planned"].includes(job.state);

// By piece and place: one that is made again has another picture.
const piecePictures = new Map();
const passport = (piece) => `/api/v1/pieces/${piece.id}`;

function pictureOf(piece) {
  const key = `${piece.id} ${piece.panel} ${JSON.stringify((piece.panel_outline_mm || [])[0])}`;
  let image = piecePictures.get(key);
  if (!image) {
    image = new Image();
    image.alt = `The wood of ${piece.mark}`;
    piecePictures.set(key, image);
    if (piece.panel) renewPicture(image, `/api/v1/pieces/${piece.id}/picture.png?width=240`);
  }
  return image;
}

// A row of a list: picture, mark with its passport, where it belongs, and what may be said of it.
function pieceRow({job, piece}, buttons) {
  const item = document.createElement("li");
  const name = document.createElement("a");
  name.href = passport(piece);
  name.target = "_blank";
  name.title = `Where ${piece.mark} comes from and how it was made`;
  name.textContent = piece.mark;
  const where = document.createElement("span");
  where.className = "dim";
  where.textContent = `${job.name}, ${piece.panel || "no panel"}`;
  const words = document.createElement("div");
  words.append(name, where);
  item.append(...(piece.panel ? [pictureOf(piece)] : []), words, ...buttons);
  return item;
}

function verdictButton({job, piece}, verdict, words) {
  const button = document.createElement("button");
  button.textContent = words;
  button.disabled = role === "viewer";
  button.onclick = async () => {
    await command(`/api/v1/jobs/${job.id}/pieces/${encodeURIComponent(piece.mark)}/settle`, {verdict});
    loadPieces();
    loadJobs();
  };
  return button;
}

// What the last scan of its panel saw: proposed, never decided by itself.
function sightingWords({seen, gone_share, at}) {
  const share = `${Math.round(100 * gone_share)} %`;
  const what = seen === "cut" ? `gone (${share}): it was cut` : seen === "still_there" ? "still there" : `gone in part (${share})`;
  return `The scan of ${new Date(at).toLocaleDateString("en-GB", {dateStyle: "medium"})} saw its wood ${what}.`;
}

function suspectRow(one) {
  const item = pieceRow(one, kVerdicts.map(([verdict, words]) => verdictButton(one, verdict, words)));
  if (!one.piece.sighting) return item;
  const words = document.createElement("div");
  words.className = "sighting";
  words.textContent = sightingWords(one.piece.sighting);
  item.append(words);
  return item;
}

// A panel was scanned: what was seen of its suspect pieces may be another thing now.
function lookAgainAtSuspects() {
  lookedAt = "";
  loadSuspects();
}

// Whatever the cell does: what became of a piece can be said at any time.
function showSuspects() {
  $("suspects-card").hidden = suspects.length === 0;
  const shown = `${role} ${suspects.map(({job, piece}) => `${job.id}:${piece.mark}:${piece.sighting ? piece.sighting.at : ""}`).join(" ")}`;
  if ($("suspects").dataset.shown === shown) return;
  $("suspects").dataset.shown = shown;
  $("suspects").replaceChildren(...suspects.map(suspectRow));
}

// ---- pieces that are lost -------------------------------------------------------------------------------------------

const redoing = new Map();  // job by the task that looks for its wood

// Other wood for these marks, or for all that are missing.
async function redo(job, marks) {
  $("refusal").hidden = true;
  try {
    const started = await ask("POST", `/api/v1/jobs/${job}/redo`, 20000, marks ? {pieces: marks} : {});
    redoing.set(started.task, job);
  } catch (fault) { showRefusal(fault.message); }
  showMissing();
  showLost();
}

const cannotRedo = (job) => role === "viewer" || [...redoing.values()].includes(job) || !databaseSound();

function redoButton(job, marks, words) {
  const button = document.createElement("button");
  button.textContent = words;
  button.disabled = cannotRedo(job);
  button.onclick = () => { button.disabled = true; redo(job, marks); };
  return button;
}

function showMissing() {
  const wanting = jobs.filter(canBeWhole);
  $("missing-card").hidden = wanting.length === 0 && !$("missing-note").textContent;
  const busy = [...redoing.values()].join(" ");
  const shown = JSON.stringify([role, databaseSound(), busy, wanting.map((job) => [job.id, job.missing]), missing.map(({piece}) => piece.id)]);
  if ($("missing").dataset.shown === shown) return;
  $("missing").dataset.shown = shown;
  $("missing").replaceChildren(...wanting.flatMap((job) => {
    const item = document.createElement("li");
    const name = document.createElement("b");
    name.textContent = job.name;
    const told = document.createElement("span");
    told.textContent = job.missing === 1 ? "1 piece is missing" : `${job.missing} pieces are missing`;
    item.append(name, told);
    if (job.missing > 1) item.append(redoButton(job.id, null, "Find other wood for all"));
    const of = missing.filter((one) => one.job.id === job.id);
    return [item, ...of.map((one) => pieceRow(one, [redoButton(job.id, [one.piece.mark], "Find other wood")]))];
  }));
}

// A piece that was cut, and then fell into the exhaust or broke: redo takes it as lost.
let lost = {job: 0, pieces: []};  // the cut ones of the job that is chosen

function choices(select, options) {
  const shown = JSON.stringify(options);
  if (select.dataset.shown === shown) return;
  const before = select.value;
  select.dataset.shown = shown;
  select.replaceChildren(...options.map(([value, words]) => new Option(words, value)));
  if (options.some(([value]) => value === before)) select.value = before;
}

function showLost() {
  const of = jobs.filter((job) => job.cut > 0 && !job.now).reverse();
  $("lost-card").hidden = of.length === 0;
  choices($("lost-job"), of.map((job) => [String(job.id), `job ${job.id}, ${job.name}`]));
  const job = Number($("lost-job").value);
  if ($("lost-card").open && of.length && lost.job !== job) loadLost();
  choices($("lost-mark"), [["", "choose a piece"], ...lost.pieces.map((piece) => [piece.mark, piece.mark])]);
  const piece = lost.pieces.find((one) => one.mark === $("lost-mark").value);
  $("lost-picture").replaceChildren(...(piece ? [pictureOf(piece)] : []));
  $("do-lost").disabled = !piece || cannotRedo(job);
}

async function loadLost() {
  const job = Number($("lost-job").value);
  if (!job) return;
  lost = {job, pieces: []};
  let pieces = [];
  try { pieces = await askAll(`/api/v1/jobs/${job}/pieces`, "pieces"); } catch (fault) { lost.job = 0; return; }
  if (lost.job !== job) return;
  lost.pieces = pieces.filter((piece) => piece.state === "cut");
  showLost();
}

async function nameLost() {
  const mark = $("lost-mark").value;
  if (!mark || !confirm(`Piece ${mark} is lost, and other wood is looked for? This cannot be taken back.`)) return;
  await redo(lost.job, [mark]);
}

// How much worse the picture gets is told before anything is cut.
async function noteRedone(task) {
  const id = redoing.get(task.id);
  if (!id || task.state === "running") return;
  redoing.delete(task.id);
  const {result} = task.state === "done" ? await ask("GET", `/api/v1/tasks/${task.id}`).catch(() => ({})) : {};
  if (result && result.redone) {
    const marks = result.redone.map((piece) => piece.mark);
    const change = 100 * (result.cost_per_pixel / result.cost_per_pixel_before - 1);
    $("missing-note").textContent = `${marks.length > 6 ? `${marks.length} pieces have` : marks.length === 1 ? `${marks[0]} has` : `${marks.join(", ")} have`} other wood now. The picture is ${Math.abs(change).toFixed(2)} % ${change > 0 ? "farther from" : "nearer to"} what was asked for than it was planned. Start cuts ${marks.length === 1 ? "it" : "them"}.`;
  }
  loadJobs();
  loadPanels();
  loadPieces();
  loadLost();
}
