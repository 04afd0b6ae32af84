// How each wood is cut, the head by hand, overrides, what can be printed, and copies of it all.
import {h} from "../dom.js";
import {language, t} from "../words.js";
import {askAll, get, kAgainMs} from "../link.js";
import {changed, isStale, mayChange, mayDo, model, operates} from "../model.js";
import {command, showRefusal} from "../commands.js";
import {button, card, empty, hint, lacking, later, viewerHint} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf, written} from "../fields.js";
import {gridButton, tagForm} from "./setup_devices.js";
import {backupsCard, enterBackups} from "./settings_backups.js";

let recipes = null, woods = [];

export function enter() {
  enterBackups();
  alone.ask();
  drawn.ask();
  return enterRecipes();
}

const alone = later(() => import("./settings_laser.js")), drawn = later(() => import("./settings_drawing.js"));

async function enterRecipes() {
  try {
    const [{otherwise}, all, materials] = await Promise.all([get("/recipes?limit=1"), askAll("/recipes", "recipes"), askAll("/materials", "materials")]);
    recipes = {otherwise, recipes: all};
    woods = materials.map((one) => one.material || one.name).filter(Boolean);
  } catch (fault) {
    recipes = null;
    setTimeout(() => { if (!recipes) enterRecipes(); }, kAgainMs);
  }
  changed();
}

// Each stays itself, with its focus, when another one comes before it.
function keyed(cards) {
  const there = Object.entries(cards).filter(([, one]) => one);
  for (const [key, one] of there) one.dataset.key ||= `settings-${key}`;
  return there.map(([, one]) => one);
}

export function draw() {
  if (!model.cell) return empty(t("connecting"));
  const {part} = alone;
  return [viewerHint(), h("div.columns.two-even", {},
    h("div.column", {}, keyed({recipes: recipesCard(), recipe: recipeForm(), print: printCard(), scanners: part && part.scannersCard(), overrides: overridesCard(), jog: jogCard()})),
    h("div.column", {}, keyed({comes: alone.comes(), burns: part && part.burnsNow(), card: part && part.testCard(), pattern: part && part.patternCard(), drawing: drawn.part ? drawn.part.drawingCard() : drawn.comes(), backups: backupsCard()})))];
}

// ---- recipes --------------------------------------------------------------------------------------------------------

const percent = (share) => `${Math.round(1000 * share) / 10} %`;
const wanted = {material: "", operation: "cut", speed_mm_s: "15", power: "85", passes: "1", air: true, kerf_back_mm: "", kerf_show_mm: ""};
const maySet = () => mayDo("maintainer") && mayChange();
const take = (name, value) => { wanted[name] = value; changed(); };

function recipesCard() {
  if (!recipes) return card(t("recipes"), empty(t("connecting")));
  const rows = [...recipes.recipes, ...["cut", "engrave"].map((operation) => ({material: "", operation, ...recipes.otherwise[operation]}))];
  return card(t("recipes"), h("p.dim", {}, t("recipes.what")), h("ul.list", {}, ...rows.map((one) => h("li", {"data-key": `${one.material}-${one.operation}`},
    h("div", {}, h("b", {}, `${one.material || t(recipes.recipes.length ? "recipes.otherwise" : "recipes.every")}, ${t(`operation.${one.operation}`)}`),
      h("div", {}, [t("recipes.row", {speed: one.speed_mm_s, power: percent(one.power)}), one.passes > 1 ? t("recipes.passes", {n: one.passes}) : "",
        one.kerf_back_mm ? t("recipes.kerf", {back: one.kerf_back_mm, show: one.kerf_show_mm}) : ""].filter(Boolean).join(", "))),
    one.material && h("span.choices", {},
      button(t("recipes.edit"), () => { Object.assign(wanted, Object.fromEntries(Object.keys(wanted).map((name) => [name, name === "air" ? one.air : name === "power" ? written(Number((100 * one.power).toPrecision(6))) : one[name] === null || one[name] === undefined ? "" : kNumbers[name] ? written(one[name]) : String(one[name])]))); changed(); }, {disabled: !maySet(), needs: "maintainer"}),
      button(t("recipes.remove"), async () => { if (confirm(t("recipes.remove_sure", {material: one.material}))) { await command(`/recipes/${encodeURIComponent(one.material)}/${one.operation}`, {method: "DELETE"}); enterRecipes(); } }, {disabled: !maySet(), needs: "maintainer"}))))));
}

const kKerf = {least: 0, most: 5, optional: true};
const kNumbers = {speed_mm_s: {least: .01}, power: {least: 0, most: 100}, passes: {least: 1, most: 20, whole: true}, kerf_back_mm: kKerf, kerf_show_mm: kKerf};
const field = (name) => numberField(t(`recipe.${name}`), wanted[name], (text) => take(name, text), {...kNumbers[name], id: `recipe-${name}`});
const faultOfRecipe = () => firstFault(...Object.entries(kNumbers).map(([name, rules]) => ({label: t(`recipe.${name}`), text: wanted[name], rules})));

