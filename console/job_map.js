// The picture that fills up with what is cut.
"use strict";

const map = {job: 0, pieces: [], preview: null, box: null, loading: false, again: false};

async function loadPieces() {
  const job = cell && cell.job;
  if (!job) return;
  if (map.loading) { map.again = true; return; }
  map.loading = true;
  try {
    if (map.job !== job.id) {
      map.preview = new Image();
      map.preview.onload = drawMap;
      renewPicture(map.preview, `/api/v1/jobs/${job.id}/preview.png?width=900`);
      map.job = job.id;
    }
    map.pieces = await askAll(`/api/v1/jobs/${job.id}/pieces`, "pieces");
    map.box = boxOf(map.pieces);
    show();
  } catch (fault) {
    // Tried again with the next piece.
  }
  map.loading = false;
  if (map.again) { map.again = false; setTimeout(loadPieces, 1000); }
}

function boxOf(pieces) {
  const box = {left: Infinity, right: -Infinity, low: Infinity, high: -Infinity};
  for (const piece of pieces) {
    for (const [x, y] of piece.artwork_outline_mm || []) {
      box.left = Math.min(box.left, x); box.right = Math.max(box.right, x);
      box.low = Math.min(box.low, y); box.high = Math.max(box.high, y);
    }
  }
  return box.right > box.left && box.high > box.low ? box : null;
}

function tracePiece(pen, piece, scale, box) {
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
function drawMap() {
  const job = cell && cell.job;
  const there = Boolean(job && map.job === job.id && map.box);
  $("job-map").hidden = $("job-key").hidden = !there;
  if (!there) return;
  const canvas = $("job-map");
  const scale = 900 / (map.box.right - map.box.left);
  canvas.width = 900;
  canvas.height = Math.round((map.box.high - map.box.low) * scale);
  const pen = canvas.getContext("2d");
  if (map.preview && map.preview.complete && map.preview.naturalWidth > 0) pen.drawImage(map.preview, 0, 0, canvas.width, canvas.height);
  const suspect = hatch(pen);
  let now = null;
  for (const piece of map.pieces) {
    if (piece.mark === job.current_piece) now = piece;
    if (piece.state === "cut") continue;
    tracePiece(pen, piece, scale, map.box);
    const missing = ["scrap", "released", "unfilled"].includes(piece.state);
    pen.fillStyle = piece.state === "suspect" ? suspect : missing ? "#15181a" : "rgba(216, 218, 219, 0.78)";
    pen.fill();
    pen.strokeStyle = "rgba(90, 96, 100, 0.5)";
    pen.lineWidth = 1;
    pen.stroke();
  }
  if (!now) return;
  tracePiece(pen, now, scale, map.box);
  pen.strokeStyle = "#15181a";
  pen.lineWidth = 6;
  pen.stroke();
}
