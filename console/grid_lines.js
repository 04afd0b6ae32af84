// The lines of a grid that follows the picture's edges, over the part that is wanted, and the places that somebody pins
// where they meet. A coarse grid comes within a moment, the one that a plan would have once nothing else is asked for.
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {changed} from "./model.js";
import {button, cellSays} from "./parts.js";
import {drawPart, pictureKey, smallPicture} from "./sketch.js";
import {liveLines} from "./live_lines.js";

const kShownPx = 720;
const kNear = .5;            // of a cell: how far beside a vertex a finger may come down
const kFarthest = .399, kMostLean = .499;  // of a cell, as the planner admits it (planner/morph/spring_grid.h), and a little less
const kStep = .05;           // of a cell, by an arrow
const kMostPins = 200, kMostGrids = 20;

let wanted = null;           // {file, crop, query, key, size: {width, height in mm, rows, columns}, name}
const live = liveLines("/plans/grid", {request: requestOf, waits: () => Boolean(hand), came: () => { ++version; }});
const pinned = new Map();    // by grid, see nameOf(): Map of "row,column" to [across, down], of the part, from 0 to 1
let hand = null;             // the vertex that a finger drags: {row, column, moved}
let cursor = [1, 1];         // row, column; of the keyboard
let byKeys = false, said = "", version = 0, changes = 0;

// What makes another grid of it: pins of one mean nothing in another.
const nameOf = (file, crop, {rows, columns}) => `${pictureKey(file)} ${crop ? Object.values(crop) : ""} ${rows}x${columns}`;

// As the planner has it (planner/plan.cc, planner/layout/grid.cc), of a picture with so many pixels.
export function sizeOf(pixels, shorter, patch) {
  const aspect = pixels.width / pixels.height, width = aspect >= 1 ? shorter * aspect : shorter, height = aspect >= 1 ? shorter : shorter / aspect;
  const count = (side) => Math.max(1, Math.round(side / patch));
  return {width, height, rows: count(height), columns: count(width)};
}

// Whether a picture that was made smaller, which has another shape by a hair, has as many rows and columns.
export const hasCountsOf = (size, shorter, patch) => (pixels) => { const one = sizeOf(pixels, shorter, patch); return one.rows === size.rows && one.columns === size.columns; };

const pins = () => (wanted && pinned.get(wanted.name)) || new Map();
const keyOf = (row, column) => `${row},${column}`;

// `whole`: the picture's size in pixels; `crop`: the part of it, or null. `query`: what else a plan would be asked for. Without a
// picture, or with another layout (`query` null), no grid is wanted.
export function wantGrid(file, whole, crop, query) {
  const shorter = query && Number(query.get("size_mm")), patch = query && Number(query.get("patch_mm"));
  if (!file || !whole || !(shorter > 0) || !(patch > 0)) { wanted = hand = null; live.want(null); return; }
  const size = sizeOf(crop || whole, shorter, patch), name = nameOf(file, crop, size);
  const next = {file, whole, crop, query, size, name, shorter, patch};
  next.key = `${query} ${name} ${[...(pinned.get(name) || [])].join(" ")}`;
  if (wanted && wanted.name !== name) { cursor = [Math.min(1, size.rows), Math.min(1, size.columns)]; said = ""; hand = null; }
  wanted = next;
  if (live.want(next)) ++version;
}

async function requestOf({file, crop, query, size, shorter, patch, name}) {
  const holds = new Map(pinned.get(name) || []);
  const body = await smallPicture({file, crop}, hasCountsOf(size, shorter, patch));
  if (!body.pixels) throw new Error(t("lines.unreadable"));
  const asked = new URLSearchParams(query);
  if (holds.size) asked.set("pinned_vertices", pinText(holds, sizeOf(body.pixels, shorter, patch)));
  return {query: asked, body: body.blob};
}

// ---- what a plan is told --------------------------------------------------------------------------------------------

