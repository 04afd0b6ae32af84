// A picture becomes a plan, plans are compared, and one of them becomes a job. Planning reserves no wood.
import {h} from "../dom.js";
import {asSentence, dayTime, language, t} from "../words.js";
import {changed, mayChange, model, operates} from "../model.js";
import {command, showRefusal} from "../commands.js";
import {button, card, hint, cellSays, lacking, taskRow} from "../parts.js";
import {plansCards} from "./plans.js";
import {kPlaces, planInHand} from "./plan_changes.js";
import {kAgainMs} from "../link.js";
import {alone, isOpened, openPicture, pictureKey, pictureSize, sketchCard, wantSketch} from "../sketch.js";
import {faultWords, firstFault, numberField, numberOf, written} from "../fields.js";
import {firstSize, waits} from "../first_size.js";

const blank = () => ({
  file: null, url: "", drawing: null, lost_drawing: "",  // a drawing that could not be kept: its name
  name: "", size_mm: "190", patch_mm: "14", layout: "grid", wood: new Set(), max_panels: "",
  wide: 1, high: 1, across: .5, down: .5,  // which part of the picture: its sides, and where it lies in what is left of the picture's
  crop: "",                         // the same as a suggestion says it, where the browser cannot read the picture
  w_intensity: .5, w_edge: .5, w_colour: 0, w_texture: 0, w_hist: .5, w_range: 0, w_detail: 0, w_gamut: 0, w_grain: 0, optimize: "greedy", refine: false, elsewhere: false,
  panels: new Set(), remnants: "", triangles: false, rematch: "0", marks: "place",
  cell_aspect: 1, limits: new Map(),  // of a mosaic's cells; the share of the picture that a wood may take at most
});
const wanted = blank();
const kWeights = ["intensity", "edge", "colour", "texture", "hist", "range", "detail", "gamut", "grain"];
const begun = [];   // tasks of this tab, the newest first
// picture_brush.js, grid_lines.js, cell_curves.js, crop_frame.js and drafts.js, which the first view of the page does without
let brush = null, grid = null, cells = null, frame = null, drafts = null;
let draft = null;   // what drafts.js keeps of this form
let restored = null;  // of a draft whose picture is not open: {of: which one, {name, key}; picture: the file, or null; about: what is of it alone}
let advice = 0;     // the task that looks for advice, or found it
let typed = false;  // somebody has said how large
let sizedFor = null;  // the picture beside which a size was proposed, of the wood that is free
let lack = "";      // why no wood is free

export function enter() {
  loadTools();
}

// Each is tried again on its own, by one timer.
const again = new Map();
const later = (load) => { clearTimeout(again.get(load)); again.set(load, setTimeout(load, kAgainMs)); };
async function loadTools() {
  if (grid) return;
  try { [brush, grid, cells, frame, drafts] = await Promise.all(["picture_brush", "grid_lines", "cell_curves", "crop_frame", "drafts"].map((name) => import(`../${name}.js`))); } catch (fault) { later(loadTools); }
  if (drafts) draft ??= drafts.draftOf(form);
  changed();
}
const inStock = () => model.panels.filter((panel) => !panel.retired);
const woodsOf = (panels) => [...new Set(panels.flatMap((panel) => panel.woods || []))].sort();
// Another panel, or another job's pieces: a sketch of before may promise what is gone.
const woodInStock = () => inStock().map((panel) => `${panel.id} ${panel.free_mm2}`).join();

// What is proposed follows the wood until a picture stands beside it: no number changes under a finger then.
function propose() {
  if (!model.cell || model.panels.length < (model.cell.panels || 0)) return;  // they are on their way
  const whole = pictureSize(wanted.file), crop = cropOf() || whole;
  const {size_mm, patch_mm, of_wood, lack: why} = firstSize(model.panels, crop ? Math.max(crop.width, crop.height) / Math.min(crop.width, crop.height) : undefined);
  lack = why;
  if (typed || (wanted.file && sizedFor === wanted.file)) return;
  Object.assign(wanted, {size_mm: String(size_mm), patch_mm: String(patch_mm)});
  sizedFor = of_wood && isOpened(wanted.file) ? wanted.file : null;
}

