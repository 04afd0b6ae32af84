// Wood that is kept for plans: for which, until when, and how it is given back.
"use strict";

let leases = [];  // plans that lease their wood; the one whose lease ends next first

async function loadLeases() {
  let plans = [];
  try { plans = await askAll("/api/v1/plans?leased=true", "plans"); } catch (fault) { return; }
  leases = plans.filter((plan) => plan.lease).sort((a, b) => a.lease.until.localeCompare(b.lease.until));
  showLeases();
  showPanels();
}

const leftOf = (plan) => (Date.parse(plan.lease.until) - Date.now()) / 1000;
const localTime = (at) => new Date(at).toLocaleString("en-GB", {dateStyle: "medium", timeStyle: "short"});

function leaseWords(plan) {
  const days = Math.floor(leftOf(plan) / 86400);
  const left = days >= 2 ? `${days} days` : minutes(Math.max(0, leftOf(plan)));
  return `until ${localTime(plan.lease.until)}, ${left} left, by ${plan.lease.who}`;
}

// Asked again and again, because time goes on; the buttons stay, so that none goes away under a finger.
function showLeases() {
  if (!cell) return;
  $("leases-card").hidden = leases.length === 0;
  const shown = `${role} ${databaseSound()} ${leases.map((plan) => plan.id).join(" ")}`;
  if ($("leases").dataset.shown !== shown) {
    $("leases").dataset.shown = shown;
    $("leases").replaceChildren(...leases.map(leaseRow));
  }
  for (const told of $("leases").querySelectorAll("[data-plan]")) {
    const plan = leases.find((known) => known.id === Number(told.dataset.plan));
    if (plan) told.textContent = leaseWords(plan);
  }
}

function leaseRow(plan) {
  const item = document.createElement("li");
  const name = document.createElement("b");
  name.textContent = plan.name;
  const what = document.createElement("div");
  what.textContent = `plan ${plan.id}, ${plan.placed} pieces of ${plan.panels.map((planned) => planned.panel).join(", ")}`;
  const when = document.createElement("div");
  when.className = "dim";
  when.dataset.plan = plan.id;
  const words = document.createElement("div");
  words.append(name, what, when);
  const button = document.createElement("button");
  button.textContent = "Give the wood back";
  button.dataset.changes = "";
  button.disabled = role === "viewer" || !databaseSound();
  button.onclick = async () => {
    button.disabled = true;
    if (!(await command(`/api/v1/plans/${plan.id}/lease`, null, 20000, "DELETE"))) button.disabled = false;
    loadLeases();
  };
  item.append(words, button);
  return item;
}

// What a panel's card says of them.
function leasesOn(panel) {
  return leases.filter((plan) => plan.panels.some((planned) => planned.panel === panel)).map((plan) => {
    const line = document.createElement("div");
    line.className = "dim";
    line.textContent = `leased for plan ${plan.id} “${plan.name}” until ${localTime(plan.lease.until)}`;
    return line;
  });
}
