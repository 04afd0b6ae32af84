// The cells of a mosaic over the part of a picture that is wanted, and the curves that somebody draws for them to lie along: in one stroke,
// or from corner to corner by taps. Rough cells come within a moment, those of a plan once nothing else is asked for. Curves are of the
// picture, whatever part of it is wanted, and stay with it while another one is looked at.
import {h, svg} from "./dom.js";
import {asSentence, t} from "./words.js";
import {changed} from "./model.js";
import {button, cellSays} from "./parts.js";
import {brushKey} from "./brush_keys.js";
import {drawPart, pictureKey, smallPicture} from "./sketch.js";
import {hasCountsOf, sizeOf} from "./grid_lines.js";
import {liveLines} from "./live_lines.js";
import {distance, simplified} from "./strokes.js";

const kShownPx = 720;
const kNearPx = 26;          // of a screen: how far beside a curve, or a corner, a finger may come down
const kMovedPx = 5;          // of a screen: a finger that went farther has drawn
const kSeen = .002;          // of the longer side of what is shown: what a curve may be moved by
const kStep = .025;          // of what is shown, by an arrow
const kMostPoints = 400;     // that are sent; the planner takes 600, and a request's head has an end
const kMostCurves = 120, kMostBefore = 50, kMostPictures = 8;
const kWhole = 10000;        // of a side, as curves are sent

const pictures = new Map();  // by picture: {name, curves, open: one whose corners are being tapped, or null, instead, before}; points in its pixels
let wanted = null;           // {file, part: {x, y, width, height}, crop, query, sent: curves as the planner takes them, key, name}
let of = null, mine = null;  // the file that is chosen; what is kept of it, of `pictures`, or of the one before
let left = "";               // the picture that had curves before this one
let tool = "draw";
let hand = null;             // what a finger does: {points, from: [x, y], moved, erases}
let cross = [.5, .5];        // where the keyboard's crosshair stands, of what is shown
let byKeys = false, said = "", version = 0, changes = 0;
const live = liveLines("/plans/mosaic", {request: requestOf, waits: () => Boolean(hand), came: () => { ++version; }});

const isCurve = (one) => Boolean(one && one.length > 1);
const all = () => [...mine.curves, ...(isCurve(mine.open) ? [mine.open] : [])];  // a corner alone is no curve

// As wantPaint() (picture_brush.js); `query`: what else a plan would be asked for; null: with another layout, no cells are wanted.
export function wantCells(file, whole, crop, query) {
  of = file && whole ? file : null;
  if (!of) { wanted = hand = null; live.want(null); return; }
  const key = pictureKey(file), other = pictures.get(key);
  if (!mine || mine.key !== key) {
    if (mine) left = all().length ? mine.name : "";
    mine = other || {key, name: file.name, curves: [], open: null, instead: false, before: []};
    pictures.delete(key);
    pictures.set(key, mine);  // the newest come last
    if (pictures.size > kMostPictures) pictures.delete(pictures.keys().next().value);
    hand = null;
    said = "";
    ++version;
  }
  if (!query) { wanted = hand = null; live.want(null); return; }
  const part = crop || {x: 0, y: 0, ...whole}, sent = sentCurves(part), name = `${key} ${Object.values(part)}`;
  wanted = {file, crop, part, query, sent, instead: mine.instead, name, key: `${query} ${name} ${sent} ${mine.instead}`};
  if (live.want(wanted)) ++version;
}

async function requestOf({file, crop, part, query, sent, instead}) {
  const shorter = Number(query.get("size_mm")), patch = Number(query.get("patch_mm"));
  const {blob, pixels} = await smallPicture({file, crop}, hasCountsOf(sizeOf(part, shorter, patch), shorter, patch));  // of another number cells are others
  if (!pixels) throw new Error(t("cells.unreadable"));
  const asked = new URLSearchParams(query);
  tell(asked, sent, instead);
  return {query: asked, body: blob};
}

// ---- what a plan is told --------------------------------------------------------------------------------------------

function tell(query, sent, instead) {
  if (!sent) return;
  query.set("flow_lines", sent);
  if (instead) query.set("flow_lines_only", "1");
}
export function curvesInto(query) {
  if (wanted) tell(query, sentCurves(wanted.part), mine.instead);  // what was drawn just now, too
}

