// The bed camera's picture, with what is about to be cut drawn over it and what is cut filled in: the strokes, their
// frame, and where a panel that takes several set-ups is to be laid. All lines come in fractions of the picture's width
// and height.
import {h, svg} from "../dom.js";
import {t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, model, piecesOf} from "../model.js";
import {card} from "../parts.js";
import {bedView} from "../watch.js";

// While the panel that was looked at lies there.
const kPanelStates = ["Suspended", "Unsuspending", "Execute", "Completing", "Holding", "Held", "Unholding", "Stopping"];

let toolpath = null;  // the last GET /bed/toolpath
let toolpathOf = "";  // the look it was drawn for

// The panel that lies on the bed as far as the cell knows, "" when it knows of none.
export const panelOnBed = () => (toolpath && kPanelStates.includes(model.cell.state) && !model.cell.load ? toolpath.panel : "");

// The strokes change with the look, not with the picture.
function followToolpath() {
  const {load, state} = model.cell;
  const key = load ? (load.found ? `${load.panel} ${load.setup} ${load.rms_mm} ${load.estimate_s}` : "")
                   : kPanelStates.includes(state) && !toolpath ? "under way" : toolpathOf;
  if (!key || key === toolpathOf) return;
  toolpathOf = key;
  get("/bed/toolpath").then((drawn) => { if (toolpathOf === key) { toolpath = drawn; changed(); } }, () => setTimeout(() => { if (toolpathOf === key) toolpathOf = ""; }, kAgainMs));
}

const path = (kind, lines, closed, more = {}) => svg("path", {class: kind, ...more, d: lines.map((points) => `M${points.map(([x, y]) => `${x} ${y}`).join("L")}${closed ? "Z" : ""}`).join("")});

function lines() {
  const {cell} = model;
  const {load} = cell;
  const out = [];
  if (load && !load.found && (load.outline || []).length > 2) out.push(path("lay", [load.outline], true));
  if (!toolpath || !kPanelStates.includes(cell.state) || (load && !(load.found && load.panel === toolpath.panel))) return out;
  const known = cell.job ? new Map(piecesOf(cell.job.id).map((piece) => [piece.id, piece.state])) : new Map();
  const of = (piece, role) => piece.lines.filter((line) => line.role === role).map((line) => line.points);
  if (load) out.push(path("frame", [toolpath.frame], true));
  for (const piece of toolpath.pieces) {
    const state = known.get(piece.piece);
    const now = cell.job && cell.job.current_piece === piece.mark;
    out.push(path("engrave", of(piece, "engrave"), false), path(`line ${state ? `is-${state}` : ""} ${now ? "is-now" : ""}`, of(piece, "cut"), false));
  }
  return out;
}

export function bedCard() {
  followToolpath();
  const drawn = lines();
  return card(t("bed"),
    ...bedView(t("bed.none"), svg("svg", {viewBox: "0 0 1 1", preserveAspectRatio: "none", "aria-hidden": "true"}, ...drawn)),
    drawn.length > 0 && h("p.key.dim", {}, h("i.key-line-cut"), t("key.cut_line"), h("i.key-done"), t("key.done"), h("i.key-line-engrave"), t("key.engrave"), h("i.key-line-frame"), t("key.frame")));
}