const pinText = (holds, {width, height}) => [...holds].map(([key, [across, down]]) => `${key},${(across * width).toFixed(4)},${((1 - down) * height).toFixed(4)}`).join(";");
export function pinsInto(query) {
  if (pins().size) query.set("pinned_vertices", pinText(pins(), wanted.size));
}
// The same of a picture that was made smaller, by its size in pixels: it has another shape by a hair. null: nothing is pinned.
export function pinsOfSmaller() {
  if (!pins().size) return null;
  const holds = new Map(pins()), {shorter, patch} = wanted;
  return (pixels) => pinText(holds, sizeOf(pixels, shorter, patch));
}

// Whether lines are on their way, or a finger moves one: a sketch of the plan's own pieces waits.
export const linesMove = () => Boolean(wanted) && (Boolean(hand) || live.areComing());

// ---- what is kept of it ---------------------------------------------------------------------------------------------

// As keptPaint(), restorePaint() and the others (picture_brush.js).
export const pinsVersion = () => changes;
export const keptPins = () => [...pinned].map(([name, holds]) => ({name, holds: [...holds]}));
export function restorePins(all) {
  const isPin = ([key, place]) => /^\d+,\d+$/.test(key) && Array.isArray(place) && place.length === 2 && place.every(Number.isFinite);
  for (const {name, holds} of all) if (!pinned.has(name) && holds.every(isPin)) pinned.set(name, new Map(holds));
  ++version;
}
export function forgetPins() {
  pinned.clear();
  wanted = hand = null;
  live.want(null);
  said = "";
  ++version;
  ++changes;
}

// ---- the finger and the keyboard ------------------------------------------------------------------------------------

const straight = (row, column) => [column / wanted.size.columns, row / wanted.size.rows];

// That is known of this part of the picture, be it of a moment ago; null: none.
const gridOf = live.told;

// Where it is shown: pinned, as the cell has told, or as the straight grid has it.
function placeOf(row, column) {
  const held = pins().get(keyOf(row, column)), {size} = wanted;
  if (held) return held;
  const grid = gridOf();
  if (!grid) return straight(row, column);
  const [x, y] = grid.vertices[row * (size.columns + 1) + column];
  return [x / grid.width_mm, 1 - y / grid.height_mm];
}

const isCorner = (row, column) => [0, wanted.size.rows].includes(row) && [0, wanted.size.columns].includes(column);

// Where it may be: corners stay, places on the border slide along it, and no border between two that are pinned leans too far.
function admitted(row, column, [across, down]) {
  const {rows, columns, width, height} = wanted.size, [homeX, homeY] = straight(row, column);
  const near = (value, home, most) => Math.min(home + most, Math.max(home - most, value));
  let x = [0, columns].includes(column) ? homeX : near(across, homeX, kFarthest / columns);
  let y = [0, rows].includes(row) ? homeY : near(down, homeY, kFarthest / rows);
  for (const other of [row - 1, row + 1].map((one) => pins().get(keyOf(one, column)))) if (other && ![0, columns].includes(column)) x = near(x, other[0], kMostLean * height / rows / width);
  for (const other of [column - 1, column + 1].map((one) => pins().get(keyOf(row, one)))) if (other && ![0, rows].includes(row)) y = near(y, other[1], kMostLean * width / columns / height);
  return [x, y];
}

function pin(row, column, place) {
  const {name} = wanted, key = keyOf(row, column);
  if (isCorner(row, column)) { said = t("lines.corner"); return false; }
  if (!pins().has(key) && pins().size >= kMostPins) { said = t("lines.enough", {n: kMostPins}); return false; }
  const holds = pinned.get(name) || new Map();
  holds.set(key, admitted(row, column, place));
  pinned.delete(name);
  pinned.set(name, holds);  // the newest come last
  if (pinned.size > kMostGrids) pinned.delete(pinned.keys().next().value);
  ++version;
  ++changes;
  return true;
}

function free(row, column) {
  const holds = pinned.get(wanted.name);
  if (!holds || !holds.delete(keyOf(row, column))) return;
  if (!holds.size) pinned.delete(wanted.name);
  ++version;
  ++changes;
}

function freeAll() {
  pinned.delete(wanted.name);
  said = "";
  ++version;
  ++changes;
  changed();
}

function placeWords(row, column) {
  const [across, down] = placeOf(row, column), {width, height} = wanted.size;
  const at = {row: row + 1, column: column + 1, x: (across * width).toFixed(1), y: ((1 - down) * height).toFixed(1)};
  return t(pins().has(keyOf(row, column)) ? "lines.pinned" : isCorner(row, column) ? "lines.stays" : "lines.free", at);
}