export function draw() {
  propose();
  followRestored();
  if (brush) brush.wantPaint(wanted.file, pictureSize(wanted.file), cropOf());
  if (draft) draft.follow();
  const bad = fault();
  followNumbers();
  if (grid) grid.wantGrid(operates() ? wanted.file : null, pictureSize(wanted.file), cropOf(), gridQuery());
  if (cells) cells.wantCells(operates() ? wanted.file : null, pictureSize(wanted.file), cropOf(), cellsQuery());
  if (operates() && !bad) wantSketch(wanted.file, sketchQuery(), cropOf(), woodInStock(), {bent: isBent(), fine: finePieces(), wait: linesMove(), run: isRunning()});
  followFocus();
  const sketch = operates() && sketchCard(wanted.file, bad ? t("sketch.old", {why: faultWords(bad)}) : ""), rest = [adviceCard(), ...plansCards((task) => { begun.unshift(task); changed(); })];
  // A plan in hand has all the room, and nothing lies over it.
  if (planInHand()) return h("div.column", {"data-key": "in-hand"}, rest);
  // Beside the form stands the sketch while there is one, and stays there: nothing may scroll under it.
  return [
    h("div.columns.picture", {}, h("div.column", {}, formCard(), tasksCard()), h("div.column.wide", {}, sketch || rest)),
    sketch && h("div.column", {}, rest)];
}

// A button that goes, or is shut, by being pressed hands the focus on to what it was about.
let focused = null;  // {node, group} before the page is drawn
function followFocus() {
  const node = document.activeElement, group = node && node.closest("#cells, #lines, .form details");
  focused = group ? {node, group} : null;
}
function handFocusOn() {
  if (!focused || (focused.node.isConnected && !focused.node.disabled)) return;
  const next = focused.group.querySelector("canvas") || focused.group.querySelector("summary");
  if (next) next.focus({preventScroll: true});
}

export function drawn(place) {
  handFocusOn();
  const field = place.querySelector("#picture-file");
  if (field) showFile(field);
  if (brush) brush.paintDrawn(place);
  if (grid) grid.linesDrawn(place);
  if (cells) cells.cellsDrawn(place);
}

// ---- what is asked for ----------------------------------------------------------------------------------------------

function take(name, value) { wanted[name] = value; changed(); }

const kNumbers = {
  size_mm: {label: "picture.size", least: 1}, patch_mm: {label: "picture.patch", least: .1},
  max_panels: {label: "picture.panels", least: 1, whole: true, optional: true}, rematch: {label: "more.rematch", least: 0, whole: true, optional: true},
};
const number = (name, more = {}) => {
  const {label, ...rules} = kNumbers[name];
  return numberField(t(label), wanted[name], (text) => { if (name in kSizes) typed = true; take(name, text); }, {...rules, ...more});
};
const kSizes = {size_mm: 1, patch_mm: 1};
// The first number that cannot be used, of those that count now.
const fault = () => firstFault(...Object.entries(kNumbers).filter(([name]) => name !== "rematch" || wanted.refine)
  .map(([name, {label, ...rules}]) => ({label: t(label), text: wanted[name], rules})));
const asNumber = (name) => String(numberOf(wanted[name]));

// The sizes that could be used last: while one of them is typed anew, the lines over the picture stay, and nothing on the page moves.
const usable = {};
function followNumbers() {
  for (const name of Object.keys(kSizes)) if (!firstFault({text: wanted[name], rules: kNumbers[name]})) usable[name] = asNumber(name);
}
const areUsable = () => Object.keys(kSizes).every((name) => name in usable);

// What is wrong with one of them stands where it says otherwise what they are.
function lengthsSaid() {
  const bad = firstFault(...Object.keys(kSizes).map((name) => ({label: t(kNumbers[name].label), text: wanted[name], rules: kNumbers[name]})));
  return h("p.lengths-said", {id: "lengths-said", role: "status", class: bad ? "number-fault" : "dim"}, bad ? `▲ ${faultWords(bad)}` : t("picture.sizes"));
}