// Whether cells are on their way, or a finger draws: a sketch of the plan's own pieces waits.
export const linesMove = () => Boolean(wanted) && (Boolean(hand) || live.areComing());

// What of a way lies within 0 to 1 of both sides, from `from` to `to` of it (Liang and Barsky's); null: nothing.
function within([x, y], [x2, y2]) {
  let from = 0, to = 1;
  for (const [at, way] of [[x, x2 - x], [y, y2 - y]]) {
    if (way === 0) {
      if (at < 0 || at > 1) return null;
      continue;
    }
    const one = -at / way, other = (1 - at) / way;
    [from, to] = [Math.max(from, Math.min(one, other)), Math.min(to, Math.max(one, other))];
  }
  return from < to ? [from, to] : null;
}

// The pieces of a curve, points as shares of the part, that lie on it.
function clipped(points) {
  const out = [];
  let last = null;  // the piece that goes on
  for (let i = 1; i < points.length; ++i) {
    const [a, b] = [points[i - 1], points[i]], lies = within(a, b), at = (share) => [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
    if (!lies) { last = null; continue; }
    if (!last || lies[0] > 0) out.push(last = [at(lies[0])]);
    last.push(at(lies[1]));
    if (lies[1] < 1) last = null;
  }
  return out;
}

// Of shares, as long as it looks on a square.
const wayOf = (line) => line.slice(1).reduce((sum, [x, y], i) => sum + Math.hypot(x - line[i][0], y - line[i][1]), 0);
function halfWay(line) {
  let left = wayOf(line) / 2, i = 1;
  for (; i < line.length - 1 && left > wayOf(line.slice(i - 1, i + 1)); ++i) left -= wayOf(line.slice(i - 1, i + 1));
  const [[x, y], [x2, y2]] = [line[i - 1], line[i]], share = left / (wayOf([line[i - 1], line[i]]) || 1);
  return [x + share * (x2 - x), y + share * (y2 - y)];
}

// In ten-thousandths of the part's sides from its upper left corner; "": none lies on it. With fewer points where there would be too many.
function sentCurves(part) {
  const longer = Math.max(part.width, part.height), ways = all();
  for (let tolerance = 0; ; tolerance = Math.max(1.5 * tolerance, kSeen * longer)) {
    const lines = ways.flatMap((way) => clipped((tolerance ? simplified(way, tolerance) : way).map(([x, y]) => [(x - part.x) / part.width, (y - part.y) / part.height])));
    if (lines.reduce((sum, line) => sum + line.length, 0) > kMostPoints && tolerance < longer) continue;
    return lines.map((line) => line.map(([x, y]) => `${Math.round(kWhole * x)},${Math.round(kWhole * y)}`).join(" ")).join(";");
  }
}

// ---- the finger -----------------------------------------------------------------------------------------------------

function remember() {
  mine.before.push({curves: mine.curves, open: mine.open});
  if (mine.before.length > kMostBefore) mine.before.shift();
}

// A new list each time, so that those of before stay as they were.
const become = (curves, open) => { Object.assign(mine, {curves, open}); ++version; ++changes; };

// ---- what is kept of them -------------------------------------------------------------------------------------------

// As keptPaint(), restorePaint() and the others (picture_brush.js).
export const curvesVersion = () => changes;
const isDrawn = ({curves, open}) => curves.length > 0 || Boolean(open);
export const keptCurves = () => [...pictures.values()].filter(isDrawn).map(({key, name, curves, open, instead}) => ({key, name, curves, open, instead}));

const isLine = (line) => Array.isArray(line) && line.length > 0 && line.every((point) => Array.isArray(point) && point.length === 2 && point.every(Number.isFinite));
export function restoreCurves(all) {
  for (const {key, name, curves, open, instead} of all) {
    if (!Array.isArray(curves) || !curves.every(isLine) || (open && !isLine(open))) continue;
    const known = pictures.get(key);
    if (!known) pictures.set(key, {key, name, curves, open, instead: Boolean(instead), before: []});
    else if (!isDrawn(known)) Object.assign(known, {curves, open, instead: Boolean(instead)});
  }
  ++version;
}

export function forgetCurves() {
  pictures.clear();
  wanted = of = mine = hand = null;
  live.want(null);
  left = said = "";
  tool = "draw";
  ++version;
  ++changes;
}

// `goesOn`: the open one is part of it.
function add(curve, goesOn) {
  const others = goesOn ? mine.curves : all();
  if (others.length >= kMostCurves) { said = t("cells.enough", {n: kMostCurves}); return; }
  remember();
  become([...others, curve], null);
  said = t("cells.count", {n: mine.curves.length});
}

function endOpen() {
  if (!mine.open) return;
  remember();
  become(all(), null);
  said = t("cells.count", {n: mine.curves.length});
}

// Whether it is the last corner of the open one; `near`: how far from it that is so, in pixels of the picture.
const isLast = ([x, y], near) => Boolean(mine.open) && mine.open.slice(-1).some(([x2, y2]) => Math.hypot(x2 - x, y2 - y) <= near);

// `ends`: the last one again ends the curve.
function corner(point, near, ends = true) {
  const {open} = mine;
  if (isLast(point, near)) { if (ends && isCurve(open)) endOpen(); return; }
  if (!open && mine.curves.length >= kMostCurves) { said = t("cells.enough", {n: kMostCurves}); return; }
  remember();
  become(mine.curves, [...(open || []), point]);
  said = t("cells.corner", {n: mine.open.length});
}

const away = (curve, point) => Math.min(...curve.slice(1).map((to, i) => distance(point, curve[i], to)));

function erase(point, near) {
  const ways = all(), found = ways.map((curve) => ({curve, far: away(curve, point)})).sort((a, b) => a.far - b.far)[0];
  if (!found || found.far > near) return false;
  remember();
  become(mine.curves.filter((one) => one !== found.curve), found.curve === mine.open ? null : mine.open);
  if (!all().length) tool = "draw";  // nothing is left to erase
  said = t("cells.erased");
  return true;
}

function placed(event) {
  const box = event.currentTarget.getBoundingClientRect(), {part} = wanted;
  return {point: [part.x + (event.clientX - box.left) / box.width * part.width, part.y + (event.clientY - box.top) / box.height * part.height], near: kNearPx * part.width / box.width};
}

function down(event) {
  if (event.button !== 0 || !event.isPrimary || !wanted) return;
  event.currentTarget.setPointerCapture(event.pointerId);
  byKeys = false;
  const {point, near} = placed(event);
  hand = {points: [point], from: [event.clientX, event.clientY], moved: false, erases: tool === "erase"};
  if (hand.erases && !erase(point, near)) said = t("cells.nothing");
  ++version;
  changed();
}

function move(event) {
  if (!hand || !wanted || !event.isPrimary || !event.currentTarget.hasPointerCapture(event.pointerId)) return;
  const {point, near} = placed(event);
  if (hand.erases) {
    if (erase(point, near)) changed();
    return;
  }
  if (!hand.moved && Math.hypot(event.clientX - hand.from[0], event.clientY - hand.from[1]) < kMovedPx) return;
  hand.moved = true;
  hand.points.push(point);
  ++version;
  draw(event.currentTarget);
}

function up(event) {
  if (!event.isPrimary || !hand || !wanted) return;
  const {points, moved, erases} = hand, {near} = placed(event), {part} = wanted;
  hand = null;
  if (event.type === "pointerup" && !erases) {
    const goesOn = isLast(points[0], near);
    if (moved) add(simplified(goesOn ? [...mine.open, ...points] : points, kSeen * Math.max(part.width, part.height)), goesOn);
    else corner(points[0], near);
  }
  ++version;
  changed();
}

// ---- the keyboard ---------------------------------------------------------------------------------------------------

// With the tool that erases, which stays when the last curve goes: the next key of a hand that erases on its way draws nothing.
function eraseByKey(point, near, quietly) {
  if (!erase(point, near) && !quietly) said = t("cells.nothing");
  tool = "erase";
}

function keyed(event) {
  if (!wanted || event.ctrlKey || event.altKey || event.metaKey) return;
  const {part} = wanted, key = brushKey(event), here = () => [part.x + cross[0] * part.width, part.y + cross[1] * part.height], near = kStep / 2 * Math.min(part.width, part.height);
  byKeys = true;
  if (key) {
    const goes = key.across || key.down;
    const act = (ends) => (tool === "erase" ? eraseByKey(here(), 3 * near, goes) : corner(here(), near, ends));
    if (key.paints) act(!goes);
    cross = [[cross[0], key.across], [cross[1], key.down]].map(([at, way]) => Math.min(1, Math.max(0, at + way * kStep)));
    if (key.paints && goes) act(false);
    if (!key.paints) said = t("cells.at", {across: Math.round(100 * cross[0]), down: Math.round(100 * cross[1])});
  } else if (event.key === "Enter") endOpen();
  else if (event.key === "Delete" || event.key === "Backspace") { if (!erase(here(), 3 * near)) said = t("cells.nothing"); }
  else return;
  event.preventDefault();  // nothing scrolls, and no form is sent
  ++version;
  changed();
}

// ---- what is seen of it ---------------------------------------------------------------------------------------------

// All of these in two strokes: light with a dark rim, seen on any picture.
function stroke(pen, lines, colours) {
  pen.lineJoin = pen.lineCap = "round";
  for (const [colour, width] of colours) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    for (const line of lines) line.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
}
const kOfCells = [["rgba(21, 24, 26, .7)", 3.4], ["#fff", 1.4]], kOfCurves = [["#15181a", 14], ["#fff", 11], ["#e69f00", 7]], kOfMarks = [["#15181a", 8], ["#fff", 4]];

function disc(pen, [x, y], radius, colour) {
  for (const [fill, more] of [["#15181a", 5], ["#fff", 3], [colour, 0]]) {
    pen.fillStyle = fill;
    pen.beginPath();
    pen.arc(x, y, radius + more, 0, 2 * Math.PI);
    pen.fill();
  }
}

// Says of itself what it shows: data-cells, how many; data-fine, whether those of a plan; data-curves, how many curves.
function draw(canvas) {
  const key = `${version} ${byKeys} ${tool}`;
  if (canvas.drawn_ === key) return;
  const {file, crop, part} = wanted, scale = kShownPx / Math.max(part.width, part.height), cells = live.told();
  canvas.width = Math.max(1, Math.round(part.width * scale));
  canvas.height = Math.max(1, Math.round(part.height * scale));
  const pen = canvas.getContext("2d");
  for (const name of ["cells", "fine", "curves"]) delete canvas.dataset[name];
  if (!drawPart(pen, file, crop, canvas.width, canvas.height)) return;
  canvas.drawn_ = key;
  const shareOf = ([x, y]) => [(x - part.x) / part.width, (y - part.y) / part.height], onCanvas = ([x, y]) => [x * canvas.width, y * canvas.height];
  const at = (point) => onCanvas(shareOf(point));
  if (cells) stroke(pen, cells.lines.map((line) => line.map(([x, y]) => [x / cells.width_mm * canvas.width, (1 - y / cells.height_mm) * canvas.height])), kOfCells);
  stroke(pen, all().map((curve) => curve.map(at)), kOfCurves);
  if (hand && hand.moved) stroke(pen, [hand.points.map(at)], kOfCurves);
  for (const point of mine.open || []) disc(pen, at(point), 8, "#e69f00");
  if (mine.open) disc(pen, at(mine.open[mine.open.length - 1]), 12, "#005f94");  // that goes on from here, or ends
  if (tool === "erase") for (const curve of all()) {
    const [seen] = clipped(curve.map(shareOf)).sort((a, b) => wayOf(b) - wayOf(a));
    if (!seen) continue;
    const [x, y] = onCanvas(halfWay(seen)), far = 8;
    disc(pen, [x, y], 16, "#fff");
    stroke(pen, [[[x - far, y - far], [x + far, y + far]], [[x - far, y + far], [x + far, y - far]]], [["#15181a", 5]]);
  }
  if (byKeys) {
    const [x, y] = [cross[0] * canvas.width, cross[1] * canvas.height];
    stroke(pen, [[[x, 0], [x, canvas.height]], [[0, y], [canvas.width, y]]], [["#15181a", 6], ["#fff", 2]]);
  }
  if (cells && live.isThere()) Object.assign(canvas.dataset, {cells: cells.cells, fine: String(live.isFine())});
  canvas.dataset.curves = all().length;
}

export function cellsDrawn(place) {
  if (wanted) for (const canvas of place.querySelectorAll("canvas.cells")) draw(canvas);
}

const act = (does) => () => { does(); ++version; changed(); };
const glyph = (...paths) => svg("svg.glyph", {viewBox: "0 0 32 24", "aria-hidden": "true"}, ...paths.map(([kind, d]) => svg("path", {class: kind, d})));
const kCurve = "M3 19C10 19 12 5 29 5";
const kEdge = "M3 8C12 8 14 20 29 20";
const kGlyphs = {
  draw: glyph.bind(null, ["bold", kCurve]), erase: glyph.bind(null, ["bold", kCurve], ["thin", "M11 7L21 17M21 7L11 17"]),
  beside: glyph.bind(null, ["thin", kEdge], ["bold", kCurve]), instead: glyph.bind(null, ["dashed", kEdge], ["bold", kCurve]),
};
const choice = (name, chosen, does, more = {}) => h("button.with-glyph", {type: "button", id: `cells-${name}`, "aria-pressed": String(chosen), onclick: act(does), ...more}, kGlyphs[name](), t(`cells.${name}`));

// Three cells in a row, as long and as wide.
export function aspectGlyph(aspect) {
  const [long, wide] = [11 * Math.sqrt(aspect), 11 / Math.sqrt(aspect)];
  return svg("svg.glyph.aspect", {viewBox: "0 0 72 16", "aria-hidden": "true"}, ...[-1, 0, 1].map((at) => svg("rect", {class: "thin", x: 36 + (at - .5) * long, y: 8 - wide / 2, width: long, height: wide})));
}

// `among`: whether the layout that is wanted has cells. `aspect`: a slider for their shape.
export function cellControls(among, aspect) {
  if (!among) return of && mine && all().length > 0 && h("p.dim", {id: "cells-idle"}, t("cells.idle"));
  if (!wanted) return aspect;  // it is sent all the same
  const fault = live.fault(), coming = !fault && !live.isThere(), finer = !coming && !fault && !live.isFine(), count = all().length;
  const state = coming ? t("cells.coming") : t(finer ? "cells.finer" : "cells.done", {n: (live.told() || {}).cells});
  return h("div", {id: "cells", "data-key": "cells", "aria-busy": coming ? "true" : "false"},
    h("h3", {}, t("cells")), h("p.dim", {}, t("cells.about")), h("p.dim.keys", {id: "cells-keys"}, t("cells.keys")),
    left && !count && h("p.warn", {}, `▲ ${t("cells.left", {name: left})}`),
    count > 0 && !wanted.sent && h("p.warn", {id: "cells-outside"}, `▲ ${t("cells.outside")}`),
    h("canvas.cells", {"data-keep": "", "data-key": "cells-canvas", tabindex: 0, role: "application", "aria-label": t("cells.map"), "aria-describedby": "cells-keys",
      onkeydown: keyed, onfocus: (event) => { if (event.currentTarget.matches(":focus-visible")) { byKeys = true; draw(event.currentTarget); } },
      onblur: (event) => { byKeys = false; if (wanted) draw(event.currentTarget); },
      onpointerdown: down, onpointermove: move, onpointerup: up, onpointercancel: up}),
    !fault && h("p.dim", {role: "status", id: "cells-state"}, state),
    h("p.dim", {role: "status", id: "cells-said"}, said),
    fault && h("p.fault", {}, "▲ ", cellSays(asSentence(fault)), " ", button(t("lines.again"), act(() => live.again()))),
    h("div.choices", {role: "group", "aria-label": t("cells.tool")},
      choice("draw", tool === "draw", () => { tool = "draw"; }), choice("erase", tool === "erase", () => { endOpen(); tool = "erase"; }, {disabled: !count && tool === "draw"})),
    h("div.commands", {},
      mine.open && button(t("cells.end"), act(endOpen), {id: "cells-end"}),
      button(t("cells.undo"), act(() => { const {curves, open} = mine.before.pop(); become(curves, open); said = ""; }), {id: "cells-undo", disabled: !mine.before.length}),
      button(t("cells.none"), act(() => { remember(); become([], null); said = ""; tool = "draw"; }), {id: "cells-none", disabled: !count && !mine.open})),
    count > 0 && h("div.choices", {role: "group", "aria-label": t("cells.edges")},
      choice("beside", !mine.instead, () => { mine.instead = false; ++changes; }), choice("instead", mine.instead, () => { mine.instead = true; ++changes; })),
    aspect);
}
