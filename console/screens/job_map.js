// The picture that fills up with what is cut, as a canvas of one job.
import {h} from "../dom.js";
import {t} from "../words.js";
import {changed, model, piecesOf} from "../model.js";
import {kAgainMs} from "../link.js";
import {pictureUrl} from "../pictures.js";

const kWidth = 720;
const kKept = 4;  // pictures that were looked at last
const kGone = ["scrap", "released", "unfilled"];
const previews = new Map();  // by job and plan: an Image, on its way or there

function previewOf(job) {
  const known = jobPlan(job);
  const key = `${job} ${known}`;
  if (!previews.has(key)) {
    const image = new Image();
    previews.set(key, image);
    if (previews.size > kKept) previews.delete(previews.keys().next().value);
    const isSeen = () => Boolean(document.querySelector(`canvas.job-map[data-job="${job}"]`));
    pictureUrl(`/jobs/${job}/preview.png?width=${kWidth}`, isSeen).then((url) => {
      if (!url) return isSeen() ? setTimeout(() => previews.delete(key), kAgainMs) : previews.delete(key);
      image.onload = image.onerror = () => { URL.revokeObjectURL(url); changed(); };  // it is read
      image.src = url;
    });
  }
  return previews.get(key);
}
const jobPlan = (id) => { const job = model.jobs.find((one) => one.id === id); return job ? job.newest_plan : 0; };

export function boxOf(pieces) {
  const box = {left: Infinity, right: -Infinity, low: Infinity, high: -Infinity};
  for (const piece of pieces) {
    for (const [x, y] of piece.artwork_outline_mm || []) {
      box.left = Math.min(box.left, x); box.right = Math.max(box.right, x);
      box.low = Math.min(box.low, y); box.high = Math.max(box.high, y);
    }
  }
  return box.right > box.left && box.high > box.low ? box : null;
}

export const jobMap = (job) => h("canvas.job-map", {"data-keep": "", "data-key": `map-${job}`, "data-job": job, role: "img", "aria-label": t("job.map")});

export const jobKey = () => h("p.key.dim", {}, ...["done", "open", "now", "suspect", "missing"].map((one) => [h(`i.key-${one}`), t(`key.${one}`)]));

function trace(pen, piece, scale, box) {
  pen.beginPath();
  for (const [x, y] of piece.artwork_outline_mm || []) pen.lineTo((x - box.left) * scale, (box.high - y) * scale);
  pen.closePath();
}

function hatch(pen) {
  const tile = document.createElement("canvas");
  tile.width = tile.height = 10;
  const ink = tile.getContext("2d");
  ink.fillStyle = "#e69f00";
  ink.fillRect(0, 0, 10, 10);
  ink.strokeStyle = "#15181a";
  ink.lineWidth = 3;
  ink.beginPath();
  for (const start of [-10, 0, 10]) { ink.moveTo(start, 10); ink.lineTo(start + 10, 0); }
  ink.stroke();
  return pen.createPattern(tile, "repeat");
}

// The plan's preview; what is not cut yet is veiled.
export function drawJobMap(place) {
  const canvas = place.querySelector("canvas.job-map");
  if (!canvas) return;
  const job = Number(canvas.dataset.job);
  const pieces = piecesOf(job);
  const preview = previewOf(job);
  const current = model.cell.job && model.cell.job.id === job ? model.cell.job.current_piece : null;
  const key = `${preview.src}${preview.complete}${current}${pieces.map((piece) => piece.state).join("")}`;
  if (canvas.drawn_ === key) return;
  canvas.drawn_ = key;
  const box = boxOf(pieces);
  canvas.hidden = !box;
  if (!box) return;
  const scale = kWidth / (box.right - box.left);
  canvas.width = kWidth;
  canvas.height = Math.round((box.high - box.low) * scale);
  const pen = canvas.getContext("2d");
  if (preview.complete && preview.naturalWidth > 0) pen.drawImage(preview, 0, 0, canvas.width, canvas.height);
  const suspect = hatch(pen);
  for (const piece of pieces) {
    if (piece.state === "cut") continue;
    trace(pen, piece, scale, box);
    pen.fillStyle = piece.state === "suspect" ? suspect : kGone.includes(piece.state) ? "#15181a" : "rgba(216, 218, 219, 0.78)";
    pen.fill();
    pen.strokeStyle = "rgba(90, 96, 100, 0.5)";
    pen.lineWidth = 1;
    pen.stroke();
  }
  const now = pieces.find((piece) => piece.mark === current);
  if (!now) return;
  trace(pen, now, scale, box);
  pen.strokeStyle = "#15181a";
  pen.lineWidth = 6;
  pen.stroke();
}
