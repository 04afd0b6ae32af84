// Pictures are asked for as this console, not as anybody's <img>: a crowd of anonymous clients does not take its place.
// Two at a time, so that nothing stands before STOP.
import {h} from "./dom.js";
import {headersOf, untilStop} from "./link.js";

const kAtOnce = 2;
let underWay = 0;
const waiting = [];

// An <img> of what is at `path` of the API. `version` changes when it is another picture; it stays away until it is there.
export const picture = (path, alt, {version = "", ...attributes} = {}) =>
    h("img", {"data-picture": path, "data-version": version, alt, hidden: true, ...attributes});

// What a screen is drawn with is let go of when it is drawn without; `place` of the page, once it was put.
const held = new Set();
const release = (image) => { if (image.src.startsWith("blob:")) URL.revokeObjectURL(image.src); held.delete(image); };
function releaseGone() {
  for (const image of held) if (!image.isConnected) release(image);
}

// A URL that whoever asked revokes; "" when none comes.
export async function pictureUrl(path) {
  if (underWay >= kAtOnce) await new Promise((turn) => waiting.push(turn));
  ++underWay;
  try {
    const reply = await fetch(`/api/v1${path}`, {cache: "no-cache", headers: headersOf({}), signal: untilStop()});
    return reply.ok ? URL.createObjectURL(await reply.blob()) : "";
  } catch (fault) {
    return "";
  } finally {
    --underWay;
    if (waiting.length > 0) waiting.shift()();
  }
}

// Whether this very picture is to be seen: an <img> keeps its last one until the next is there.
export const isShown = (image, path) => Boolean(image && !image.hidden && image.came_ === path && image.complete && image.naturalWidth > 0);

// After a screen was put: fetches what is new on it. The last picture stays until the next is there.
export function loadPictures(place) {
  releaseGone();
  for (const image of place.querySelectorAll("img[data-picture]")) load(image);
}

async function load(image) {
  const {picture: path, version} = image.dataset;
  const wanted = `${path} ${version}`;
  if (image.loading_ === wanted) return;
  if (image.path_ !== path) image.hidden = true;
  image.loading_ = wanted;
  image.path_ = path;
  const url = path ? await pictureUrl(path) : "";
  // Another one was wanted meanwhile, or the screen was left.
  if (image.loading_ !== wanted || !image.isConnected) return url && URL.revokeObjectURL(url);
  if (!url) return setTimeout(() => { if (image.loading_ === wanted) image.loading_ = ""; }, 5000);
  release(image);
  held.add(image);
  image.src = url;
  image.came_ = path;
  image.hidden = false;
}
