// The sketch that follows a form: how the picture would about look in the wood. One is drawn at a time, of what is
// wanted by then; the last one stays until the next is there, and none comes after one that was asked for later.
// Squares follow a hand; where the plan has other pieces, these are drawn once nothing else is asked for (`fine`).
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {ask, kAgainMs} from "./link.js";
import {changed} from "./model.js";
import {button, cellSays} from "./parts.js";

const kSettleMs = 120;      // a hand on a slider says many things a second
const kPatienceMs = 40000;  // the first sketch after wood has changed reads that wood whole
const kFullMs = 1500;       // until a cell that has no room for its own pieces is asked again
const kTries = 40;          // sizes, until one suits
export const kMostPictureBytes = 64 * 1024 * 1024;  // that the cell takes (kPictureBody, daemon/api/route_table.h)
const kSentSide = 640;      // pixels: a picture is sent as small as a sketch looks at it

let picture = null;   // {file, bitmap: null where the browser cannot read it}
let chosen = null;    // the file that was opened last: a large one may be read after a small one that came later
let wanted = null;    // {file, query, crop: {x, y, width, height} or null, key, bent, fine: {query, suits} or null, fineKey: "" without}
let squares = null;   // {file, key, url, sketch, patch_mm: as it was asked for}; another key: of before
let pieces = null;    // the plan's own, {file, fineKey, url, sketch, patch_mm}; never seen once another fineKey is wanted
let refused = null;   // {file, key, sentence}
let declined = null;  // {file, fineKey, sentence}: of pieces that the cell would not draw; squares stay
let waits = false;    // finer ones have to, for lines over the picture or for a run
let off = false;      // the latter: nobody knows how long
let held = 0;         // of what goes before, see alone()
let drawing = null;   // {fine, giveUp}; null as soon as it is given up
let timer = 0;
let large = false;    // on a narrow screen it is a strip at the foot, unless somebody wants it large

// The picture's size in pixels, once it is known; null where the browser cannot read it.
export const pictureSize = (file) => (picture && picture.file === file && picture.bitmap ? {width: picture.bitmap.width, height: picture.bitmap.height} : null);

// It is, or the browser cannot read it.
export const isOpened = (file) => Boolean(picture && picture.file === file);

// Which picture it is, by name and content, once it is opened; of one that is too large for the cell, or where a browser tells no digest,
// by when it was changed last.
const digests = new WeakMap();
export const pictureKey = (file) => `${file.name} ${file.size} ${digests.get(file) ?? file.lastModified}`;
async function digest(file) {
  if (file.size > kMostPictureBytes) return;  // it would lie in memory whole
  try {
    const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", await file.arrayBuffer()));
    digests.set(file, [...hash].map((byte) => byte.toString(16).padStart(2, "0")).join(""));
  } catch (fault) { /* as it is */ }
}

export async function openPicture(file) {
  if (picture && picture.bitmap) picture.bitmap.close();
  picture = null;
  chosen = file;
  if (!file) return;
  const [bitmap] = await Promise.all([createImageBitmap(file).catch(() => null), digest(file)]);
  if (chosen !== file) {
    if (bitmap) bitmap.close();
    return;
  }
  picture = {file, bitmap};
  changed();
}

// What is wanted now, of the wood that there is; cheap, so that a screen says it whenever it is drawn. `bent`: the plan has other pieces
// than squares; `fine`: what these depend on, {query, suits: which size of the picture does, pinned: of that size, the text of what is
// pinned}, or null where the cell cannot draw them. `wait`: they have to wait for lines over the picture; `run`: for a run.
export function wantSketch(file, query, crop, wood, {bent = false, fine = null, wait = false, run = false} = {}) {
  if (!file || !picture || picture.file !== file) return;
  const key = `${query} ${crop ? Object.values(crop) : ""} ${wood}`, fineKey = fine ? `${key} ${fine.query}` : "";
  const other = !wanted || wanted.file !== file || wanted.key !== key || wanted.bent !== bent || wanted.fineKey !== fineKey;
  const over = waits && !wait && !run;
  waits = wait || run;
  off = run;
  if (drawing && drawing.fine && (other || waits)) giveUp();  // what is wanted at once goes before
  if (!other && !over) return;
  if (other) wanted = {file, query, crop, key, bent, fine, fineKey};
  drawSoon(kSettleMs);
}

