// Plans that were made: what each will look like, what it costs, which wood it takes; two of them side by side.
import {h, svg} from "../dom.js";
import {span, squareCm, t} from "../words.js";
import {askAll, get, kAgainMs} from "../link.js";
import {changed, fewerPlans, followEvent, loadMorePlans, loadPlans, mayChange, mayHaveMorePlans, model} from "../model.js";
import {choose, command} from "../commands.js";
import {button, card, empty, fact, facts, cellSays, link, taskRow} from "../parts.js";
import {picture} from "../pictures.js";
import {holds, middleOf} from "../outlines.js";
import {boxOf} from "./job_map.js";
import {chooser, chooserButton, chooserHelp, chooserTools, laidWood} from "./plan_brush.js";
import {choosesIn, focusSoon, planInHand, takeMade} from "./plan_changes.js";

const kShown = 24;
let shown = kShown, search = "";
const ticked = [];          // at most two plans, the one ticked last behind
const kPiecesKept = 8;      // of the plans that were looked at last
const pieces = new Map();   // by plan, the one looked at last behind; null while they are on their way
const jobTasks = new Map(); // plan by the task that makes its job
let borders = true;

function piecesOf(plan) {
  const known = pieces.get(plan);
  pieces.delete(plan);
  pieces.set(plan, known || null);
  if (pieces.size > kPiecesKept) pieces.delete(pieces.keys().next().value);
  if (known === undefined) askAll(`/plans/${plan}/pieces`, "pieces").then((all) => { if (pieces.has(plan)) { pieces.set(plan, all); changed(); } }, () => setTimeout(() => { pieces.delete(plan); changed(); }, kAgainMs));
  return known || [];
}

// Whoever had it made looks at it next.
const bringIntoSight = (plan) => {
  requestAnimationFrame(() => requestAnimationFrame(() => { const both = document.querySelector(".side-by-side"); if (both) both.scrollIntoView(); }));
  focusSoon(`section[data-key="${plan}"] [data-command=other]`);
};

// `begun` is told of tasks that make other plans of these.
export function plansCards(begun) {
  const {plans} = model;
  const [first] = plans;
  takeMade((seen) => { ticked.splice(0, ticked.length, ...seen); if (seen.length > 1) bringIntoSight(seen[1]); });
  const compared = ticked.filter((id) => plans.some((plan) => plan.id === id));
  const inHand = plans.find((plan) => plan.id === planInHand());  // has all the room there is
  const large = inHand ? [inHand] : compared.length ? compared.map((id) => plans.find((plan) => plan.id === id)) : first ? [first] : [];
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const found = plans.filter((plan) => words.every((word) => named(plan).includes(word)));
  return [
    h("div.side-by-side", {class: large.length > 1 ? "two" : ""}, ...large.map((plan) => planCard(plan, begun, differingOf(large)))),
    card(t("plans"),
      !plans.length && empty(t("plans.none")),
      plans.length > 1 && h("p.dim", {}, t("plans.compare")),
      (plans.length > 1 || search) && h("div.tools", {}, h("label", {}, t("plans.search"), h("input", {type: "search", id: "plans-search", value: search, placeholder: t("plans.search_hint"), oninput: (event) => look(event.target.value)}))),
      plans.length > 0 && !found.length && empty(t("plans.none_found")),
      h("ul.plans", {}, ...found.slice(0, shown).map((plan) => h("li", {"data-key": plan.id}, h("label", {},
        h("input", {type: "checkbox", checked: ticked.includes(plan.id), onchange: () => tick(plan.id)}),
        picture(`/plans/${plan.id}/preview.png?width=160`, "", {whenSeen: true}),
        h("span", {}, h("b", {}, `${plan.id} ${plan.name}`), h("span", {}, t("pieces", {n: plan.placed})), costOf(plan) && h("span.dim", {}, costOf(plan))))))),
      (found.length > shown || mayHaveMorePlans()) && h("div.commands", {}, button(t("plans.more"), showMore, {wide: true, id: "plans-more"}))),
  ];
}

const named = (plan) => [plan.id, plan.name, plan.options && t(`layout.${plan.options.layout}`), ...plan.panels.map((one) => one.panel)].filter(Boolean).join(" ").toLowerCase();

function showMore() {
  shown += kShown;
  if (shown > model.plans.length && mayHaveMorePlans()) loadMorePlans(false);
  changed();
}

