// Pictures are asked for as this console, not as anybody's <img>: a crowd of anonymous clients does not take its place.
// Two at a time, so that nothing stands before STOP; what nobody will see any more is not fetched.
import {h} from "./dom.js";
import {headersOf, untilStop} from "./link.js";

const kAtOnce = 2;
const kNear = "300px";  // of the window's edge, where what is seen next is fetched already

// An <img> of what is at `path` of the API. `version` changes when it is another picture; it stays away until it is there.
// `whenSeen`: of a list that may be long, fetched only where it comes into sight.
export const picture = (path, alt, {version = "", whenSeen = false, ...attributes} = {}) =>
    h("img", {"data-picture": path, "data-version": version, "data-when-seen": whenSeen, alt, hidden: true, ...attributes});

// ---- one after the other --------------------------------------------------------------------------------------------

const waiting = [];          // {path, screen, isWanted, tell, giveUp}, in the order in which they were asked for
const underWay = new Set();  // of them
let screen = 0;

// A URL that whoever asked revokes; "" when none comes, or when it is not wanted any more before it came. `first`: it
// goes before those of any screen.
export function pictureUrl(path, isWanted = () => true, first = false) {
  return new Promise((tell) => {
    waiting.push({path, screen: first ? Infinity : screen, isWanted, tell, giveUp: new AbortController()});
    fetchNext();
  });
}

// Another screen is shown: what it asks for goes before what was asked for until then.
export function nextScreen() {
  ++screen;
  dropUnwanted();
}

export function dropUnwanted() {
  for (const one of waiting.filter(({isWanted}) => !isWanted())) {
    waiting.splice(waiting.indexOf(one), 1);
    one.tell("");
  }
  for (const one of underWay) if (!one.isWanted()) one.giveUp.abort();
  fetchNext();
}

function fetchNext() {
  while (underWay.size < kAtOnce && waiting.length > 0) {
    const next = waiting.reduce((best, one) => (one.screen > best.screen ? one : best));
    waiting.splice(waiting.indexOf(next), 1);
    if (next.isWanted()) fetchOne(next); else next.tell("");
  }
}

async function fetchOne(one) {
  underWay.add(one);
  const stopped = untilStop(), end = () => one.giveUp.abort();
  stopped.addEventListener("abort", end);
  let url = "";
  try {
    const reply = await fetch(`/api/v1${one.path}`, {cache: "no-cache", headers: headersOf({}), signal: one.giveUp.signal});
    if (reply.ok) url = URL.createObjectURL(await reply.blob());
  } catch (fault) { /* none comes */ }
  stopped.removeEventListener("abort", end);
  underWay.delete(one);
  one.tell(url);
  fetchNext();
}

// ---- those of the page ----------------------------------------------------------------------------------------------

// What a screen is drawn with is let go of when it is drawn without; `place` of the page, once it was put.
const held = new Set();
const release = (image) => { if (image.src.startsWith("blob:")) URL.revokeObjectURL(image.src); held.delete(image); };
function releaseGone() {
  for (const image of held) if (!image.isConnected) release(image);
  for (const around of watched) if (!around.isConnected) { sight.unobserve(around); watched.delete(around); }
  dropUnwanted();
}

// An image that is not there yet has no place of its own: what is around it is watched.
const watched = new Set(), inSight = new WeakSet();
const sight = new IntersectionObserver((told) => {
  for (const {target, isIntersecting} of told) {
    if (isIntersecting) inSight.add(target); else inSight.delete(target);
    if (isIntersecting) for (const image of target.querySelectorAll("img[data-when-seen]")) load(image);
  }
  dropUnwanted();
}, {rootMargin: kNear});

function isWanted(image) {
  if (!image.isConnected) return false;
  if (image.dataset.whenSeen === undefined) return true;
  if (!watched.has(image.parentElement)) { watched.add(image.parentElement); sight.observe(image.parentElement); }
  return inSight.has(image.parentElement);
}

// Whether this very picture is to be seen: an <img> keeps its last one until the next is there.
export const isShown = (image, path) => Boolean(image && !image.hidden && image.came_ === path && image.complete && image.naturalWidth > 0);

// After a screen was put: fetches what is new on it. The last picture stays until the next is there. `first`: of what
// stands on every screen.
export function loadPictures(place, first = false) {
  releaseGone();
  for (const image of place.querySelectorAll("img[data-picture]")) load(image, first);
}

async function load(image, first = false) {
  const {picture: path, version} = image.dataset;
  const wanted = `${path} ${version}`;
  if (image.loading_ === wanted) return;
  if (image.path_ !== path) image.hidden = true;
  image.path_ = path;
  if (!isWanted(image)) return void (image.loading_ = "");
  image.loading_ = wanted;
  const isStill = () => image.loading_ === wanted && isWanted(image);
  const url = path ? await pictureUrl(path, isStill, first) : "";
  // Another one was wanted meanwhile, or the screen was left.
  if (image.loading_ !== wanted || !image.isConnected) return url && URL.revokeObjectURL(url);
  const again = () => { if (image.loading_ === wanted) image.loading_ = ""; };
  if (!url) return isStill() ? setTimeout(again, 5000) : again();
  release(image);
  held.add(image);
  image.src = url;
  image.came_ = path;
  image.hidden = false;
}
