// What people say of a panel: of which wood each of its strips is, where it lies, how thick it is, what was done to it.
import {h} from "../dom.js";
import {squareCm, t} from "../words.js";
import {askAll} from "../link.js";
import {changed, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {hint, lacking} from "../parts.js";
import {faultWords, firstFault, numberField, numberOf, written} from "../fields.js";

const code = encodeURIComponent;
const kSides = ["veneer_mm", "substrate_mm"];
const kThickness = {least: .001, most: 100, optional: true};
const faultOfSides = (now) => firstFault(...kSides.map((side) => ({label: t(`say.${side}`), text: now[side], rules: kThickness})));
const kLongestWood = 60;  // characters that the cell takes
let typed = {};      // what is not kept yet, by field
let woods = [];      // that were ever named
let keeping = false, kept = false;

export function beginFacts() {
  typed = {};
  kept = false;
  askAll("/materials", "materials").then((all) => { woods = all.map((one) => one.material); changed(); }, () => {});  // only offered
}

const known = (panel) => {
  const {shelf, veneer_mm, substrate_mm} = panel.facts || {};
  return {shelf: shelf || "", veneer_mm: veneer_mm ? written(veneer_mm) : "", substrate_mm: substrate_mm ? written(substrate_mm) : "", treated: "", product: "", day: "",
          ...Object.fromEntries(panel.zones.map((zone) => [`zone-${zone.zone}`, zone.material || ""]))};
};

function said(panel) {
  const before = known(panel), now = {...before, ...typed};
  const zones = panel.zones.filter(({zone}) => now[`zone-${zone}`].trim() && now[`zone-${zone}`].trim() !== before[`zone-${zone}`]);
  const facts = {};
  if (now.shelf.trim() !== before.shelf) facts.shelf = now.shelf.trim();
  for (const side of kSides) if (now[side].trim() && numberOf(now[side]) !== numberOf(before[side])) facts[side] = numberOf(now[side]);
  if (now.treated && now.product.trim()) Object.assign(facts, {[now.treated]: now.product.trim()}, now.day ? {day: now.day} : {});
  return {now, zones, facts, anything: zones.length > 0 || Object.keys(facts).length > 0, half: Boolean(now.treated) && !now.product.trim(), bad: faultOfSides(now)};
}

// Of one wood it is said at once, strip by strip only where they differ. What was taken is no longer typed.
async function keep(event, panel) {
  event.preventDefault();
  const {now, zones, facts, anything, half, bad} = said(panel);
  const mine = typed, sent = {...typed};  // people type on meanwhile, or begin another panel
  const taken = (names) => { for (const name of names) if (mine[name] === sent[name]) delete mine[name]; };
  if (keeping || !anything || half || bad) return;
  keeping = true;
  kept = false;
  changed();
  const woodOf = ({zone}) => now[`zone-${zone}`].trim(), [first] = zones;
  const alike = zones.length === panel.zones.length && zones.every((zone) => woodOf(zone) === woodOf(first));
  const bodies = alike ? [{material: woodOf(first)}] : zones.map((zone) => ({zone: zone.zone, material: woodOf(zone)}));
  let done = true;
  for (const body of bodies) {
    done = done && Boolean(await command(`/panels/${code(panel.id)}/material`, {body}));
    if (done) taken((body.zone ? [body] : zones).map(({zone}) => `zone-${zone}`));
  }
  if (done && Object.keys(facts).length) done = Boolean(await command(`/panels/${code(panel.id)}/facts`, {body: facts}));
  keeping = false;
  if (done) taken(Object.keys(sent));
  kept = done && mine === typed && !Object.keys(typed).length;
  loadPanels();
  changed();
}

// `look` shows a strip on the map, or none.
export function saidCard(panel, look) {
  const {now, anything, half, bad} = said(panel);
  const take = (name) => (event) => { typed[name] = event.target.value; kept = false; changed(); };
  const text = (name, label, more = {}) => h("label", {}, label, h("input", {type: "text", id: `say-${name}`, maxlength: 200, value: now[name], oninput: take(name), ...more}));
  const number = (name) => numberField(t(`say.${name}`), now[name], (text) => take(name)({target: {value: text}}), {...kThickness, id: `say-${name}`});
  const before = known(panel), isEmptied = (name) => Boolean(before[name]) && !now[name].trim();
  const emptied = ["veneer_mm", "substrate_mm", ...panel.zones.map(({zone}) => `zone-${zone}`)].some(isEmptied);
  const all = (event) => { for (const {zone} of panel.zones) typed[`zone-${zone}`] = event.target.value; kept = false; changed(); };
  const whole = panel.zones.length > 1 && panel.zones.every(({zone}) => now[`zone-${zone}`] === now[`zone-${panel.zones[0].zone}`]) ? now[`zone-${panel.zones[0].zone}`] : "";
  return h("details.card", {"data-key": "say"}, h("summary", {}, t("say")),
    h("form.form", {onsubmit: (event) => keep(event, panel)},
      h("datalist", {id: "panel-woods"}, ...woods.map((wood) => h("option", {value: wood}, wood))),
      panel.zones.length > 1 && h("label", {}, t("say.all"), h("input", {type: "text", id: "say-all", list: "panel-woods", maxlength: kLongestWood, value: whole, oninput: all})),
      ...panel.zones.map((zone) => text(`zone-${zone.zone}`, t(panel.zones.length > 1 ? "say.zone" : "say.wood", {n: zone.zone, area: squareCm(zone.area_mm2)}),
        {list: "panel-woods", maxlength: kLongestWood, onfocus: () => look(zone.zone), onblur: () => look(0)})),
      text("shelf", t("panel.shelf")),
      h("div.pair", {}, number("veneer_mm"), number("substrate_mm")),
      h("label", {}, t("say.treated"), h("select", {id: "say-treated", value: now.treated, onchange: take("treated")},
        h("option", {value: ""}, t("say.nothing")), ...["sanded", "finished"].map((one) => h("option", {value: one}, t(`say.${one}`))))),
      now.treated && h("div.pair", {}, text("product", t("say.product"), {required: true}), h("label", {}, t("say.day"), h("input", {type: "date", id: "say-day", value: now.day, oninput: take("day")}))),
      now.treated && hint(t("say.scan_again")),
      emptied && h("p.dim.hint", {id: "say-emptied"}, t("say.emptied")),
      bad && hint(faultWords(bad)),
      h("div.commands", {}, h("button.wide", {type: "submit", id: "do-say", disabled: !mayChange() || keeping || !anything || half || Boolean(bad) || Boolean(panel.retired)}, t("say.keep"), lacking("operator"))),
      kept && h("p", {role: "status"}, t("say.kept"))));
}
