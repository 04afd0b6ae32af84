// The bed as it is seen last: by a look, with what it found drawn in, or, while a picture of the bed is on the screen and
// nothing else needs the camera, by glances, so that it moves. Each is as old as it is said to be.
import {h} from "./dom.js";
import {ago, t} from "./words.js";
import {headersOf, pause, untilStop} from "./link.js";
import {changed, model} from "./model.js";
import {empty} from "./parts.js";

const kEveryMs = 2000, kStaleMs = 10000;
const kNoneMs = 20000;      // where there is no picture to be had now
const kLookStaysMs = 8000;  // what a look has outlined is to be read
const kSeenMs = 1500;       // screens are drawn twice a second

const shown = {url: "", of: "", at: 0, since: 0};  // at: when it was taken, in ms of performance.now(); 0: nobody knows
let before = "";         // its successor may still be on its way to the screen
let etag = "";           // of the last glance
let looks = -1;          // how many looks were fetched
let fetching = 0;        // looks on their way to the page
let drawnAt = -Infinity, goes = false;

function show(blob, of, at) {
  URL.revokeObjectURL(before);
  before = shown.url;
  Object.assign(shown, {url: URL.createObjectURL(blob), of, at, since: performance.now()});
  changed();
}

const ask = (path, headers, more = {}) => fetch(`/api/v1${path}`, {headers: headersOf(headers), signal: untilStop(), ...more});

async function fetchLook() {
  const mine = looks = model.bedLooks, at = model.bedAt;
  ++fetching;
  try {
    const reply = await ask("/bed.jpg", {}, {cache: "no-cache"});
    const blob = reply.ok && await reply.blob();
    // None is there yet, or the next one is.
    if (blob && mine === looks && !(shown.of === "glance" && at < shown.at)) show(blob, "look", at);
  } catch (fault) { if (mine === looks) setTimeout(() => { if (mine === looks) looks = -1; }, kEveryMs); } finally { --fetching; }
}

// How long to wait until the next one.
async function fetchGlance() {
  const asked = shown.url;
  try {
    const reply = await ask("/bed/glance.jpg", etag && shown.of === "glance" ? {"If-None-Match": etag} : {}, {cache: "no-store"});
    const at = performance.now() - 1000 * (Number(reply.headers.get("Age")) || 0);
    if (reply.status === 503) return kNoneMs;
    if (lookCame()) return kEveryMs;
    if (reply.status === 304 && shown.url === asked) shown.at = at;
    if (!reply.ok) return kEveryMs;
    const blob = await reply.blob();
    if (lookCame()) return kEveryMs;
    if (shown.of === "look" && at < shown.at) return kEveryMs;  // a look was taken meanwhile
    etag = reply.headers.get("ETag");
    show(blob, "glance", at);
  } catch (fault) { /* its age tells */ }
  return kEveryMs;
}

const isSeen = () => !document.hidden && performance.now() - drawnAt < kSeenMs;
const lookStays = () => shown.of === "look" && shown.at > 0 && performance.now() - shown.since < kLookStaysMs;
const lookCame = () => fetching > 0 || looks !== model.bedLooks || lookStays();

async function go() {
  if (goes) return;
  goes = true;
  while (isSeen()) {
    const may = model.cell && model.cell.may_be_watched && !lookCame();
    await pause(may ? await fetchGlance() : kEveryMs);
  }
  goes = false;
}

// `part` of the picture is shown, {left, top, side} in fractions of it; `over` lies over that. To be drawn again as long
// as somebody sees it.
export function bedView(none, part = null, ...over) {
  drawnAt = performance.now();
  if (looks !== model.bedLooks) fetchLook();
  go();
  const age = performance.now() - shown.at, stale = Boolean(shown.url) && (!shown.at || age > kStaleMs);
  return [
    h("div.view", {class: stale ? "stale" : "", "data-bed": shown.of}, h("img", {alt: t("bed.alt"), src: shown.url || null, hidden: !shown.url, part}), empty(none), ...over),
    shown.url && h("p.age", {class: stale ? "" : "dim"}, stale ? `▲ ${shown.at ? t("bed.old", {age: ago(age)}) : t("bed.before")}` : t("bed.now", {age: ago(age)}))];
}