// Grain counts only where pieces do not choose in turn.
const isChosenTogether = () => wanted.optimize === "global" || (wanted.refine && numberOf(wanted.rematch) > 0);

const slider = (name, label, {max = 1, value = wanted[name], act = (to) => take(name, to)} = {}) => h("label.slider", {}, h("span", {}, `${label} ${Math.round(100 * value)} %`),
  h("input", {type: "range", min: 0, max, step: .05, value: String(value), "aria-label": label, id: `slide-${name}`, oninput: (event) => act(Number(event.target.value))}));

const select = (name, label, options) => h("label", {}, label,
  h("select", {value: wanted[name], id: `picture-${name}`, onchange: (event) => take(name, event.target.value)}, ...options.map(([value, text]) => h("option", {value}, text))));

function takeFile(event) {
  const [file] = event.target.files;
  if (restored && !wanted.file) Object.assign(restored.about, some(kOfPicture, wanted));
  takePicture(file || null);
  Object.assign(wanted, {drawing: null, lost_drawing: ""});
  takeWhole();
  if (file) wanted.name = file.name.replace(/\.[^.]*$/, "");
  else if (restored) Object.assign(wanted, some(kOfPicture, restored.about));
  changed();
}

function takePicture(file) {
  if (wanted.url) URL.revokeObjectURL(wanted.url);
  wanted.file = file;
  wanted.url = file ? URL.createObjectURL(file) : "";
  advice = 0;
  openPicture(file);
}

// Its field was made anew with the screen, and a browser puts no file into one by itself.
function showFile(field) {
  const [shown] = field.files;
  if (!wanted.file) { if (shown) field.value = ""; return; }
  if (shown && ["name", "size", "lastModified"].every((fact) => shown[fact] === wanted.file[fact])) return;
  const files = new DataTransfer();
  files.items.add(wanted.file);
  field.files = files.files;
}

// ---- a draft of it, kept in this browser (drafts.js) ----------------------------------------------------------------

const kPart = ["wide", "high", "across", "down", "crop"];
const kOfPicture = ["name", "drawing", "lost_drawing"];  // besides its part: what another picture does not have
const some = (names, from) => Object.fromEntries(names.filter((name) => name in from).map((name) => [name, from[name]]));

const drawings = () => ({paint: brush.keptPaint(), curves: cells.keptCurves(), pins: grid.keptPins()});
const ofPicture = () => some([...kPart, ...kOfPicture], wanted);
const isBegun = () => Boolean(draft) && (Boolean(wanted.file || wanted.drawing || restored) || isTouched() || Object.values(drawings()).some(({length}) => length));

// A size that was only proposed is proposed anew.
function keptForm() {
  const {file, url, drawing, size_mm, patch_mm, ...rest} = wanted, sized = Boolean(file) && sizedFor === file;
  return {...rest, typed, sized, ...((typed || sized) && {size_mm, patch_mm})};
}

const plain = (name, value) => (value instanceof Set || value instanceof Map ? [...value] : value);
const kNothing = JSON.stringify(keptForm(), plain);
const isTouched = () => Boolean(wanted.file) || JSON.stringify(keptForm(), plain) !== kNothing;

const form = {
  isBegun, clear,
  isOpened: () => !wanted.file || isOpened(wanted.file),
  state: () => JSON.stringify([keptForm(), brush.paintVersion(), cells.curvesVersion(), grid.pinsVersion(), drafts.fileId(wanted.file), drafts.fileId(wanted.drawing)], plain),
  taken() {
    const {file} = wanted, waits = !file && restored;
    return {form: {...keptForm(), ...(waits && some(kPart, restored.about)), ...drawings()}, drawing: wanted.drawing, picture: file || (waits && waits.picture) || null,
            of: file ? {name: file.name, key: pictureKey(file)} : waits ? waits.of : null, opening: Boolean(waits && waits.picture)};
  },
  restore({form: kept, of, picture, drawing, drawing_name, opening}) {
    brush.restorePaint(kept.paint);
    cells.restoreCurves(kept.curves);
    grid.restorePins(kept.pins);
    if (isTouched()) return false;
    const usual = blank(), like = (one, other) => typeof one === typeof other && one.constructor === other.constructor;
    Object.assign(wanted, Object.fromEntries(Object.entries(kept).filter(([name, value]) => usual[name] !== null && name in usual && like(value, usual[name]))),
      {drawing, ...(!drawing && drawing_name && {lost_drawing: drawing_name})});
    typed = kept.typed === true;
    if (of && (!picture || opening)) {
      restored = {of, picture, about: ofPicture()};
      Object.assign(wanted, some(kPart, usual));
      return true;
    }
    takePicture(picture);
    if (kept.sized === true) sizedFor = picture;
    return true;
  },
};

