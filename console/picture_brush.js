// What somebody paints over a picture with a finger, or by keyboard: which of its edges a grid with morphed lines follows (all of them, or
// not those that are veiled: of large shapes, fine ones, or both), where the cells of a mosaic are small or large, and what in it matters
// (background, figure, detail).
// What is painted is of the picture, whatever part of it is wanted, and stays with it while another one is looked at.
import {h, svg} from "./dom.js";
import {t} from "./words.js";
import {changed} from "./model.js";
import {button} from "./parts.js";
import {brushKey} from "./brush_keys.js";
import {drawPart, pictureKey} from "./sketch.js";

const kStored = 192;   // cells along a picture's longer side, of what is kept
const kShownPx = 720;
const kSizes = {small: 1, middle: 3, large: 8};  // radius, in cells that are sent
const kMostBefore = 50, kMostPictures = 8;
// layout: the only one that heeds it; sent: cells along a part's longer side, at most; layers: masks that are painted on, of values that
// begin as `usual`; uneven: one tone says nothing, and is not sent.
const kBrushes = {
  edges: {layout: "morph", sent: 64, layers: ["large_edges", "fine_edges"], usual: 1, bits: 1, values: {off: 0, on: 1}},
  sizes: {layout: "mosaic", sent: 48, layers: ["cell_sizes"], usual: 8, bits: 4, values: {background: 0, figure: 8, detail: 15}, uneven: true},
  matters: {sent: 48, layers: ["importance"], usual: 8, bits: 4, values: {background: 3, figure: 8, detail: 15}},
};

const pictures = new Map();  // by file: {name, width, height in cells, masks by layer: Uint8Array; before: by brush, as they were before each stroke}
let file = null, whole = null;  // that is painted on; its size in pixels
let painted = null;  // of `pictures`
let part = null;     // of the picture, in cells that are kept: {x, y, width, height}; crop: the same in pixels
let left = "";       // the picture that was painted on before this one
const hand = {edges: {layer: "both", value: "off", size: "middle"}, sizes: {layer: "both", value: "detail", size: "middle"}, matters: {layer: "both", value: "detail", size: "middle"}};
let last = null, version = 0, changes = 0;

const layersOf = (brush) => (hand[brush].layer === "both" ? kBrushes[brush].layers : [hand[brush].layer]);
const filled = (brush, value) => new Uint8Array(painted.width * painted.height).fill(value);
const hasPaint = (brush, one = painted) => kBrushes[brush].layers.some((layer) => one.masks[layer].some((value) => value !== kBrushes[brush].usual));

// What is painted on now; `crop`: {x, y, width, height} in pixels, or null for all of `shape`. Without a file, or while
// nobody knows its size, nothing is; what was painted stays.
export function wantPaint(wanted, shape, crop) {
  if (!wanted || !shape) { part = null; return; }
  if (file !== wanted) {
    if (painted && pictureKey(file) !== pictureKey(wanted)) left = Object.keys(kBrushes).some((brush) => hasPaint(brush)) ? painted.name : "";
    [file, whole] = [wanted, shape];
    const key = pictureKey(wanted);
    painted = pictures.get(key) || blank(wanted, shape);
    pictures.delete(key);
    pictures.set(key, painted);  // the newest come last
    if (pictures.size > kMostPictures) pictures.delete(pictures.keys().next().value);
    ++version;
  }
  const across = painted.width / whole.width, down = painted.height / whole.height, {x, y, width, height} = crop || {x: 0, y: 0, ...whole};
  const now = {x: x * across, y: y * down, width: width * across, height: height * down, crop};
  if (!part || JSON.stringify(part) !== JSON.stringify(now)) ++version;
  part = now;
}

function blank(of, shape) {
  const scale = kStored / Math.max(shape.width, shape.height);
  const one = {name: of.name, width: Math.max(1, Math.round(shape.width * scale)), height: Math.max(1, Math.round(shape.height * scale)), masks: {}, before: {}};
  for (const [brush, {layers, usual}] of Object.entries(kBrushes)) {
    one.before[brush] = [];
    for (const layer of layers) one.masks[layer] = new Uint8Array(one.width * one.height).fill(usual);
  }
  return one;
}

function gridOf(brush) {
  const scale = Math.min(1, kBrushes[brush].sent / Math.max(part.width, part.height));
  return {columns: Math.max(1, Math.round(part.width * scale)), rows: Math.max(1, Math.round(part.height * scale))};
}

