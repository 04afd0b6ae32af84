// Which edges of the picture a grid with morphed lines follows, painted over it with a finger: all of them, or not those
// that are veiled. A coarse mask for large structures and one for fine edges, together or each on its own.
import {h} from "./dom.js";
import {t} from "./words.js";
import {changed} from "./model.js";
import {button} from "./parts.js";
import {drawPart} from "./sketch.js";

const kCells = 48;    // along the longer side
const kShownPx = 720;
const kSizes = {small: 1, middle: 2.5, large: 6};  // radius, in cells
const kBoth = ["large_edges", "fine_edges"];

let of = "";          // the picture and its part: another one begins anew
let part = null;      // {file, crop, width, height of the mask}
let masks = {};       // by name: Uint8Array, 1 where edges count
let before = [];      // masks as they were before each stroke
let which = "both", counts = false, size = "middle";
let last = null, version = 0;

const names = () => (which === "both" ? kBoth : [which]);
const all = (value) => new Uint8Array(part.width * part.height).fill(value);
const copy = () => Object.fromEntries(kBoth.map((name) => [name, masks[name].slice()]));

// `crop`: {x, y, width, height} in pixels, or null for all of `whole`.
export function wantEdges(file, whole, crop) {
  const shape = crop || whole;
  const key = file && shape ? `${file.name} ${file.size} ${file.lastModified} ${Object.values(shape)}` : "";
  if (key === of) return;
  of = key;
  before = [];
  ++version;
  if (!key) { part = null; return; }
  const scale = kCells / Math.max(shape.width, shape.height);
  part = {file, crop, width: Math.max(1, Math.round(shape.width * scale)), height: Math.max(1, Math.round(shape.height * scale))};
  masks = Object.fromEntries(kBoth.map((name) => [name, all(1)]));
}

// As the planner's parameters; nothing where all edges count.
export function edgesInto(query) {
  if (!part) return;
  for (const name of kBoth) {
    if (masks[name].every((one) => one)) continue;
    let hex = "";
    for (let i = 0; i < masks[name].length; i += 4) {
      let digit = 0;
      for (let bit = 0; bit < 4; ++bit) digit = 2 * digit + (masks[name][i + bit] || 0);
      hex += digit.toString(16);
    }
    query.set(name, `${part.width}x${part.height}:${hex}`);
  }
}

// ---- the finger -----------------------------------------------------------------------------------------------------

function dab(x, y) {
  const radius = kSizes[size];
  for (let row = Math.max(0, Math.floor(y - radius)); row < Math.min(part.height, y + radius); ++row)
    for (let column = Math.max(0, Math.floor(x - radius)); column < Math.min(part.width, x + radius); ++column)
      if (Math.hypot(column + .5 - x, row + .5 - y) <= radius) for (const name of names()) masks[name][row * part.width + column] = counts ? 1 : 0;
}

function paint(event) {
  const box = event.currentTarget.getBoundingClientRect();
  const x = (event.clientX - box.left) / box.width * part.width, y = (event.clientY - box.top) / box.height * part.height;
  const from = last || [x, y], steps = Math.max(1, Math.ceil(2 * Math.hypot(x - from[0], y - from[1])));
  for (let step = 1; step <= steps; ++step) dab(from[0] + (x - from[0]) * step / steps, from[1] + (y - from[1]) * step / steps);
  last = [x, y];
  ++version;
  draw(event.currentTarget);
}

function begin(event) {
  if (event.button !== 0 || !event.isPrimary) return;
  event.currentTarget.setPointerCapture(event.pointerId);
  before.push(copy());
  last = null;
  paint(event);
  changed();
}
const move = (event) => { if (event.isPrimary && event.currentTarget.hasPointerCapture(event.pointerId)) paint(event); };

// ---- what is seen of it ---------------------------------------------------------------------------------------------

function draw(canvas) {
  const key = `${of} ${version} ${which}`;
  if (canvas.drawn_ === key) return;
  canvas.drawn_ = key;
  const scale = kShownPx / Math.max(part.width, part.height);
  canvas.width = Math.round(part.width * scale);
  canvas.height = Math.round(part.height * scale);
  const pen = canvas.getContext("2d");
  drawPart(pen, part.file, part.crop, canvas.width, canvas.height);
  const [wide, high] = [canvas.width / part.width, canvas.height / part.height];
  for (let row = 0; row < part.height; ++row)
    for (let column = 0; column < part.width; ++column) {
      const off = names().filter((name) => !masks[name][row * part.width + column]).length;
      if (!off) continue;
      pen.fillStyle = off === names().length ? "rgba(21, 24, 26, .78)" : "rgba(21, 24, 26, .45)";
      pen.fillRect(column * wide, row * high, wide + .5, high + .5);
      // Not by shade alone: a dark picture is as dark.
      pen.fillStyle = "#e69f00";
      pen.fillRect((column + .5) * wide - 1, (row + .5) * high - 1, 2, 2);
    }
}

export function edgesDrawn(place) {
  const canvas = place.querySelector("canvas.edges");
  if (canvas && part) draw(canvas);
}

const set = (act) => () => { act(); ++version; changed(); };
const choices = (label, options, is, take) => h("div.choices", {role: "group", "aria-label": label}, ...options.map((one) =>
  h("button", {type: "button", "aria-pressed": String(is === one), "data-choice": one, onclick: set(() => take(one))}, t(`edges.${one}`))));

export function edgeControls() {
  if (!part) return null;
  return h("details", {id: "edges"}, h("summary", {}, t("edges")),
    h("p.dim", {}, t("edges.about")),
    h("canvas.edges", {"data-keep": "", "data-key": "edges", role: "img", "aria-label": t("edges.map"), onpointerdown: begin, onpointermove: move}),
    choices(t("edges.kind"), ["both", ...kBoth], which, (one) => { which = one; }),
    choices(t("edges.does"), ["off", "on"], counts ? "on" : "off", (one) => { counts = one === "on"; }),
    choices(t("edges.size"), Object.keys(kSizes), size, (one) => { size = one; }),
    h("div.commands", {},
      button(t("edges.undo"), set(() => { masks = before.pop(); }), {id: "edges-undo", disabled: !before.length}),
      button(t("edges.all"), set(() => { before.push(copy()); for (const name of names()) masks[name] = all(1); }), {id: "edges-all"}),
      button(t("edges.none"), set(() => { before.push(copy()); for (const name of names()) masks[name] = all(0); counts = true; }), {id: "edges-none"})));
}
