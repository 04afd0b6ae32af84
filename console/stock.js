// The panels in stock and the jobs.
"use strict";

const stockPictures = new Map();  // by panel: the <img> that is shown
const jobPictures = new Map();
const squareCm = (mm2) => `${Math.round((mm2 || 0) / 100)} cm²`;

async function loadPanels() {
  listsAt = performance.now();
  try { panels = (await askAll("/api/v1/panels", "panels")).filter((panel) => !panel.retired); } catch (fault) { return; }
  showPanels();
  loadLeases();
}

function stockPicture(panel) {
  const image = stockPictures.get(panel) || new Image();
  stockPictures.set(panel, image);
  renewPicture(image, `/api/v1/panels/${encodeURIComponent(panel)}/stock.png?width=640`);
  return image;
}

function showPanels() {
  $("panel-count").textContent = panels.length ? `(${panels.length})` : "– none yet: lay one on the scanner and run “veneerctl panel scan”";
  $("panels").replaceChildren(...panels.map((panel) => {
    const card = document.createElement("div");
    card.className = "panel" + (cell && cell.load && cell.load.panel === panel.id ? " wanted" : "");
    card.dataset.panel = panel.id;
    const image = stockPicture(panel.id);
    image.alt = `Free, reserved and cut wood of ${panel.id}`;
    const name = document.createElement("b");
    name.textContent = panel.name && panel.name !== panel.id ? `${panel.id} ${panel.name}` : panel.id;
    const size = document.createElement("div");
    size.textContent = `${Math.round(panel.width_mm)} × ${Math.round(panel.height_mm)} mm` + (panel.parent ? `, remnant of ${panel.parent}` : "");
    const wood = document.createElement("div");
    wood.className = "dim";
    wood.textContent = `${squareCm(panel.free_mm2)} free, ${squareCm(panel.reserved_mm2)} reserved`;
    card.append(image, name, size, wood, ...leasesOn(panel.id));
    if (panel.scan_again) {
      const waits = document.createElement("div");
      waits.className = "differences";
      waits.textContent = `⚠ Waits for a scan: ${panel.scan_again}`;
      card.append(waits);
    }
    if (panel.open_differences) {
      const differences = document.createElement("div");
      differences.className = "differences";
      const places = panel.open_differences === 1 ? "1 place" : `${panel.open_differences} places`;
      differences.textContent = `⚠ Wood and ledger disagree in ${places}:`;
      card.append(differences, differencesOf(panel));
    }
    return card;
  }));
}

// ---- what scan and ledger disagree about ----------------------------------------------------------------------------

const knownDifferences = new Map();  // by panel: {count, list}
const kDifferences = {gone_not_booked: "wood is gone that is not booked as cut", booked_not_gone: "booked as cut, and still in the panel"};

function differencesOf(panel) {
  const list = document.createElement("ul");
  list.className = "suspects";
  const known = knownDifferences.get(panel.id);
  if (known && known.count === panel.open_differences) list.append(...known.list.map((one) => differenceRow(panel.id, one)));
  else loadDifferences(panel);
  return list;
}

async function loadDifferences(panel) {
  let all = [];
  try { all = await askAll(`/api/v1/panels/${encodeURIComponent(panel.id)}/differences`, "differences"); } catch (fault) { return; }
  const open = all.filter((one) => !one.decided);
  knownDifferences.set(panel.id, {count: panel.open_differences, list: open});
  showPanels();
}

function differenceRow(panel, difference) {
  const item = document.createElement("li");
  const words = document.createElement("span");
  const [x, y] = difference.place_mm;
  const pieces = (difference.pieces || []).map((piece) => `piece ${piece.mark} of job ${piece.job}`);
  words.textContent = [`at ${x.toFixed(1)} / ${y.toFixed(1)} mm`, kDifferences[difference.kind] || difference.kind, `${difference.area_mm2.toFixed(0)} mm²`, ...pieces].join(", ");
  item.append(words, decideButton(panel, difference, "written_off", "Write it off"), decideButton(panel, difference, "accepted", "Leave it as it is"));
  return item;
}

function decideButton(panel, difference, verdict, label) {
  const button = document.createElement("button");
  button.textContent = label;
  button.dataset.changes = "";
  button.disabled = role === "viewer" || !databaseSound();
  button.onclick = async () => {
    button.disabled = true;
    if (await command(`/api/v1/panels/${encodeURIComponent(panel)}/differences/${difference.id}/decide`, {verdict})) {
      knownDifferences.delete(panel);
      loadPanels();
      loadJobs();
    } else button.disabled = false;
  };
  return button;
}

// ---- jobs -----------------------------------------------------------------------------------------------------------

async function loadJobs() {
  const all = $("show-archived").checked;
  try { jobs = await askAll(all ? "/api/v1/jobs?archived=true" : "/api/v1/jobs", "jobs"); } catch (fault) { return; }
  showJobs();
  loadSuspects();
  if (cell) { showMissing(); showLost(); showCommands(); }
}

async function archiveDone() {
  if (await command("/api/v1/jobs/archive-done")) loadJobs();
}

function showJobs() {
  const done = jobs.filter((job) => !job.archived && !job.suspect && ["complete", "cancelled"].includes(job.state)).length;
  $("archive-done").textContent = done === 1 ? "Archive the one that is done" : `Archive the ${done} that are done`;
  $("archive-done").hidden = done === 0;
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
    const image = jobPictures.get(job.id) || new Image();
    jobPictures.set(job.id, image);
    image.alt = "";
    if (image.dataset.asked !== String(job.newest_plan)) {
      image.dataset.asked = job.newest_plan;
      renewPicture(image, `/api/v1/jobs/${job.id}/preview.png?width=120`).then((came) => { if (!came) delete image.dataset.asked; });
    }
    const words = document.createElement("span");
    const name = document.createElement("b");
    name.textContent = job.name;
    const told = document.createElement("span");
    told.dataset.job = job.id;
    told.textContent = jobWords(job);
    words.append(name, told);
    row.append(radio, image, words);
    return row;
  }));
}

function jobWords(job) {
  // Of the job under way the status is newer than the list: one page tells one number.
  const current = cell && cell.job && cell.job.id === job.id;
  const {cut, suspect} = current ? cell.job : job;
  const state = (current ? cell.job.now : job.now) || job.state;
  return `job ${job.id}${job.archived ? ", archived" : ""}, ${state}, ${cut} of ${job.pieces} cut` + (suspect ? `, ▲ ${suspect} suspect` : "") + (job.state === "incomplete" ? `, ▲ ${job.missing} missing` : "");
}

function recountJobs() {
  for (const told of $("jobs").querySelectorAll("[data-job]")) {
    const job = jobs.find((known) => known.id === Number(told.dataset.job));
    if (job) told.textContent = jobWords(job);
  }
}