// A mask of the part as it is sent: the mean of what is kept of each cell.
function sent(brush, layer) {
  const {columns, rows} = gridOf(brush), mask = painted.masks[layer], out = new Uint8Array(columns * rows);
  const span = (at, count, from, length, most) => {
    const begin = Math.min(most - 1, Math.floor(from + at * length / count + .5));
    return [begin, Math.max(begin + 1, Math.min(most, Math.floor(from + (at + 1) * length / count + .5)))];
  };
  for (let row = 0; row < rows; ++row) {
    const [top, bottom] = span(row, rows, part.y, part.height, painted.height);
    for (let column = 0; column < columns; ++column) {
      const [begin, end] = span(column, columns, part.x, part.width, painted.width);
      let sum = 0;
      for (let y = top; y < bottom; ++y) for (let x = begin; x < end; ++x) sum += mask[y * painted.width + x];
      out[row * columns + column] = Math.round(sum / ((bottom - top) * (end - begin)));
    }
  }
  return out;
}

const isOne = (mask) => mask.every((value) => value === mask[0]);

// As the planner's parameters, of what `layout` heeds ("": no more than squares do); nothing where nothing is painted.
export function paintInto(query, layout) {
  if (!part) return;
  for (const [brush, {layout: heeds = layout, layers, usual, bits, uneven}] of Object.entries(kBrushes)) {
    if (heeds !== layout) continue;
    const {columns, rows} = gridOf(brush);
    for (const layer of layers) {
      const mask = sent(brush, layer);
      if (isOne(mask) && (uneven || mask[0] === usual)) continue;
      let hex = "";
      for (let i = 0; i < mask.length; i += 4 / bits) {
        let digit = 0;
        for (let at = i; at < i + 4 / bits; ++at) digit = digit * 2 ** bits + (mask[at] || 0);
        hex += digit.toString(16);
      }
      query.set(layer, `${columns}x${rows}:${hex}`);
    }
  }
}

// ---- what is kept of it ---------------------------------------------------------------------------------------------

// Another number, other paint by a hand.
export const paintVersion = () => changes;
const isPainted = (one) => Object.keys(kBrushes).some((brush) => hasPaint(brush, one));
// All pictures that something is painted on, the newest last.
export const keptPaint = () => [...pictures].filter(([, one]) => isPainted(one)).map(([key, {name, width, height, masks}]) => ({key, name, width, height, masks}));

// As keptPaint() gave it, be it long ago. What somebody has painted meanwhile stays.
export function restorePaint(all) {
  for (const {key, name, width, height, masks} of all) {
    if (!Object.values(kBrushes).every(({layers}) => layers.every((layer) => masks[layer] instanceof Uint8Array && masks[layer].length === width * height))) continue;
    const known = pictures.get(key);
    if (!known) pictures.set(key, {name, width, height, masks, before: Object.fromEntries(Object.keys(kBrushes).map((brush) => [brush, []]))});
    else if (!isPainted(known) && known.width === width && known.height === height) Object.assign(known.masks, masks);
  }
  ++version;
}

export function forgetPaint() {
  pictures.clear();
  file = whole = painted = part = null;
  left = "";
  ++version;
  ++changes;
}

// ---- the finger -----------------------------------------------------------------------------------------------------

// At a place of the whole picture, in the cells that are kept.
function dab(brush, x, y, radius) {
  const value = kBrushes[brush].values[hand[brush].value];
  for (let row = Math.max(0, Math.floor(y - radius)); row < Math.min(painted.height, y + radius); ++row)
    for (let column = Math.max(0, Math.floor(x - radius)); column < Math.min(painted.width, x + radius); ++column)
      if (Math.hypot(column + .5 - x, row + .5 - y) <= radius) for (const layer of layersOf(brush)) painted.masks[layer][row * painted.width + column] = value;
}

const radiusOf = (brush) => Math.max(.75, kSizes[hand[brush].size] * part.width / gridOf(brush).columns);

// `across`, `down`: of what is shown, from 0 to 1.
function paintTo(brush, canvas, across, down) {
  const radius = radiusOf(brush), x = part.x + across * part.width, y = part.y + down * part.height;
  const from = last || [x, y], steps = Math.max(1, Math.ceil(4 * Math.hypot(x - from[0], y - from[1]) / radius));
  for (let step = 1; step <= steps; ++step) dab(brush, from[0] + (x - from[0]) * step / steps, from[1] + (y - from[1]) * step / steps, radius);
  last = [x, y];
  ++version;
  ++changes;
  draw(canvas);
}