// Once it is chosen, or opened, again, the picture has its part, name and drawing back; another one of the same name gets none of it.
function followRestored() {
  if (!restored || !isOpened(wanted.file) || pictureKey(wanted.file) !== restored.of.key) return;
  Object.assign(wanted, restored.about);
  restored = null;
}

function clear() {
  brush.forgetPaint();
  cells.forgetCurves();
  grid.forgetPins();
  takePicture(null);
  Object.assign(wanted, blank());
  typed = false;
  sizedFor = restored = null;
}

const focusFile = () => document.getElementById("picture-file").focus({preventScroll: true});  // the button that was pressed goes, or is shut

function startAfresh() {
  if (!confirm(t("draft.sure"))) return;
  clear();
  draft.forget();
  changed();
  focusFile();
}

function openRestored() {
  Object.assign(restored.about, some(kOfPicture, wanted));
  takePicture(restored.picture);
  changed();
  focusFile();
}

// Beside the field that asks for it.
function lostPicture() {
  if (!restored || wanted.file) return null;
  const {of: {name}, picture} = restored;
  if (!picture) return h("p.warn", {id: "draft-picture", role: "status"}, `▲ ${t("draft.picture", {name})}`);
  return h("div.draft", {id: "draft-waits"}, h("p.warn", {role: "status"}, `▲ ${t("draft.waits", {name})}`), button(t("draft.open", {name}), openRestored, {id: "draft-open", needs: "viewer"}));
}

function draftControls() {
  const {at, fault} = draft ? draft.told() : {}, begun = isBegun(), isLost = restored && !restored.picture && !wanted.file;
  return h("div.draft", {id: "draft"},
    begun && at && h("p.dim", {id: "draft-restored", role: "status"}, t("draft.restored", {at: dayTime(at)})),
    begun && fault && !isLost && h("p.warn", {id: "draft-fault", role: "status"}, `▲ ${t(`draft.${fault}`)}`),
    button(t("draft.afresh"), startAfresh, {id: "draft-afresh", disabled: !begun, needs: "viewer"}));
}

// ---- which part of it -----------------------------------------------------------------------------------------------

const kClosest = .7;     // of the picture's sides, left away at most by the slider
const kLeastPart = .1;   // of them

function takeWhole() { Object.assign(wanted, {wide: 1, high: 1, across: .5, down: .5, crop: ""}); changed(); }

const snapped = (side) => (side > .9999 ? 1 : side);
const isPart = () => wanted.wide < 1 || wanted.high < 1;
const closer = () => 1 - Math.max(wanted.wide, wanted.high);
// It keeps its shape.
function takeCloser(share) {
  const scale = Math.max((1 - share) / Math.max(wanted.wide, wanted.high), kLeastPart / Math.min(wanted.wide, wanted.high));
  Object.assign(wanted, {wide: snapped(wanted.wide * scale), high: snapped(wanted.high * scale)});
  changed();
}

const share = (at, of) => (of > 0 ? Math.min(1, Math.max(0, at / of)) : .5);
const partOf = ({wide, high, across, down}) => ({left: (1 - wide) * across, top: (1 - high) * down, right: (1 - wide) * across + wide, bottom: (1 - high) * down + high});
function takePart({left, top, right, bottom}) {
  const wide = right - left, high = bottom - top;
  Object.assign(wanted, {wide: snapped(wide), high: snapped(high), across: share(left, 1 - wide), down: share(top, 1 - high)});
  changed();
}