function drawSoon(ms) {
  clearTimeout(timer);
  timer = setTimeout(drawNext, ms);
}

function giveUp() {
  if (drawing) drawing.giveUp.abort();
  drawing = null;
}

// The cell takes two large bodies of one user at a time: while `send` runs no sketch is asked for, nor what else gives way.
const givers = [];
export const onAlone = (act) => givers.push(act);
export const isHeld = () => held > 0;
export async function alone(send) {
  ++held;
  giveUp();
  for (const act of givers) act();
  try { return await send(); } finally {
    --held;
    drawNext();
    changed();
  }
}

const areSquares = () => Boolean(squares && wanted && squares.file === wanted.file && squares.key === wanted.key);
const arePieces = () => Boolean(pieces && wanted && pieces.file === wanted.file && pieces.fineKey === wanted.fineKey);
const isRefused = () => Boolean(refused && wanted && refused.file === wanted.file && refused.key === wanted.key);
const isDone = () => areSquares() || arePieces() || isRefused();

// Whether one that follows the form is being drawn, or will be at once.
export const isSketching = () => Boolean((drawing && !drawing.fine) || (wanted && !isDone()));

const isDeclined = () => Boolean(declined && wanted && declined.file === wanted.file && declined.fineKey === wanted.fineKey);

// Whether squares are shown of what is wanted, and its own pieces may still come.
const mayBeFiner = () => Boolean(wanted && wanted.fine && areSquares() && !arePieces() && !isDeclined() && !off);

async function drawNext() {
  if (drawing || !wanted || held) return;
  const asked = wanted, fine = isDone(), mine = {fine, giveUp: new AbortController()};
  if (fine && (!mayBeFiner() || waits)) return;
  drawing = mine;
  changed();
  try {
    const {blob: body, pixels} = await smallPicture(asked, fine ? asked.fine.suits : undefined);
    if (drawing !== mine) return;
    const query = new URLSearchParams(fine ? asked.fine.query : asked.query);
    // What is sent is cropped already, unless the browser could not.
    if (asked.crop && !pixels) query.set("crop", [asked.crop.x, asked.crop.y, asked.crop.width, asked.crop.height].join(","));
    if (fine) query.set("fine", "1");
    if (fine && asked.fine.pinned && pixels) query.set("pinned_vertices", asked.fine.pinned(pixels));
    const sketch = await ask("POST", `/api/v1/plans/sketch?${query}`, {body, timeoutMs: kPatienceMs, until: mine.giveUp.signal});
    if (drawing !== mine) return;
    if (fine ? asked === wanted : asked.file === wanted.file) show(asked, sketch, fine);
  } catch (fault) {
    if (drawing !== mine) return;  // it was given up: whoever did that lets the timer ask
    const full = [429, 503].includes(fault.status);
    if (asked === wanted && (full || (fine && !fault.status))) {
      drawing = null;
      drawSoon(full ? kFullMs : kAgainMs);
      return changed();
    }
    if (full) { /* something newer is wanted */ }
    else if (!fine) refused = {file: asked.file, key: asked.key, sentence: fault.message};
    else if (fault.status) declined = {file: asked.file, fineKey: asked.fineKey, sentence: fault.message};
  }
  drawing = null;
  changed();
  drawNext();
}

function show(asked, sketch, fine) {
  const bytes = Uint8Array.from(atob(sketch.preview_jpeg), (one) => one.charCodeAt(0));
  const before = fine ? pieces : squares;
  const one = {file: asked.file, url: URL.createObjectURL(new Blob([bytes], {type: "image/jpeg"})), sketch: {...sketch, preview_jpeg: ""}, patch_mm: Number(asked.query.get("patch_mm"))};
  if (fine) pieces = {...one, fineKey: asked.fineKey};
  else squares = {...one, key: asked.key};
  refused = null;
  if (before) setTimeout(() => URL.revokeObjectURL(before.url), 1000);  // once the page shows the other
}

