// A drawing that is burnt as it is, on the laser alone: its lines in their place, how each kind of them is burnt, run dark, then burnt.
// What is shown is what the cell has read of the file, and just that is sent to be burnt. Asked for with Settings only.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {ask, kSilent} from "../link.js";
import {askStatus, changed, followEvent, followStatus, isStale, model, operates} from "../model.js";
import {button, card, fact, facts, hint, cellSays, lacking} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf, written} from "../fields.js";
import {burnTicks} from "../ticks.js";
import {burns, followCorner, kDrawing} from "../burns.js";
import {isBusy, run, workAt} from "../work.js";

const kSettleMs = 300;     // a hand types several digits
const kReadMs = 40000;     // a dense drawing, while another is read
const kBeginMs = 60000;    // megabytes of strokes
const kPicturePx = 1200;   // of its longer side: a small drawing is seen as large as the bed
const kLeastLooks = 1e-3;  // mm, beside which a drawing has no size

let file = null;
let place = {x: "", y: ""};
let given = [];      // of each kind of line, as typed: {power, speed_mm_s, passes, air}
let shown = null;    // {file, query, told, picture}: what was read last
let refused = null;  // {file, query, sentence}; {..., lost: true}: the browser cannot read the file any more
let reading = false, timer = 0;
let begun = null;    // what was run last, dark or not, as it was shown: what came of it stands beside nothing else
let traced = null;   // {what, isOver, rest}: what is or was run dark, as it was shown, and how the cell came to rest after it

// ---- what is wanted -------------------------------------------------------------------------------------------------

const kRules = {power: {least: 0, most: 100, optional: true}, speed_mm_s: {least: .01, most: 1000, optional: true}, passes: {least: 1, most: 20, whole: true}};
const placeRules = (other) => ({least: -10000, most: 10000, optional: !place[other].trim()});

const kindName = ({layer, colour}) => [layer, colour].filter(Boolean).join(", ") || t("drawing.unnamed");
const fieldsOf = (kind, index) => Object.entries(kRules).map(([name, rules]) => ({label: `${kindName(kind)}, ${t(`recipe.${name}`)}`, text: given[index][name], rules}));
const kindsNow = () => (shown && shown.file === file && shown.told.kinds.length === given.length ? shown.told.kinds : []);
const fault = () => firstFault({label: t("drawing.x"), text: place.x, rules: placeRules("y")}, {label: t("drawing.y"), text: place.y, rules: placeRules("x")},
                               ...kindsNow().flatMap(fieldsOf));

function queryNow() {
  const query = new URLSearchParams();
  if (place.x.trim()) { query.set("x_mm", numberOf(place.x)); query.set("y_mm", numberOf(place.y)); }
  if (!given.length) return String(query);
  const list = (name, of) => query.set(name, given.map((one) => (String(one[name]).trim() ? of(one[name]) : "")).join(","));
  query.set("powers", given.map(({power}) => (power.trim() ? Number((numberOf(power) / 100).toPrecision(12)) : "")).join(","));
  query.set("speeds_mm_s", given.map(({speed_mm_s}) => (speed_mm_s.trim() ? numberOf(speed_mm_s) : "")).join(","));
  list("passes", numberOf);
  query.set("air", given.map(({air}) => (air ? 1 : 0)).join(","));
  return String(query);
}

// A field that was emptied is somebody's who means to say how this is burnt: no recipe is put in its place unseen.
const isWhole = ({power, speed_mm_s}) => Boolean(power.trim() && speed_mm_s.trim());
const isOf = (one, query) => Boolean(one && one.file === file && one.query === query);
const isCurrent = () => !fault() && isOf(shown, queryNow());
const typed = (power) => written(Number((100 * power).toPrecision(6)));
const asTyped = ({power, speed_mm_s, passes, air}) => ({power: power === null ? "" : typed(power), speed_mm_s: speed_mm_s === null ? "" : written(speed_mm_s), passes: String(passes), air});

function want() {
  clearTimeout(timer);
  timer = setTimeout(readNext, kSettleMs);
  changed();
}

function choose(chosen) {
  file = chosen;
  given = [];
  forget();
  want();
}

function forget() {
  if (shown) URL.revokeObjectURL(shown.picture);
  shown = refused = traced = null;
}

// A browser reads a file no more once another program has saved it anew.
async function isReadable(of) {
  try { await of.slice(0, 1).arrayBuffer(); } catch (fault) { return false; }
  return true;
}

