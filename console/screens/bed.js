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

// Where the picture shows the head, between the nodes of the toolpath's grid; null where the cell does not tell.
function headAt() {
  const place = (model.cell.laser || {}).position_mm, grid = toolpath && toolpath.machine;
  if (!place || !grid) return null;
  const [across, up] = [[grid.columns, 0], [grid.rows, 1]].map(([nodes, axis]) => {
    const at = (place[axis] - grid.min_mm[axis]) / (grid.max_mm[axis] - grid.min_mm[axis]) * (nodes - 1);
    const node = Math.min(Math.max(Math.floor(at), 0), nodes - 2);
    return {node, part: at - node};
  });
  if ([across, up].some(({part}) => part < 0 || part > 1)) return null;  // beyond what the camera sees
  const point = (i, j) => grid.points[(up.node + j) * grid.columns + across.node + i];
  const between = (a, b, part) => a.map((value, axis) => value + (b[axis] - value) * part);
  return between(between(point(0, 0), point(1, 0), across.part), between(point(0, 1), point(1, 1), across.part), up.part);
}

// A cross that is seen on any wood, dark in light.
function headMark(long) {
  const at = headAt();
  if (!at || !kPanelStates.includes(model.cell.state)) return [];
  const [x, y] = at;
  const d = `M${x - long} ${y}H${x + long}M${x} ${y - long}V${y + long}`;
  return [svg("path.head", {d}), svg("path.head.inner", {d})];
}

// ---- close up -------------------------------------------------------------------------------------------------------

let close = null;  // as somebody wants it; else whole while a panel is laid, and close up while it is cut

// What is shown of the picture, in fractions of it: all that is to be cut, with room around it; null = all.
function closeUp() {
  const points = toolpath ? [toolpath.frame, ...toolpath.pieces.flatMap((piece) => piece.lines.map((line) => line.points))].flat() : [];
  if (!points.length) return null;
  const [low, high] = [Math.min, Math.max].map((most) => [0, 1].map((axis) => points.reduce((value, point) => most(value, point[axis]), points[0][axis])));
  const side = Math.min(1, 1.25 * Math.max(high[0] - low[0], high[1] - low[1]));
  const [left, top] = [0, 1].map((axis) => Math.min(Math.max((low[axis] + high[axis]) / 2 - side / 2, 0), 1 - side));
  return {left, top, side};
}

export function bedCard() {
  followToolpath();
  const drawn = lines();
  const may = drawn.length > 1 ? closeUp() : null;  // the strokes, not only where a panel is to be laid
  const near = close ?? !model.cell.load;
  const {left, top, side} = (near && may) || {left: 0, top: 0, side: 1};
  return card(t("bed"),
    ...bedView(t("bed.none"), {left, top, side}, svg("svg", {viewBox: `${left} ${top} ${side} ${side}`, preserveAspectRatio: "none", "aria-hidden": "true"}, ...drawn, ...headMark(.025 * side))),
    may && h("div.choices", {role: "group", "aria-label": t("bed.how_close")}, ...[true, false].map((is) =>
      h("button", {type: "button", id: is ? "bed-close" : "bed-whole", "aria-pressed": String(near === is), onclick: () => { close = is; changed(); }}, t(is ? "bed.close" : "bed.whole")))),
    drawn.length > 0 && h("p.key.dim", {}, h("i.key-line-cut"), t("key.cut_line"), h("i.key-done"), t("key.done"), h("i.key-line-engrave"), t("key.engrave"), h("i.key-line-frame"), t("key.frame"), headAt() && [h("span", {"aria-hidden": "true"}, " ✚ "), t("key.head")]));
}