// -> {blob, pixels: {width, height}}: the part of the picture as it is sent, a little smaller yet where only that `suits`; the whole file
// (pixels: null) where the browser cannot read it.
export async function smallPicture({file, crop}, suits = () => true) {
  if (!picture || picture.file !== file || !picture.bitmap) return {blob: file, pixels: null};
  const {bitmap} = picture;
  const part = crop || {x: 0, y: 0, width: bitmap.width, height: bitmap.height}, longer = Math.max(part.width, part.height);
  const canvas = document.createElement("canvas");
  for (let side = Math.min(longer, kSentSide), tries = 0; tries < kTries; --side, ++tries) {
    canvas.width = Math.max(1, Math.round(part.width * side / longer));
    canvas.height = Math.max(1, Math.round(part.height * side / longer));
    if (suits(canvas)) break;
  }
  drawPart(canvas.getContext("2d"), file, crop, canvas.width, canvas.height);
  const blob = await new Promise((done) => canvas.toBlob(done, "image/jpeg", .92));
  return blob ? {blob, pixels: {width: canvas.width, height: canvas.height}} : {blob: file, pixels: null};
}

// The part of it as large as this; false where the browser cannot read it.
export function drawPart(pen, file, crop, width, height) {
  if (!picture || picture.file !== file || !picture.bitmap) return false;
  const part = crop || {x: 0, y: 0, width: picture.bitmap.width, height: picture.bitmap.height};
  pen.imageSmoothingQuality = "high";
  pen.fillStyle = "#fff";  // what is transparent is white to the planner too
  pen.fillRect(0, 0, width, height);
  pen.drawImage(picture.bitmap, part.x, part.y, part.width, part.height, 0, 0, width, height);
  return true;
}

// ---- what is seen of it ---------------------------------------------------------------------------------------------

// `old`: why none is drawn of what is typed now. The last one is another size's then, as it is when one was refused.
export function sketchCard(file, old = "") {
  if (!file) return null;
  const mine = arePieces() && pieces.file === file ? pieces : squares && squares.file === file ? squares : null;
  const fault = !old && isRefused() && refused.file === file ? refused.sentence : "";
  const coming = !old && (isSketching() || mayBeFiner());
  return h("section.card.sketch", {class: [large && "large", mine && (old || fault) && "old"].filter(Boolean).join(" "), "aria-label": t("sketch"), "aria-busy": coming ? "true" : "false"}, h("h2", {}, t("sketch")),
    h("div.sketch-place", {},
      mine && h("img", {id: "sketch-picture", src: mine.url, alt: t("sketch.picture"), "data-pieces": mine.sketch.pieces}),
      h("p.sketch-sign", {role: "status"}, coming ? `… ${t(mine ? "sketch.newer" : "sketch.coming")}` : "")),
    (old || (mine && fault)) && h("p.fault", {id: "sketch-old"}, "▲ ", mine && t("sketch.before"), " ", old && h("span.sketch-why", {}, old)),
    fault && h("p.fault", {}, "▲ ", cellSays(asSentence(fault)), " ", button(t("sketch.again"), () => { refused = null; drawNext(); })),
    mine && figures(mine, !old && wordsOfPieces(mine)),
    mine === squares && !old && isDeclined() && h("p.fault", {id: "sketch-declined"}, "▲ ", cellSays(asSentence(declined.sentence))),
    mine && button(t(large ? "sketch.smaller" : "sketch.bigger"), () => { large = !large; changed(); }, {id: "sketch-size", "aria-expanded": String(large)}),
    h("p.dim", {}, t("sketch.rough")));
}

// Where the plan has other pieces than what is shown.
function wordsOfPieces(mine) {
  if (mine === pieces || !wanted || wanted.file !== mine.file || !wanted.bent) return "";
  return mayBeFiner() ? "sketch.pieces_coming" : "sketch.in_squares";
}

const figures = ({sketch, patch_mm}, words) => h("div.sketch-figures", {},
  h("p", {}, [`${Math.round(sketch.width_mm)} × ${Math.round(sketch.height_mm)} mm`, t("pieces", {n: sketch.pieces}), t("sketch.likeness", {likeness: sketch.likeness.toFixed(2)}),
              sketch.cutting_s ? t("sketch.minutes", {minutes: Math.max(1, Math.round(sketch.cutting_s / 60))}) : ""].filter(Boolean).join(", ")),
  words && h("p.dim", {id: "sketch-squares"}, t(words)),
  sketch.unfilled > 0 && h("p", {}, `▲ ${t("sketch.short", {n: sketch.unfilled})}`),
  sketch.patch_mm > 1.001 * patch_mm && h("p.dim", {}, t("sketch.larger", {patch: sketch.patch_mm.toFixed(1)})),
  ...sketch.left_out.map((sentence) => h("p.dim", {}, cellSays(asSentence(sentence)))));