// One at a time, of what is wanted by then.
async function readNext() {
  const query = file && !fault() ? queryNow() : "";
  if (reading || !file || fault() || !operates() || isOf(shown, query) || isOf(refused, query)) return;
  const of = {file, query};
  reading = true;
  changed();
  try {
    const told = await ask("POST", `/api/v1/laser/drawing?${query}`, {body: file, timeoutMs: kReadMs});
    if (of.file === file) {
      if (!Array.isArray(told.kinds)) throw new Error(kSilent);  // an answer that was cut off
      const picture = pictureOf(told);
      forget();
      shown = {...of, told, picture};
      if (!given.length) given = told.kinds.map(asTyped);
    }
  } catch (one) {
    const lost = !one.answered && !(await isReadable(of.file));
    if (of.file === file) { traced = null; refused = {...of, sentence: one.message, lost}; }
  }
  reading = false;
  changed();
  readNext();
}

// ---- how it lies ----------------------------------------------------------------------------------------------------

// Over the bed as it is seen from above, whole; lines in their own colours, with an edge that is seen on any ground.
function pictureOf({extent, travel, kinds, kind_of_stroke, points_mm, strokes}) {
  const boxes = [extent, travel].filter(Boolean);
  const [left, bottom] = [0, 1].map((axis) => Math.min(...boxes.map(({min_mm}) => min_mm[axis])));
  const [right, top] = [0, 1].map((axis) => Math.max(...boxes.map(({max_mm}) => max_mm[axis])));
  const wide = Math.max(right - left, kLeastLooks), high = Math.max(top - bottom, kLeastLooks), edge = .02 * Math.max(wide, high), px = kPicturePx / Math.max(wide, high);
  const paths = kinds.map(() => []);
  let at = 0;
  strokes.forEach((count, n) => {
    const points = [];
    for (const end = at + 2 * count; at < end; at += 2) points.push(`${points_mm[at]} ${points_mm[at + 1]}`);
    paths[kind_of_stroke[n]].push(`M${points.join("L")}`);
  });
  const bed = travel ? `<rect x="${travel.min_mm[0]}" y="${travel.min_mm[1]}" width="${travel.max_mm[0] - travel.min_mm[0]}" height="${travel.max_mm[1] - travel.min_mm[1]}" fill="#d9d4cb" stroke="#55595c"/>` : "";
  const line = (d, colour, width) => `<path d="${d}" stroke="${colour}" stroke-width="${width}"/>`;
  const drawn = paths.map((list) => list.join(""));
  const colours = kinds.map(({colour}) => (/^#[0-9a-f]{6}$/i.test(colour) ? colour : "#15181a"));
  const text = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="${left - edge} ${-top - edge} ${wide + 2 * edge} ${high + 2 * edge}" width="${(wide + 2 * edge) * px}" height="${(high + 2 * edge) * px}">`
    + `<g transform="scale(1 -1)" fill="none" stroke-width="${edge / 8}">${bed}${drawn.map((d) => line(d, "#8a8f93", edge / 5)).join("")}${drawn.map((d, n) => line(d, colours[n], edge / 10)).join("")}</g></svg>`;
  return URL.createObjectURL(new Blob([text], {type: "image/svg+xml"}));
}

const mm = (value) => written(value.toFixed(1));
const extentWords = ({extent: {min_mm: [x, y], max_mm: [to_x, to_y]}}) => t("drawing.extent", {x: mm(x), y: mm(y), to_x: mm(to_x), to_y: mm(to_y), wide: mm(to_x - x), high: mm(to_y - y)});
const timeWords = ({burning_s: seconds}) => (seconds === null ? "" : seconds < 60 ? t("drawing.seconds", {n: Math.max(1, Math.round(seconds))}) : t("drawing.minutes", {n: Math.round(seconds / 60)}));

function kindPart(kind, index) {
  const take = (name) => (value) => { given[index][name] = value; want(); };
  const field = (name) => numberField(t(`recipe.${name}`), given[index][name], take(name), {...kRules[name], id: `drawing-${name}-${index}`});
  return h("fieldset.confirm", {"data-key": `drawing-kind-${index}`}, h("legend", {}, `${kindName(kind)}: ${t("drawing.lines", {n: kind.lines, mm: Math.round(kind.length_mm)})}`),
    h("div.form", {}, h("div.pair", {}, field("power"), field("speed_mm_s")),
      h("div.pair", {}, field("passes"), h("label.tick", {}, h("input", {type: "checkbox", id: `drawing-air-${index}`, checked: given[index].air, onchange: (event) => take("air")(event.target.checked)}), t("recipe.air")))),
    !isWhole(given[index]) && h("p.warn", {role: "status"}, `▲ ${t("drawing.untold")}`));
}

// ---- the card -------------------------------------------------------------------------------------------------------

const ticks = burnTicks("confirm-drawing");
const kComing = ["Execute", "Completing"], kRests = ["Complete", "Idle"];  // after a dark run
const isTraced = (what) => Boolean(traced && traced.rest && traced.what === what);
const distrust = () => { traced = null; };

// A dark run is good while everything stays as it left it. What a status says that was on its way meanwhile is of an earlier
// moment: the first of a cell that rests tells how it was left.
followStatus(() => {
  if (!traced) return;
  const {state, lid, laser} = model.cell || {}, at = (laser || {}).position_mm;
  if (lid === "open") return distrust();
  if (!traced.isOver || (!traced.rest && kComing.includes(state))) return;
  const now = Array.isArray(at) && kRests.includes(state) ? JSON.stringify([state, at]) : "";
  traced.rest ||= now;
  if (!now || now !== traced.rest) distrust();
});
followEvent("open", distrust);  // what was missed is not known
followCorner(distrust);         // the lines lie elsewhere, though the head has not moved

// `what`: as it was shown to whoever pressed the button. Another run of it, dark or not, must be watched anew.
async function begin(what, body) {
  begun = what;
  const dark = body.dry ? {what, isOver: false, rest: ""} : null;
  traced = dark;
  const {points_mm, strokes, settings} = what.told;
  try {
    const result = await run("drawing", "/laser/run", {points_mm, strokes, ...settings, ...body}, kBeginMs);
    if (dark) { dark.isOver = true; await askStatus(); }
    return result;
  } finally {
    if (dark && !dark.isOver && traced === dark) traced = null;
  }
}

export function drawingCard() {
  const what = shown, bad = fault(), {result} = workAt("drawing"), isOfThis = begun === what;
  const asShown = () => Boolean(what) && shown === what && isCurrent() && given.every(isWhole) && what.told.settings !== null && what.told.fits !== false;
  const {buttons, row} = burns("drawing", kDrawing, ticks, "drawing.sure", asShown, (body) => begin(what, body), {needs: "operator", mayBurn: () => asShown() && isTraced(what)});
  const of = isOf(refused, bad ? "" : queryNow()) ? refused : null;
  return card(t("drawing"), h("p.dim", {}, t("drawing.about")),
    h("div.form", {}, h("label.file", {}, t("drawing.file"), h("input", {type: "file", id: "drawing-file", accept: ".svg,image/svg+xml", disabled: !operates() || isStale(), onclick: (event) => { event.target.value = ""; }, onchange: (event) => choose(event.target.files[0] || null)}),
      file && h("span.dim", {id: "drawing-name"}, file.name), !operates() && lacking("operator"))),
    reading && h("p.dim", {role: "status"}, `… ${t("drawing.reading")}`),
    of && h("p.fault", {id: "drawing-refused", role: "alert"}, "▲ ", of.lost ? t("drawing.lost", {name: of.file.name}) : cellSays(asSentence(of.sentence)), " ", !of.lost && button(t("drawing.again"), () => { refused = null; readNext(); })),
    what && [
      h("img.target", {id: "drawing-picture", src: what.picture, alt: t("drawing.alt", {extent: extentWords(what.told)})}),
      facts(fact(t("drawing.place"), extentWords(what.told), what.told.fits === false), fact(t("drawing.length"), [`${Math.round(what.told.length_mm)} mm`, timeWords(what.told)].filter(Boolean).join(", "))),
      what.told.fits === false && h("p.warn", {id: "drawing-outside", role: "status"}, `▲ ${t("drawing.outside")}`),
      what.told.travel === null && !isTraced(what) && hint(t("drawing.no_travel")),
      ...what.told.warnings.map((one) => h("p.dim", {}, cellSays(asSentence(one)))),
      h("div.form", {"data-key": "drawing-place"}, h("div.pair", {},
        numberField(t("drawing.x"), place.x, (text) => { place.x = text; want(); }, {...placeRules("y"), id: "drawing-x"}),
        numberField(t("drawing.y"), place.y, (text) => { place.y = text; want(); }, {...placeRules("x"), id: "drawing-y"}))),
      ...kindsNow().map(kindPart)],
    bad && hint(faultWords(bad)),
    what && ticks.list(),
    what && asShown() && !isTraced(what) && hint(t("drawing.dark_first")),
    h("div.commands", {}, ...buttons), (isOfThis || isBusy("drawing")) && row, isOfThis && result && hint(t(result.dry ? "drawing.ran" : "drawing.done")));
}
