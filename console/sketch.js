// The sketch that follows a form: how the picture would about look in the wood. One is drawn at a time, of what is
// wanted by then; the last one stays until the next is there, and none comes after one that was asked for later.
// Squares follow a hand; where the plan has other pieces, these are drawn once nothing else is asked for (`fine`).
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {ask} from "./link.js";
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
let shown = null;     // {file, key, fineKey: of the plan's own pieces, "" of squares, url, sketch, patch_mm: as it was asked for}
let refused = null;   // {key, sentence}
let declined = "";    // fineKey of pieces that the cell would not draw: squares stay
let drawing = null;   // {fine, giveUp}
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
// than squares; `fine`: what these depend on, {query, suits: which size of the picture does}, or null where the cell cannot draw them.
export function wantSketch(file, query, crop, wood, {bent = false, fine = null} = {}) {
  if (!file || !picture || picture.file !== file) return;
  const key = `${query} ${crop ? Object.values(crop) : ""} ${wood}`, fineKey = fine ? `${key} ${fine.query}` : "";
  if (wanted && wanted.file === file && wanted.key === key && wanted.bent === bent && wanted.fineKey === fineKey) return;
  wanted = {file, query, crop, key, bent, fine, fineKey};
  if (drawing && drawing.fine) drawing.giveUp.abort();  // what is wanted at once goes before
  clearTimeout(timer);
  timer = setTimeout(drawNext, kSettleMs);
}

const isDone = (of) => [shown, refused].some((one) => one && one.file === of.file && one.key === of.key);

// Whether one that follows the form is being drawn, or will be at once.
export const isSketching = () => Boolean((drawing && !drawing.fine) || (wanted && !isDone(wanted)));

// Whether squares are shown of what is wanted, and its own pieces may still come.
const mayBeFiner = () => Boolean(wanted && wanted.fine && shown && shown.file === wanted.file && shown.key === wanted.key && shown.fineKey !== wanted.fineKey && declined !== wanted.fineKey);

async function drawNext() {
  if (drawing || !wanted) return;
  const asked = wanted, fine = isDone(asked), mine = {fine, giveUp: new AbortController()};
  if (fine && !mayBeFiner()) return;
  drawing = mine;
  changed();
  try {
    const {blob: body, pixels} = await smallPicture(asked, fine ? asked.fine.suits : undefined);
    const query = new URLSearchParams(fine ? asked.fine.query : asked.query);
    // What is sent is cropped already, unless the browser could not.
    if (asked.crop && !pixels) query.set("crop", [asked.crop.x, asked.crop.y, asked.crop.width, asked.crop.height].join(","));
    if (fine) query.set("fine", "1");
    const sketch = await ask("POST", `/api/v1/plans/sketch?${query}`, {body, timeoutMs: kPatienceMs, until: mine.giveUp.signal});
    if (fine ? asked === wanted : asked.file === wanted.file) show(asked, sketch, fine);
  } catch (fault) {
    if (!fine) refused = {file: asked.file, key: asked.key, sentence: fault.message};
    else if (fault.status === 503) timer = setTimeout(drawNext, kFullMs);
    else if (asked === wanted) declined = asked.fineKey;
    if (fine && fault.status === 503) { drawing = null; return changed(); }
  }
  drawing = null;
  changed();
  drawNext();
}

function show(asked, sketch, fine) {
  const bytes = Uint8Array.from(atob(sketch.preview_jpeg), (one) => one.charCodeAt(0));
  const before = shown;
  shown = {file: asked.file, key: asked.key, url: URL.createObjectURL(new Blob([bytes], {type: "image/jpeg"})), sketch: {...sketch, preview_jpeg: ""},
           fineKey: fine ? asked.fineKey : "", patch_mm: Number(asked.query.get("patch_mm"))};
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
  const mine = shown && shown.file === file ? shown : null;
  const fault = !old && refused && wanted && refused.file === file && refused.key === wanted.key ? refused.sentence : "";
  const coming = !old && (isSketching() || mayBeFiner());
  return h("section.card.sketch", {class: [large && "large", mine && (old || fault) && "old"].filter(Boolean).join(" "), "aria-label": t("sketch"), "aria-busy": coming ? "true" : "false"}, h("h2", {}, t("sketch")),
    h("div.sketch-place", {},
      mine && h("img", {id: "sketch-picture", src: mine.url, alt: t("sketch.picture"), "data-pieces": mine.sketch.pieces}),
      h("p.sketch-sign", {role: "status"}, coming ? `… ${t(mine ? "sketch.newer" : "sketch.coming")}` : "")),
    (old || (mine && fault)) && h("p.fault", {id: "sketch-old"}, "▲ ", mine && t("sketch.before"), " ", old && h("span.sketch-why", {}, old)),
    fault && h("p.fault", {}, "▲ ", cellSays(asSentence(fault)), " ", button(t("sketch.again"), () => { refused = null; drawNext(); })),
    mine && figures(mine, !old && wordsOfPieces(mine)),
    mine && button(t(large ? "sketch.smaller" : "sketch.bigger"), () => { large = !large; changed(); }, {id: "sketch-size", "aria-expanded": String(large)}),
    h("p.dim", {}, t("sketch.rough")));
}

// Where the plan has other pieces than what is shown.
function wordsOfPieces(mine) {
  if (!wanted || wanted.file !== mine.file || !wanted.bent || (mine.fineKey && mine.fineKey === wanted.fineKey)) return "";
  if (mine.fineKey) return mayBeFiner() ? "" : "sketch.before";
  return mayBeFiner() ? "sketch.pieces_coming" : "sketch.in_squares";
}

const figures = ({sketch, patch_mm}, squares) => h("div.sketch-figures", {},
  h("p", {}, [`${Math.round(sketch.width_mm)} × ${Math.round(sketch.height_mm)} mm`, t("pieces", {n: sketch.pieces}), t("sketch.likeness", {likeness: sketch.likeness.toFixed(2)}),
              sketch.cutting_s ? t("sketch.minutes", {minutes: Math.max(1, Math.round(sketch.cutting_s / 60))}) : ""].filter(Boolean).join(", ")),
  squares && h("p.dim", {id: "sketch-squares"}, t(squares)),
  sketch.unfilled > 0 && h("p", {}, `▲ ${t("sketch.short", {n: sketch.unfilled})}`),
  sketch.patch_mm > 1.001 * patch_mm && h("p.dim", {}, t("sketch.larger", {patch: sketch.patch_mm.toFixed(1)})),
  ...sketch.left_out.map((sentence) => h("p.dim", {}, cellSays(asSentence(sentence)))));