function sharesOf(event) {
  const box = event.currentTarget.getBoundingClientRect();
  return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
}

// The vertex that lies nearest, in cells.
function nearest([across, down]) {
  const {rows, columns} = wanted.size;
  let best = null, least = kNear;
  const from = (value, most) => [Math.max(0, Math.floor(value) - 1), Math.min(most, Math.ceil(value) + 1)];
  const [top, bottom] = from(down * rows, rows), [left, right] = from(across * columns, columns);
  for (let row = top; row <= bottom; ++row)
    for (let column = left; column <= right; ++column) {
      const [x, y] = placeOf(row, column), away = Math.hypot((x - across) * columns, (y - down) * rows);
      if (away < least) [least, best] = [away, {row, column}];
    }
  return best;
}

// A tap names a vertex; only one that is moved is pinned.
function down(event) {
  if (event.button !== 0 || !event.isPrimary || !wanted) return;
  event.currentTarget.setPointerCapture(event.pointerId);
  const at = sharesOf(event), found = nearest(at);
  byKeys = false;
  if (!found) return;
  const [x, y] = placeOf(found.row, found.column);
  hand = {...found, from: [event.clientX, event.clientY], off: [x - at[0], y - at[1]], moved: false};
  cursor = [found.row, found.column];
  said = placeWords(...cursor);
  ++version;
  changed();
}

function move(event) {
  if (!hand || !event.isPrimary || !event.currentTarget.hasPointerCapture(event.pointerId)) return;
  if (!hand.moved && Math.hypot(event.clientX - hand.from[0], event.clientY - hand.from[1]) < 4) return;
  const [across, down_] = sharesOf(event);
  hand.moved = true;
  if (pin(hand.row, hand.column, [across + hand.off[0], down_ + hand.off[1]])) said = placeWords(hand.row, hand.column);
  changed();
}

function up(event) {
  if (!event.isPrimary) return;
  hand = null;
  ++version;
  changed();
}

function double(event) {
  const found = wanted && nearest(sharesOf(event));
  if (!found) return;
  free(found.row, found.column);
  said = placeWords(found.row, found.column);
  changed();
}

const kWays = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
function keyed(event) {
  if (!wanted || event.ctrlKey || event.altKey || event.metaKey) return;
  const {rows, columns} = wanted.size, way = kWays[event.key];
  let failed = false;
  if (way && event.shiftKey) {
    const [x, y] = placeOf(...cursor);
    failed = !pin(...cursor, [x + way[0] * kStep / columns, y + way[1] * kStep / rows]);
  } else if (way) cursor = [Math.min(rows, Math.max(0, cursor[0] + way[1])), Math.min(columns, Math.max(0, cursor[1] + way[0]))];
  else if (event.key === " " && !pins().has(keyOf(...cursor))) failed = !pin(...cursor, placeOf(...cursor));
  else if ([" ", "Delete", "Backspace"].includes(event.key)) free(...cursor);
  else return;
  event.preventDefault();  // nothing scrolls
  byKeys = true;
  ++version;
  if (!failed) said = placeWords(...cursor);
  changed();
}

// ---- what is seen of it ---------------------------------------------------------------------------------------------

