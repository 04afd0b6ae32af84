// The panels in stock and the jobs.
"use strict";

const stockPictures = new Map();  // by panel: the <img> that is shown
const jobPictures = new Map();
const squareCm = (mm2) => `${Math.round((mm2 || 0) / 100)} cm²`;

async function loadPanels() {
  listsAt = performance.now();
  try { panels = (await askAll("/api/v1/panels", "panels")).filter((panel) => !panel.retired); } catch (fault) { return; }
  showPanels();
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
    card.append(image, name, size, wood);
    if (panel.open_differences) {
      const differences = document.createElement("div");
      differences.className = "differences";
      const places = panel.open_differences === 1 ? "1 place" : `${panel.open_differences} places`;
      differences.textContent = `⚠ Wood and ledger disagree in ${places}: “veneerctl panel differences ${panel.id}”`;
      card.append(differences);
    }
    return card;
  }));
}

async function loadJobs() {
  try { jobs = await askAll("/api/v1/jobs", "jobs"); } catch (fault) { return; }
  showJobs();
  loadSuspects();
  if (cell) { showMissing(); showCommands(); }
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
  const {cut, suspect} = cell && cell.job && cell.job.id === job.id ? cell.job : job;
  return `job ${job.id}, ${job.state}, ${cut} of ${job.pieces} cut` + (suspect ? `, ▲ ${suspect} suspect` : "") + (job.state === "incomplete" ? `, ▲ ${job.missing} missing` : "");
}

function recountJobs() {
  for (const told of $("jobs").querySelectorAll("[data-job]")) {
    const job = jobs.find((known) => known.id === Number(told.dataset.job));
    if (job) told.textContent = jobWords(job);
  }
}