// In pixels of the picture; null: all of it, or nobody knows how large it is.
function cropOf() {
  const whole = pictureSize(wanted.file);
  if (!whole || !isPart()) return null;
  const width = Math.max(1, Math.round(whole.width * wanted.wide)), height = Math.max(1, Math.round(whole.height * wanted.high));
  return {x: Math.round((whole.width - width) * wanted.across), y: Math.round((whole.height - height) * wanted.down), width, height};
}

function takeCrop(text) {
  const whole = pictureSize(wanted.file);
  takeWhole();
  if (!text) return;
  if (!whole) { wanted.crop = text; return; }
  const [x, y, width, height] = text.split(",").map(Number);
  Object.assign(wanted, {wide: Math.min(1, width / whole.width), high: Math.min(1, height / whole.height), across: share(x, whole.width - width), down: share(y, whole.height - height)});
}

function partControls() {
  if (wanted.crop) return h("p", {}, `${t("picture.part")}: ${wanted.crop} `, button(t("picture.whole"), takeWhole, {id: "take-whole"}));
  const whole = pictureSize(wanted.file), crop = cropOf() || whole;
  if (!whole) return null;
  return h("details", {id: "part"}, h("summary", {}, t("picture.part")),
    h("p.dim", {id: "part-size"}, t("part.size", {width: crop.width, height: crop.height, all: `${whole.width} × ${whole.height}`})),
    slider("closer", t("part.closer"), {max: kClosest, value: closer(), act: takeCloser}), slider("across", t("part.across")), slider("down", t("part.down")),
    isPart() && button(t("picture.whole"), takeWhole, {id: "take-whole"}));
}

function target() {
  const framed = frame && pictureSize(wanted.file) && !wanted.crop;
  return h("div", {id: "target", class: framed ? "target-frame" : ""}, h("img.target", {src: wanted.url, alt: wanted.name, draggable: "false"}), framed && frame.cropFrame(partOf(wanted), kLeastPart, takePart));
}

const chips = (all, among) => h("div.chips", {}, ...all.map((one) => h("label", {"data-key": one}, h("input", {type: "checkbox", checked: among.has(one),
  onchange: (event) => { if (event.target.checked) among.add(one); else among.delete(one); changed(); }}), one)));
const tick = (name, label, id) => h("label.tick", {}, h("input", {type: "checkbox", id, checked: wanted[name], onchange: (event) => take(name, event.target.checked)}), label);
const kLongest = 4;  // times as long as wide, as the planner admits cells
function aspectSlider() {
  const {cell_aspect: aspect} = wanted, words = aspect > 1 ? t("cells.aspect", {n: written(aspect)}) : t("cells.square");
  return h("label.slider", {}, h("span.with-glyph", {}, cells.aspectGlyph(aspect), words),
    h("input", {type: "range", min: 1, max: kLongest, step: .1, value: String(aspect), "aria-label": words, id: "slide-cell_aspect", oninput: (event) => take("cell_aspect", Number(event.target.value))}));
}

// Woods of the panels that a plan may take, but for those that nobody wants.
const woodsToTake = () => woodsOf(inStock().filter(({id}) => !wanted.panels.size || wanted.panels.has(id))).filter((wood) => !wanted.wood.size || wanted.wood.has(wood));
const limited = () => [...wanted.limits].filter(([, share]) => share < 1);
// A share of wood that is not there would be refused.
const limits = () => { const there = woodsToTake(); return limited().filter(([wood]) => there.includes(wood)); };
// One that has left stays, so that its share can be taken back.
function limitControls() {
  const listed = [...new Set([...woodsToTake(), ...limited().map(([wood]) => wood)])];
  if (!listed.length) return null;
  const set = (wood) => (share) => { if (share < 1) wanted.limits.set(wood, share); else wanted.limits.delete(wood); changed(); };
  return h("div", {id: "limits"}, h("p.dim", {}, t("limits")),
    ...listed.map((wood) => slider(`limit_${wood}`, wood, {value: wanted.limits.get(wood) ?? 1, act: set(wood)})));
}

// One that has left the stock stays ticked: without it, a plan would take wood from all panels.
const panelsToTick = () => {
  const names = inStock().map((panel) => panel.id);
  return [...names, ...[...wanted.panels].filter((one) => !names.includes(one))];
};