function recipeForm() {
  const bad = faultOfRecipe();
  return h("details.card", {"data-key": "recipe-form", open: Boolean(wanted.material)}, h("summary", {}, t("recipe.set")),
    h("form.form", {onsubmit: setRecipe},
      h("label", {}, t("recipe.material"), h("input", {type: "text", id: "recipe-material", required: true, list: "woods", value: wanted.material, oninput: (event) => take("material", event.target.value)})),
      h("datalist", {id: "woods"}, ...woods.map((wood) => h("option", {value: wood}, wood))),
      h("label", {}, t("recipe.operation"), h("select", {value: wanted.operation, onchange: (event) => take("operation", event.target.value)}, ...["cut", "engrave"].map((one) => h("option", {value: one}, t(`operation.${one}`))))),
      h("div.pair", {}, field("speed_mm_s"), field("power")),
      h("div.pair", {}, field("kerf_back_mm"), field("kerf_show_mm")),
      h("div.pair", {}, field("passes"), h("label.tick", {}, h("input", {type: "checkbox", checked: wanted.air, onchange: (event) => take("air", event.target.checked)}), t("recipe.air"))),
      bad && hint(faultWords(bad)),
      h("div.commands", {}, h("button.wide", {type: "submit", id: "do-recipe", disabled: !maySet() || Boolean(bad)}, t("recipe.keep"), lacking("maintainer")))));
}

async function setRecipe(event) {
  event.preventDefault();
  if (faultOfRecipe()) return showRefusal(faultWords(faultOfRecipe()), language);
  const body = {speed_mm_s: numberOf(wanted.speed_mm_s), power: Number((numberOf(wanted.power) / 100).toPrecision(12)), passes: numberOf(wanted.passes), air: wanted.air};
  for (const kerf of ["kerf_back_mm", "kerf_show_mm"]) if (wanted[kerf].trim()) body[kerf] = numberOf(wanted[kerf]);
  if (await command(`/recipes/${encodeURIComponent(wanted.material)}/${wanted.operation}`, {body})) { wanted.material = ""; enterRecipes(); }
}

// ---- overrides ------------------------------------------------------------------------------------------------------

const kOverrides = {feed: [25, 200], rapid: [25, 100], power: [10, 100]};

function overridesCard() {
  const now = (model.cell.laser || {}).overrides_wanted || {};
  const set = (what, value) => command("/laser/overrides", {body: {[what]: value}});
  return card(t("overrides"), h("p.dim", {}, t("overrides.about")), h("ul.list", {}, ...Object.entries(kOverrides).map(([what, [least, most]]) => {
    const value = now[what] ?? 100;
    const off = !operates() || isStale();
    return h("li", {"data-key": what}, h("div", {}, h("b", {}, t(`override.${what}`)), h("div", {}, `${value === 100 ? "" : "▲ "}${value} %`)),
      h("span.choices", {},
        button("−10", () => set(what, Math.max(least, value - 10)), {disabled: off || value <= least, "aria-label": `−10, ${t("override.less", {what: t(`override.${what}`)})}`}),
        button("100 %", () => set(what, 100), {disabled: off || value === 100, "aria-label": `100 %, ${t(`override.${what}`)}`}),
        button("+10", () => set(what, Math.min(most, value + 10)), {disabled: off || value >= most, "aria-label": `+10, ${t("override.more", {what: t(`override.${what}`)})}`})));
  })));
}

// ---- jog ------------------------------------------------------------------------------------------------------------

let step = 10;
const kArrows = [["↖", -1, 1], ["↑", 0, 1], ["↗", 1, 1], ["←", -1, 0], ["■", 0, 0], ["→", 1, 0], ["↙", -1, -1], ["↓", 0, -1], ["↘", 1, -1]];

function jogCard() {
  const {state, laser = {}} = model.cell;
  const may = mayChange() && state === "Idle";
  const move = (x, y) => (x || y ? command("/laser/jog", {body: {dx_mm: x * step, dy_mm: y * step}}) : command("/laser/jog/stop"));
  return card(t("jog"), h("p.dim", {}, t(state === "Idle" ? "jog.about" : "jog.not_now")),
    Array.isArray(laser.position_mm) && h("p.big", {}, laser.position_mm.map((value) => value.toFixed(1)).join(" / "), " mm"),
    h("div.choices", {role: "group", "aria-label": t("jog.step")}, ...[1, 10, 50].map((one) => h("button", {type: "button", "aria-pressed": String(step === one), onclick: () => { step = one; changed(); }}, `${one} mm`))),
    h("div.jog", {}, ...kArrows.map(([arrow, x, y]) => button(arrow, () => move(x, y), {disabled: x || y ? !may : !operates(), "aria-label": t(x || y ? "jog.move" : "jog.stop", {x: x * step, y: y * step})}))),
    alone.part && alone.part.cornerPart());
}

// ---- to be printed --------------------------------------------------------------------------------------------------

const printCard = () => h("details.card", {"data-key": "print"}, h("summary", {}, t("setup.print")), h("p", {}, t("print.about_grid")), gridButton(), h("p", {}, t("print.about_tags")), tagForm());