function paint(brush, event) {
  if (!part) return;
  const box = event.currentTarget.getBoundingClientRect();
  paintTo(brush, event.currentTarget, (event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
}

function remember(brush) {
  const before = painted.before[brush];
  before.push(Object.fromEntries(kBrushes[brush].layers.map((layer) => [layer, painted.masks[layer].slice()])));
  if (before.length > kMostBefore) before.shift();
}

const holds = (event) => event.isPrimary && event.currentTarget.hasPointerCapture(event.pointerId);
function begin(brush, event) {
  if (event.button !== 0 || !event.isPrimary || !part) return;
  event.currentTarget.setPointerCapture(event.pointerId);
  byKeys = "";
  remember(brush);
  last = null;
  paint(brush, event);
}

// ---- the keyboard ---------------------------------------------------------------------------------------------------

const cross = {edges: [.5, .5], sizes: [.5, .5], matters: [.5, .5]};  // where it stands, of what is shown
const said = {edges: "", sizes: "", matters: ""};
let byKeys = "";                                     // the brush whose crosshair is seen

function keyed(brush, event) {
  const key = part && brushKey(event);
  if (!key) return;
  const canvas = event.currentTarget, {columns, rows} = gridOf(brush), step = Math.max(1, kSizes[hand[brush].size] / 2);
  const to = ([at, way, cells]) => Math.min(1 - .5 / cells, Math.max(.5 / cells, at + way * step / cells));
  if (key.paints) {
    if (!event.repeat) remember(brush);
    last = null;
    paintTo(brush, canvas, ...cross[brush]);
  }
  byKeys = brush;
  cross[brush] = [[cross[brush][0], key.across, columns], [cross[brush][1], key.down, rows]].map(to);
  if (key.paints) paintTo(brush, canvas, ...cross[brush]);
  said[brush] = placeWords(brush, key.paints);
  draw(canvas);
  changed();
}

function placeWords(brush, painted_) {
  const {columns, rows} = gridOf(brush), [across, down] = cross[brush];
  const values = layersOf(brush).map((layer) => sent(brush, layer)[Math.floor(down * rows) * columns + Math.floor(across * columns)]);
  const nearest = Object.entries(kBrushes[brush].values).sort(([, a], [, b]) => Math.abs(a - Math.min(...values)) - Math.abs(b - Math.min(...values)))[0][0];
  const place = {across: Math.round(100 * across), down: Math.round(100 * down), what: t(`${brush}.${painted_ ? hand[brush].value : nearest}`)};
  return t(painted_ ? "paint.done" : "paint.at", place);
}

// Light with a dark rim: seen on any picture.
function drawCross(pen, brush, wide, high) {
  const [x, y] = [cross[brush][0] * wide, cross[brush][1] * high], radius = radiusOf(brush) / part.width * wide;
  for (const [colour, width] of [["#15181a", 6], ["#fff", 2]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(x, 0); pen.lineTo(x, high);
    pen.moveTo(0, y); pen.lineTo(wide, y);
    pen.moveTo(x + radius, y); pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.stroke();
  }
}

// ---- what is seen of it ---------------------------------------------------------------------------------------------

// Says of itself what it shows: data-painted, how many of its cells; nothing before the picture is there.
function draw(canvas) {
  const {brush} = canvas.dataset, key = `${version} ${hand[brush].layer} ${byKeys === brush ? [...cross[brush], hand[brush].size] : ""}`;
  if (canvas.drawn_ === key) return;
  const {columns, rows} = gridOf(brush), scale = kShownPx / Math.max(columns, rows);
  canvas.width = Math.round(columns * scale);
  canvas.height = Math.round(rows * scale);
  const pen = canvas.getContext("2d");
  delete canvas.dataset.painted;
  if (!drawPart(pen, file, part.crop, canvas.width, canvas.height)) return;
  canvas.drawn_ = key;
  const {usual, uneven} = kBrushes[brush], masks = layersOf(brush).map((layer) => sent(brush, layer));
  let count = 0;
  for (let row = 0; row < rows; ++row)
    for (let column = 0; column < columns; ++column) {
      const values = masks.map((mask) => mask[row * columns + column]);
      const less = values.filter((value) => value < usual).length;
      if (values.every((value) => value === usual)) continue;
      ++count;
      if (uneven) tiles(pen, row, column, canvas.width / columns, canvas.height / rows, values[0]);
      else cell(pen, column * canvas.width / columns, row * canvas.height / rows, canvas.width / columns, canvas.height / rows, less, less === values.length);
    }
  canvas.dataset.painted = count;
  if (byKeys === brush) drawCross(pen, brush, canvas.width, canvas.height);
}

// Veiled with a dot, or lit with a cross: not by shade alone, since a dark picture is as dark.
function cell(pen, x, y, wide, high, less, all) {
  pen.fillStyle = !less ? "rgba(255, 255, 255, .38)" : all ? "rgba(21, 24, 26, .78)" : "rgba(21, 24, 26, .45)";
  pen.fillRect(x, y, wide + .5, high + .5);
  pen.fillStyle = less ? "#e69f00" : "#005f94";
  const [middle, centre] = [x + wide / 2, y + high / 2];
  if (less) return pen.fillRect(middle - 1, centre - 1, 2, 2);
  pen.fillRect(middle - 3, centre - 1, 6, 2);
  pen.fillRect(middle - 1, centre - 3, 2, 6);
}

// Small squares or large ones, as cells will be: neither shade nor words are needed. The larger, the darker.
function tiles(pen, row, column, wide, high, value) {
  const across = value > 8 ? .5 : value > 3 ? 2 : 4, [x, y] = [column * wide, row * high];
  pen.fillStyle = value > 8 ? "rgba(255, 255, 255, .34)" : "rgba(21, 24, 26, .5)";
  pen.fillRect(x, y, wide + .5, high + .5);
  pen.fillStyle = value > 8 ? "#005f94" : "#e69f00";
  for (let step = 0; step < 1; step += across) {
    if (across < 1 || column % across === 0) pen.fillRect(x + step * wide - .75, y, 1.5, high + .5);
    if (across < 1 || row % across === 0) pen.fillRect(x, y + step * high - .75, wide + .5, 1.5);
  }
}

// A square in as many small ones as the value means.
function sizeGlyph(value) {
  const count = {background: 1, figure: 2, detail: 4}[value], at = [...Array(count + 1).keys()].map((line) => 2 + line * 20 / count);
  return svg("svg.glyph", {viewBox: "0 0 24 24", "aria-hidden": "true"}, svg("path", {class: "thin", d: at.map((line) => `M${line} 2V22M2 ${line}H22`).join("")}));
}

export function paintDrawn(place) {
  if (part) for (const canvas of place.querySelectorAll("canvas.paint")) draw(canvas);
}

const set = (act) => () => { act(); ++version; changed(); };
const repaint = (act) => set(() => { act(); ++changes; });
const choices = (brush, what, options, words, glyph = null) => h("div.choices", {role: "group", "aria-label": t(`paint.${what}`)}, ...options.map((one) =>
  h("button.with-glyph", {type: "button", "aria-pressed": String(hand[brush][what] === one), "data-choice": one, onclick: set(() => { hand[brush][what] = one; })}, glyph && glyph(one), t(`${words}.${one}`))));

function controls(brush, ...more) {
  if (!part) return null;
  const {layers, values, usual, uneven} = kBrushes[brush], {before} = painted, masks = hasPaint(brush) ? layers.map((layer) => sent(brush, layer)) : [];
  const outside = hasPaint(brush) && masks.every((mask) => mask.every((value) => value === usual)), even = hasPaint(brush) && !outside && uneven && masks.every(isOne);
  return h("details", {id: brush}, h("summary", {}, t(brush)),
    h("p.dim", {}, t(`${brush}.about`)),
    left && !hasPaint(brush) && h("p.warn", {}, `▲ ${t("paint.left", {name: left})}`),
    outside && h("p.warn", {}, `▲ ${t("paint.outside")}`),
    even && h("p.warn", {id: `${brush}-even`}, `▲ ${t(`${brush}.even`)}`),
    h("p.dim.keys", {id: `${brush}-keys`}, t("paint.keys")),
    h("canvas.paint", {"data-keep": "", "data-key": brush, "data-brush": brush, tabindex: 0, role: "application", "aria-label": t(`${brush}.map`), "aria-describedby": `${brush}-keys`,
      onkeydown: (event) => keyed(brush, event), onfocus: (event) => { if (event.currentTarget.matches(":focus-visible")) { byKeys = brush; draw(event.currentTarget); } },
      onblur: (event) => { byKeys = ""; if (part) draw(event.currentTarget); },
      onpointerdown: (event) => begin(brush, event), onpointermove: (event) => { if (holds(event)) paint(brush, event); }, onpointerup: changed}),
    h("p.dim", {role: "status", id: `${brush}-said`}, said[brush]),
    layers.length > 1 && choices(brush, "layer", ["both", ...layers], brush),
    choices(brush, "value", Object.keys(values), brush, uneven && sizeGlyph),
    choices(brush, "size", Object.keys(kSizes), "paint"),
    h("div.commands", {},
      button(t("paint.undo"), repaint(() => { Object.assign(painted.masks, before[brush].pop()); }), {id: `${brush}-undo`, disabled: !before[brush].length}),
      button(t(`${brush}.all`), repaint(() => { remember(brush); for (const layer of layersOf(brush)) painted.masks[layer] = filled(brush, usual); }), {id: `${brush}-all`}),
      ...more));
}

// `followed`: whether the layout follows edges at all.
export function edgeControls(followed) {
  if (!followed) return painted && part && hasPaint("edges") && h("p.dim", {id: "edges-idle"}, t("edges.idle"));
  return controls("edges", button(t("edges.none"), repaint(() => { remember("edges"); for (const layer of layersOf("edges")) painted.masks[layer] = filled("edges", 0); hand.edges.value = "on"; }), {id: "edges-none"}));
}
export const matterControls = () => controls("matters");
export function sizeControls(among) {
  return among ? controls("sizes") : painted && part && hasPaint("sizes") && h("p.dim", {id: "sizes-idle"}, t("sizes.idle"));
}