// What is asked for less often.
function moreControls() {
  return h("details", {id: "more"}, h("summary", {}, t("picture.more")),
    h("p.dim", {}, t("more.panels")), chips(panelsToTick(), wanted.panels),
    select("remnants", t("more.remnants"), [["", t("more.remnants.usual")], ["1", t("more.remnants.first")], ["0", t("more.remnants.last")]]),
    select("marks", t("more.marks"), ["place", "short"].map((one) => [one, t(`marks.${one}`)])),
    wanted.layout === "morph" && tick("triangles", t("more.triangles"), "picture-triangles"),
    wanted.refine && number("rematch", {id: "picture-rematch"}));
}

function formCard() {
  const woods = [...new Set([...woodsOf(inStock()), ...wanted.wood])];
  const bad = fault(), mayPlan = mayChange() && Boolean(wanted.file) && !bad;
  return card(t("picture.form"),
    h("form.form", {onsubmit: plan},
      h("label.file", {}, t("picture.file"), h("input", {type: "file", id: "picture-file", accept: "image/*", onchange: takeFile})),
      lostPicture(),
      wanted.url && target(),
      partControls(),
      h("label", {}, t("picture.name"), h("input", {type: "text", value: wanted.name, oninput: (event) => take("name", event.target.value)})),
      h("div.pair", {}, number("size_mm", {id: "picture-size", said: "lengths-said"}), number("patch_mm", {id: "picture-patch", said: "lengths-said"})),
      lengthsSaid(),
      lack && h("p.warn", {id: "no-wood"}, `▲ ${t(`picture.${lack}`, {panels: model.panels.filter(waits).map(({id}) => id).join(", ")})}`),
      select("layout", t("picture.layout"), ["grid", "morph", "mosaic", "segmentation"].map((one) => [one, t(`layout.${one}`)])),
      drawingControl(), grid && grid.lineControls(operates() ? wanted.file : null), cells && cells.cellControls(wanted.layout === "mosaic", aspectSlider()),
      brush && [brush.edgeControls(wanted.layout === "morph"), brush.sizeControls(wanted.layout === "mosaic"), brush.matterControls()],
      select("optimize", t("picture.care"), [["greedy", t("care.quick")], ["global", t("care.global")]]),
      tick("refine", t("picture.refine"), "picture-refine"),
      wanted.refine && limits().length > 0 && h("p.warn", {id: "limits-idle"}, `▲ ${t("limits.idle")}`),
      tick("elsewhere", t("picture.elsewhere"), "picture-elsewhere"),
      h("details", {}, h("summary", {}, t("picture.weights")),
        ...kWeights.map((one) => slider(`w_${one}`, t(`w.${one}`))),
        wanted.w_grain > 0 && !isChosenTogether() && h("p.warn", {id: "grain-idle"}, `▲ ${t("w.grain.idle", {care: t("picture.care"), global: t("care.global"), refine: t("picture.refine"), rematch: t("more.rematch")})}`)),
      h("details", {}, h("summary", {}, t("picture.woods")),
        !woods.length && h("p.dim", {}, t("picture.woods_all")),
        chips(woods, wanted.wood), limitControls(), number("max_panels", {id: "picture-panels"})),
      moreControls(),
      h("div.commands", {}, button(t("picture.advise"), advise, {disabled: !mayPlan, wide: true, id: "do-advise"}),
        h("button.wide", {type: "submit", id: "do-plan", disabled: !mayPlan, class: mayPlan ? "next" : ""}, t("picture.plan"), lacking("operator"))),
      bad && hint(faultWords(bad)),
      h("p.dim", {}, t(wanted.file ? "picture.reserve" : "picture.need")),
      draftControls()));
}

// It goes with its picture: another one has none.
function drawingControl() {
  if (wanted.layout !== "segmentation") return null;
  return h("label.file", {"data-key": `drawing of ${wanted.url}`}, t("picture.drawing"),
    h("input", {type: "file", id: "picture-drawing", accept: ".svg,image/*", onchange: (event) => { wanted.lost_drawing = ""; take("drawing", event.target.files[0] || null); }}),
    wanted.drawing && h("span.dim", {id: "drawing-name"}, wanted.drawing.name),
    wanted.lost_drawing && h("span.warn", {id: "drawing-lost", role: "status"}, `▲ ${t("draft.drawing", {name: wanted.lost_drawing})}`));
}

