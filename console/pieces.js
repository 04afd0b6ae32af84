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

function showSuspects() {
  const suspects = cell.job ? map.pieces.filter((piece) => piece.state === "suspect") : [];
  const atRest = ["Stopped", "Idle", "Complete", "Aborted"].includes(cell.state);
  $("suspects-card").hidden = suspects.length === 0 || !atRest;
  const shown = `${role} ${suspects.map((piece) => piece.mark).join(" ")}`;
  if ($("suspects").dataset.shown === shown) return;
  $("suspects").dataset.shown = shown;
  $("suspects").replaceChildren(...suspects.map((piece) => {
    const item = document.createElement("li");
    const name = document.createElement("b");
    name.textContent = piece.mark;
    const buttons = kVerdicts.map(([verdict, words]) => {
      const button = document.createElement("button");
      button.textContent = words;
      button.disabled = role === "viewer";
      button.onclick = async () => {
        await command(`/api/v1/jobs/${cell.job.id}/pieces/${encodeURIComponent(piece.mark)}/settle`, {verdict});
        loadPieces();
        loadJobs();
      };
      return button;
    });
    item.append(name, ...buttons);
    return item;
  }));
}
