// The bed camera's picture, with what is about to be cut drawn over it: the strokes, their frame, and where a panel
// that takes several set-ups is to be laid. All lines come in fractions of the picture's width and height.
"use strict";

const kSvg = "http://www.w3.org/2000/svg";
// While the panel that was shown lies there.
const kPanelStates = ["Suspended", "Unsuspending", "Execute", "Holding", "Held", "Unholding"];

let bedAt = 0;            // when the picture came, in ms of performance.now()
let toolpath = null;      // the last GET /bed/toolpath
let toolpathOf = "";      // the look it was drawn for

async function showBed() {
  if (!await renewPicture($("bed-picture"), "/api/v1/bed.jpg")) return;
  $("bed-view").hidden = false;
  $("bed-none").hidden = true;
  bedAt = performance.now();
}

function line(kind, paths, closed) {
  const path = document.createElementNS(kSvg, "path");
  path.setAttribute("class", kind);
  path.setAttribute("d", paths.map((points) => `M${points.map(([x, y]) => `${x} ${y}`).join("L")}${closed ? "Z" : ""}`).join(""));
  return path;
}

function drawLines() {
  const load = cell && cell.load;
  const lines = [];
  if (load && !load.found && (load.outline || []).length > 2) lines.push(line("lay", [load.outline], true));
  if (toolpath && kPanelStates.includes(cell.state) && (!load || (load.found && load.panel === toolpath.panel))) {
    const of = (role) => toolpath.pieces.flatMap((piece) => piece.lines.filter((l) => l.role === role).map((l) => l.points));
    if (load) lines.push(line("frame", [toolpath.frame], true));
    lines.push(line("engrave", of("engrave"), false), line("cut", of("cut"), false));
  }
  $("bed-lines").replaceChildren(...lines);
  $("bed-key").hidden = lines.length === 0;
}

// The strokes change with the look, not with the picture.
async function showToolpath() {
  const load = cell.load;
  const key = load && load.found ? `${load.panel} ${load.setup} ${load.rms_mm} ${load.estimate_s}` : "";
  if (key && key !== toolpathOf) {
    toolpathOf = key;
    try { toolpath = await ask("GET", "/api/v1/bed/toolpath"); } catch (fault) { toolpath = null; toolpathOf = ""; }
  }
  drawLines();
}