function asked() {
  const query = new URLSearchParams({name: wanted.name || "picture", size_mm: asNumber("size_mm")});
  for (const weight of kWeights) query.set(`w_${weight}`, String(wanted[`w_${weight}`]));
  if (wanted.wood.size) query.set("wood", [...wanted.wood].join(","));
  if (limits().length && !wanted.refine) query.set("wood_limit", limits().map(([wood, share]) => `${wood}=${share}`).join(","));
  if (wanted.max_panels.trim()) query.set("max_panels", asNumber("max_panels"));
  if (wanted.panels.size) query.set("panels", [...wanted.panels].join(","));
  if (wanted.remnants) query.set("remnants_first", wanted.remnants);
  return query;
}

const marksInto = (query) => { if (wanted.marks !== "place") query.set("marks", wanted.marks); };

// As a sketch wants it: what it does not look at would only ask for the same one again.
function sketchQuery() {
  const query = asked();
  query.delete("name");
  query.set("patch_mm", asNumber("patch_mm"));
  query.set("layout", wanted.layout);
  if (wanted.crop) query.set("crop", wanted.crop);
  if (brush) brush.paintInto(query, "");  // squares follow no edges
  return query;
}

// Whether the plan has other pieces than squares.
const isBent = () => wanted.layout !== "grid" || wanted.refine;

// Such pieces as a sketch draws them; null: squares, or those of a drawing, which no sketch reads.
function finePieces() {
  if (!isBent() || (wanted.layout === "segmentation" && wanted.drawing)) return null;
  const query = sketchQuery(), part = cropOf() || pictureSize(wanted.file);
  if (brush) brush.paintInto(query, wanted.layout);
  if (grid && wanted.layout === "morph") grid.pinsInto(query);
  if (cells && wanted.layout === "mosaic") cells.curvesInto(query);
  if (wanted.layout === "mosaic" && wanted.cell_aspect > 1) query.set("cell_aspect", String(wanted.cell_aspect));
  if (wanted.triangles && wanted.layout === "morph") query.set("triangles", "1");
  if (wanted.refine) query.set("refine", "dp");
  marksInto(query);
  const shorter = Number(query.get("size_mm")), patch = Number(query.get("patch_mm"));
  return {query, pinned: grid && wanted.layout === "morph" ? grid.pinsOfSmaller() : null, suits: grid && part ? grid.hasCountsOf(grid.sizeOf(part, shorter, patch), shorter, patch) : undefined};
}

const linesMove = () => Boolean((grid && grid.linesMove()) || (cells && cells.linesMove()));

// The cell draws sketches where it also finds the way of a cut file: while it cuts, only what is drawn at once is asked for.
const kRunning = ["Starting", "Execute", "Holding", "Held", "Unholding", "Suspending", "Suspended", "Unsuspending", "Completing"];
const isRunning = () => Boolean(model.cell) && kRunning.includes(model.cell.state);

// What the lines of a grid depend on; null with a layout that has none.
function gridQuery() {
  if (wanted.layout !== "morph" || !areUsable()) return null;
  const query = new URLSearchParams({layout: "morph", ...usable});
  if (wanted.triangles) query.set("triangles", "1");
  if (brush) brush.paintInto(query, "morph");
  query.delete("importance");  // of wood
  return query;
}

// The same of the cells of a mosaic, beside the curves that they lie along.
function cellsQuery() {
  if (wanted.layout !== "mosaic" || !areUsable()) return null;
  const query = new URLSearchParams({layout: "mosaic", ...usable});
  marksInto(query);  // which cells have no room for theirs, and are merged
  if (wanted.cell_aspect > 1) query.set("cell_aspect", String(wanted.cell_aspect));
  if (brush) brush.paintInto(query, "mosaic");
  return query;
}

const cropText = () => { const crop = cropOf(); return crop ? [crop.x, crop.y, crop.width, crop.height].join(",") : wanted.crop; };