function stroke(pen, points) {
  for (const [colour, width] of [["rgba(21, 24, 26, .75)", 4], ["#fff", 1.6]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
}

// Pinned: a square with a dark rim; the others are small dots.
function mark(pen, [x, y], held) {
  const half = held ? 7 : 2.5;
  pen.fillStyle = "#15181a";
  pen.fillRect(x - half - 2, y - half - 2, 2 * half + 4, 2 * half + 4);
  pen.fillStyle = held ? "#e69f00" : "#fff";
  pen.fillRect(x - half, y - half, 2 * half, 2 * half);
}

// Says of itself what it shows: data-grid, rows and columns; data-fine, whether it is the one of a plan; data-pinned, how many are.
function draw(canvas) {
  const key = `${version} ${byKeys}`;
  if (canvas.drawn_ === key) return;
  const {file, whole, crop, size} = wanted, part = crop || whole, scale = kShownPx / Math.max(part.width, part.height);
  const grid = gridOf();
  canvas.width = Math.round(part.width * scale);
  canvas.height = Math.round(part.height * scale);
  const pen = canvas.getContext("2d");
  for (const name of ["grid", "fine", "pinned"]) delete canvas.dataset[name];
  if (!drawPart(pen, file, crop, canvas.width, canvas.height)) return;
  canvas.drawn_ = key;
  const at = ([across, down_]) => [across * canvas.width, down_ * canvas.height];
  if (grid) for (const line of grid.lines) stroke(pen, line.map(([x, y]) => at([x / grid.width_mm, 1 - y / grid.height_mm])));
  // What is on its way: straight to the neighbours, until the cell tells how the lines run.
  if (hand && hand.moved) {
    pen.setLineDash([6, 6]);
    for (const [row, column] of [[hand.row - 1, hand.column], [hand.row + 1, hand.column], [hand.row, hand.column - 1], [hand.row, hand.column + 1]])
      if (row >= 0 && column >= 0 && row <= size.rows && column <= size.columns) stroke(pen, [at(placeOf(hand.row, hand.column)), at(placeOf(row, column))]);
    pen.setLineDash([]);
  }
  if (grid) for (let row = 0; row <= size.rows; ++row) for (let column = 0; column <= size.columns; ++column) if (!pins().has(keyOf(row, column))) mark(pen, at(placeOf(row, column)), false);
  for (const place of pins().values()) mark(pen, at(place), true);
  if (byKeys || hand) {
    const [x, y] = at(placeOf(...cursor));
    for (const [colour, width] of [["#15181a", 7], ["#fff", 3]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      pen.arc(x, y, 17, 0, 2 * Math.PI);
      pen.stroke();
    }
  }
  if (grid && live.isThere()) Object.assign(canvas.dataset, {grid: `${grid.rows}x${grid.columns}`, fine: String(live.isFine())});
  canvas.dataset.pinned = pins().size;
}

export function linesDrawn(place) {
  if (wanted) for (const canvas of place.querySelectorAll("canvas.lines")) draw(canvas);
}

const elsewhere = (file) => [...pinned.keys()].filter((name) => name.startsWith(`${pictureKey(file)} `) && !(wanted && wanted.name === name)).length;

// `file`: that is chosen; null: none.
export function lineControls(file) {
  if (!file) return null;
  if (!wanted) return elsewhere(file) > 0 && h("p.dim", {id: "lines-idle"}, t("lines.idle"));
  const fault = live.fault(), coming = !fault && !live.isThere(), finer = !coming && !fault && !live.isFine();
  return h("div", {id: "lines", "data-key": "lines", "aria-busy": coming ? "true" : "false"},
    h("h3", {}, t("lines")), h("p.dim", {}, t("lines.about")), h("p.dim.keys", {id: "lines-keys"}, t("lines.keys")),
    h("canvas.lines", {"data-keep": "", "data-key": "lines-canvas", tabindex: 0, role: "application", "aria-label": t("lines.map"), "aria-describedby": "lines-keys",
      onkeydown: keyed, onfocus: (event) => { if (event.currentTarget.matches(":focus-visible")) { byKeys = true; draw(event.currentTarget); } },
      onblur: (event) => { byKeys = false; if (wanted) draw(event.currentTarget); },
      onpointerdown: down, onpointermove: move, onpointerup: up, onpointercancel: up, ondblclick: double}),
    !fault && h("p.dim", {role: "status", id: "lines-state"}, t(coming ? "lines.coming" : finer ? "lines.finer" : "lines.done")),
    h("p.dim", {role: "status", id: "lines-said"}, said),
    fault && h("p.fault", {}, "▲ ", cellSays(asSentence(fault)), " ", button(t("lines.again"), () => { ++version; live.again(); changed(); })),
    elsewhere(file) > 0 && !pins().size && h("p.warn", {}, `▲ ${t("lines.elsewhere")}`),
    pins().size > 0 && h("div.commands", {}, button(t("lines.free_all", {n: pins().size}), freeAll, {id: "lines-free"})));
}