// In all there are, once somebody looks for one.
function look(words) {
  search = words;
  shown = kShown;
  if (!search) fewerPlans(1 + Math.max(-1, ...ticked.map((id) => model.plans.findIndex((plan) => plan.id === id))));
  else if (mayHaveMorePlans()) loadMorePlans(true);
  changed();
}

function tick(plan) {
  if (ticked.includes(plan)) ticked.splice(ticked.indexOf(plan), 1);
  else ticked.push(plan);
  if (ticked.length > 2) ticked.shift();
  changed();
}

const costOf = (plan) => (plan.report && typeof plan.report.cost_per_pixel === "number" ? plan.report.cost_per_pixel.toFixed(4) : "");

// The marks of pieces that have other wood than in the plan that this one was made of, where both are looked at.
function differingOf(large) {
  const [of, is] = large.slice().sort((a, b) => a.id - b.id);
  if (!is || is.parent !== of.id) return null;
  const before = new Map(piecesOf(of.id).map((piece) => [piece.mark, piece])), after = piecesOf(is.id);
  if (!before.size || !after.length) return null;
  const alike = (a, b) => a.panel === b.panel && (!a.panel || a.panel_outline_mm.every(([x, y], i) => b.panel_outline_mm[i] && Math.hypot(x - b.panel_outline_mm[i][0], y - b.panel_outline_mm[i][1]) < .01));
  return {parent: of.id, marks: new Set(after.filter((piece) => before.has(piece.mark) && !alike(before.get(piece.mark), piece)).map((piece) => piece.mark))};
}

function planCard(plan, begun, differing) {
  const {options = {}, report = {}} = plan;
  const made = [...jobTasks].find(([, of]) => of === plan.id);
  const task = made && model.tasks.get(made[0]);
  return h("section.card", {"data-key": plan.id, "aria-label": t("plan.title", {n: plan.id, name: plan.name})},
    h("h2", {}, t("plan.title", {n: plan.id, name: plan.name})),
    h("div.plan-stage", {class: choosesIn(plan.id) ? "in-hand" : ""}, h("div.plan-picture", {}, preview(plan, differing), chooserHelp(plan)), chooserTools(plan, piecesOf(plan.id), begun)),
    differing && differing.parent !== plan.id && h("p", {id: "plan-differs"}, t("plan.differs", {n: differing.marks.size, parent: differing.parent})),
    !choosesIn(plan.id) && chooserButton(plan, piecesOf(plan.id)),
    h("label.tick", {}, h("input", {type: "checkbox", checked: borders, onchange: (event) => { borders = event.target.checked; changed(); }}), t("plan.borders")),
    facts(fact(t("plan.pieces"), t("plan.placed", {placed: plan.placed, n: plan.pieces}), plan.placed < plan.pieces),
      costOf(plan) && fact(t("plan.cost"), `${costOf(plan)}, ${t("plan.cost_about")}`),
      report.cutting_s > 0 && fact(t("plan.time"), t("plan.time_about", {span: span(report.cutting_s)})),
      ...woodOf(plan), ...speciesOf(plan),
      fact(t("plan.asked"), t("plan.options", {size: options.size_mm, patch: options.patch_mm, layout: t(`layout.${options.layout}`)})),
      plan.segmentation && fact(t("plan.drawing"), link(plan.segmentation, t("plan.drawing.save"), {download: true})),
      report.without_lead > 0 && fact(t("plan.without_lead"), String(report.without_lead)),
      ...(report.warnings || []).map((warning) => fact(t("plan.warning"), cellSays(warning), true)),
      ...plan.outdated_panels.map((panel) => fact(t("plan.warning"), t("plan.outdated", {panel}), true))),
    task && task.state !== "done" && h("ul.list", {}, taskRow(task)),
    ...plan.jobs.map((job) => h("p", {}, t("plan.has_job", {n: job}))),
    h("div.commands", {},
      plan.jobs.length ? link("#run", t("plan.run"), {class: "go wide", onclick: () => choose(plan.jobs[plan.jobs.length - 1])})
                       : button(t("plan.job"), () => makeJob(plan.id), {wide: true, "data-command": "make-job", next: mayChange() && !plan.outdated_panels.length, disabled: !mayChange() || plan.outdated_panels.length > 0 || Boolean(task && task.state === "running")}),
      !plan.jobs.length && button(t("plan.lease"), async () => { await command(`/plans/${plan.id}/lease`, {body: {days: 7}}); loadPlans(); }, {disabled: !mayChange() || Boolean(plan.lease)}),
      !plan.jobs.length && button(t("plan.forget"), async () => { await command(`/plans/${plan.id}`, {method: "DELETE"}); loadPlans(); }, {disabled: !mayChange() || Boolean(plan.lease)})));
}