async function plan(event) {
  event.preventDefault();
  if (!wanted.file) return showRefusal(t("picture.need"), language);
  if (fault()) return showRefusal(faultWords(fault()), language);  // the enter key asks no button
  const query = asked();
  query.set("patch_mm", asNumber("patch_mm"));
  for (const choice of ["layout", "optimize"]) query.set(choice, wanted[choice]);
  if (cropText()) query.set("crop", cropText());
  if (brush) brush.paintInto(query, wanted.layout);
  if (grid && wanted.layout === "morph") grid.pinsInto(query);
  if (cells && wanted.layout === "mosaic") cells.curvesInto(query);
  if (wanted.layout === "mosaic" && wanted.cell_aspect > 1) query.set("cell_aspect", String(wanted.cell_aspect));
  if (wanted.refine) query.set("refine", "dp");
  if (wanted.refine && numberOf(wanted.rematch) > 0) query.set("rematch", asNumber("rematch"));
  marksInto(query);
  if (wanted.triangles && wanted.layout === "morph") query.set("triangles", "1");
  if (wanted.elsewhere) query.set("alternatives", String(kPlaces));
  const drawing = wanted.layout === "segmentation" && wanted.drawing;
  if (drawing && !drawing.size) return showRefusal(t("picture.drawing.empty", {name: drawing.name}), language);
  if (drawing) query.set("segmentation_bytes", drawing.size);
  const body = drawing ? new Blob([wanted.file, drawing]) : wanted.file;
  const started = await alone(() => command(`/plans?${query}`, {body, timeoutMs: 60000}));
  if (started) begun.unshift(started.task);
  changed();
}

// ---- advice ---------------------------------------------------------------------------------------------------------

async function advise() {
  takeWhole();
  const query = asked();
  marksInto(query);
  if (brush) brush.wantPaint(wanted.file, pictureSize(wanted.file), null);
  if (brush) brush.paintInto(query, "");  // of all of the picture: which part is what is asked
  const started = await alone(() => command(`/plans/advice?${query}`, {body: wanted.file, timeoutMs: 60000}));
  if (started) begun.unshift(advice = started.task);
  changed();
}

function adviceCard() {
  const task = model.tasks.get(advice);
  const found = task && task.state === "done" && task.result;
  if (!found) return null;
  return card(t("advice"),
    ...found.remarks.map((remark) => h("p.hint", {}, cellSays(asSentence(remark)))),
    h("ul.plans.advice", {}, ...found.suggestions.map((one, at) => h("li", {"data-key": at},
      h("img", {src: `data:image/jpeg;base64,${one.preview_jpeg}`, alt: t("advice.picture", {n: at + 1})}),
      h("b", {}, `${at + 1}: ${Math.round(one.width_mm)} × ${Math.round(one.height_mm)} mm${at + 1 === found.suggested ? ` – ${t("advice.best")}` : ""}`),
      h("span", {}, `${t("pieces", {n: one.pieces})}, ${one.patch_mm.toFixed(1)} mm, ${t(`layout.${one.layout}`)}`),
      h("span.dim", {}, one.unfilled ? `▲ ${t("advice.missing", {n: one.unfilled})}` : t("advice.figures", {minutes: Math.max(1, Math.round(one.cutting_s / 60)), likeness: one.likeness.toFixed(2)})),
      button(t("advice.take"), () => takeAdvice(one))))));
}

function takeAdvice(one) {
  takeCrop(one.crop);
  Object.assign(wanted, {layout: one.layout, size_mm: written(one.size_mm.toFixed(1)), patch_mm: written(one.patch_mm.toFixed(2))});
  typed = true;
  changed();
}

// ---- while the planner is at work -----------------------------------------------------------------------------------

function tasksCard() {
  const mine = begun.map((id) => model.tasks.get(id)).filter((task) => task && (task.state === "running" || task.state === "failed")).slice(0, 4);
  if (!mine.length) return null;
  return card(t("picture.wait"), h("div", {role: "status"}, h("ul.list", {}, ...mine.map((task) => taskRow(task, () => command(`/tasks/${task.id}`, {method: "DELETE"}))))));
}