function preview(plan, differing) {
  const all = borders || differing || choosesIn(plan.id) ? piecesOf(plan.id) : [];
  const box = boxOf(all);
  const ring = (piece) => `M${piece.artwork_outline_mm.map(([x, y]) => `${(x - box.left).toFixed(2)} ${(box.high - y).toFixed(2)}`).join("L")}Z`;
  const other = differing && box ? piecesOf(plan.id).filter((piece) => differing.marks.has(piece.mark)).map(ring).join("") : "";
  return h("div.view", {}, picture(`/plans/${plan.id}/preview.png?width=720`, t("plan.preview", {n: plan.id})),
    laidWood(plan, all, box),
    box && svg("svg", {viewBox: `0 0 ${box.right - box.left} ${box.high - box.low}`, preserveAspectRatio: "none", "aria-hidden": "true"},
      svg("path", {class: "border", d: borders || choosesIn(plan.id) ? all.map(ring).join("") : ""}),
      ...["ring", "ring.inner"].map((look) => svg(`path.${look}`, {d: other}))),
    chooser(plan, all, box));
}

function ringArea(ring) {
  let twice = 0;
  ring.forEach(([x, y], i) => { const [u, v] = ring[(i + 1) % ring.length]; twice += x * v - u * y; });
  return Math.abs(twice) / 2;
}

// Counted in the pieces' outlines; what the laser burns around them comes on top.
function woodOf(plan) {
  const used = new Map();
  for (const piece of piecesOf(plan.id)) {
    if (!piece.panel) continue;
    const one = used.get(piece.panel) || {area: 0, n: 0};
    one.area += ringArea(piece.panel_outline_mm);
    ++one.n;
    used.set(piece.panel, one);
  }
  return [...used].sort().map(([panel, {area, n}]) => fact(t("plan.wood"), t("plan.panel_wood", {panel, area: squareCm(area), pieces: t("pieces", {n})})));
}

// ---- which woods ----------------------------------------------------------------------------------------------------

const zones = new Map();  // by panel, {zones: null} while they are on their way; forgotten when any panel changes
followEvent("panel", () => zones.clear());

// What was asked before a panel changed may be answered after what was asked since.
function zonesOf(panel) {
  if (!zones.has(panel)) {
    const asked = {zones: null};
    zones.set(panel, asked);
    get(`/panels/${encodeURIComponent(panel)}`).then((read) => { asked.zones = read.zones; changed(); },
      () => setTimeout(() => { if (zones.get(panel) === asked) { zones.delete(panel); changed(); } }, kAgainMs));
  }
  return zones.get(panel).zones;
}

// The zone that a piece's middle lies in.
function woodOfPiece(piece) {
  const known = zonesOf(piece.panel), [x, y] = middleOf(piece.panel_outline_mm);
  const zone = (known || []).find((one) => (one.shape_mm || []).filter((ring) => holds(ring, x, y)).length % 2 === 1);
  return zone && zone.material;
}

// The same wood by its name; nothing where nobody has said what any of it is.
function speciesOf(plan) {
  const used = new Map();
  for (const piece of piecesOf(plan.id)) {
    if (!piece.panel) continue;
    const wood = woodOfPiece(piece) || "", one = used.get(wood) || {area: 0, n: 0};
    one.area += ringArea(piece.panel_outline_mm);
    ++one.n;
    used.set(wood, one);
  }
  if (used.size === 0 || (used.size === 1 && used.has(""))) return [];
  return [...used].sort((a, b) => b[1].area - a[1].area).map(([wood, {area, n}]) => fact(t("plan.species"), t("plan.panel_wood", {panel: wood || t("panel.unnamed"), area: squareCm(area), pieces: t("pieces", {n})})));
}

async function makeJob(plan) {
  const started = await command("/jobs", {body: {plan}});
  if (started) jobTasks.set(started.task, plan);
  changed();
}
