// The cell at a glance: what runs, what needs somebody, what must be so before the beam comes on, the machine, the stock.
import {h} from "../dom.js";
import {asSentence, span, squareCm, t} from "../words.js";
import {mayChange, model} from "../model.js";
import {command, isSure, sameThing} from "../commands.js";
import {bar, button, card, empty, fact, facts, cellSays, leftWords, link, nowWords, taskRow, viewerHint} from "../parts.js";
import {leasesCard} from "./leases.js";

export function draw() {
  const {cell} = model;
  if (!cell) return empty(t("connecting"));
  return [
    viewerHint(),
    h("div.columns", {},
      h("div.column", {}, whatRuns(cell), attention(), workGoingOn()),
      h("div.column", {}, interlocks(cell)),
      h("div.column", {}, machine(cell), stock(), leasesCard())),
  ];
}

function whatRuns(cell) {
  const {job} = cell;
  if (!job) return card(t("under_way"), empty(t("nothing_runs")));
  return card(t("under_way"),
    h("p.big", {}, link("#run", job.name)),
    bar(job.pieces ? job.cut / job.pieces : 0, {suspect: job.pieces ? job.suspect / job.pieces : 0, label: t("job.progress", {cut: job.cut, n: job.pieces})}),
    h("p", {}, t("job.progress", {cut: job.cut, n: job.pieces})), (job.now || leftWords(job)) && h("p.dim", {}, nowWords(job)), cell.next && h("p", {}, cellSays(asSentence(cell.next))));
}

// Colour for what is not as it should be, and for nothing else.
function attention() {
  // Nobody misses pieces of a job that was given up; what became of its suspect ones is asked all the same.
  const sum = (what) => model.jobs.filter((job) => what === "suspect" || job.state !== "cancelled").reduce((all, job) => all + (job[what] || 0), 0);
  const differing = model.panels.filter((panel) => !panel.retired && panel.open_differences > 0);
  const scans = model.panels.filter((panel) => !panel.retired && panel.scan_again);
  const rows = [["suspects", sum("suspect"), "#run"], ["missing", sum("missing"), "#run"],
                ["differences", differing.length, differing.length ? `#panels/${differing[0].id}` : ""], ["scans", scans.length, "#scan"]].filter(([, n]) => n > 0);
  const owed = model.cell.owed_look;
  owedLook.drawn(JSON.stringify(owed || null));
  if (!rows.length && !owed) return null;
  return card(t("attention"), owed && owedPart(owed), h("ul.list", {}, ...rows.map(([what, n, href]) => h("li.bad", {}, link(href, `▲ ${t(`attention.${what}`, {n})}`)))));
}

// A look that the camera owes is given up by a person, of the pieces that stood there.
const owedLook = sameThing();
function owedPart(owed) {
  const isShown = () => JSON.stringify(model.cell.owed_look) === JSON.stringify(owed) && owedLook.isLooked();
  const giveUp = async () => { if (await isSure(t("owed.sure", {n: owed.pieces, panel: owed.panel, job: owed.job}), isShown)) command("/commands/write-off-look"); };
  return [h("p.warn", {}, "▲ ", cellSays(asSentence(owed.sentence))),
    h("div.commands", {}, button(t("owed.write_off"), giveUp, {id: "write-off-look", wide: true, small: t("owed.write_off.small"), disabled: !mayChange() || !owedLook.isLooked()}))];
}

function workGoingOn() {
  const running = [...model.tasks.values()].filter((task) => task.state === "running");
  return running.length ? card(t("work"), h("ul.list", {}, ...running.map((task) => taskRow(task)))) : null;
}

// The controller's own word. GRBL says more of it behind a colon, which is a state of its own: at `Door:0` the door is closed again,
// at `Hold:1` the head still moves. A word that is not known stays as it is.
function controllerSays(state) {
  const inWords = (one) => { const key = `laser.says.${one}`, known = t(key); return known === key ? "" : known; };
  const [word, more] = state.split(":"), whole = inWords(state), known = inWords(word);
  if (whole) return whole;
  if (!known) return h("span", {lang: "en"}, state);
  return more ? `${known} (${more})` : known;
}

function machine(cell) {
  const laser = cell.laser || {};
  const rows = [];
  const place = laser.homed === false ? t(laser.finds_home === false ? "laser.no_corner" : "laser.not_homed") : laser.homed && laser.finds_home === false ? t("laser.no_switches") : "";
  const words = [laser.state && controllerSays(laser.state), laser.connected && place].filter(Boolean).flatMap((word, n) => (n ? [", ", word] : [word]));
  rows.push(laser.connected ? fact(t("laser"), words.length ? words : t("laser.connected"))
                            : fact(t("laser"), cellSays(laser.why_not_connected) || t("laser.none"), Boolean(laser.why_not_connected)));
  if (laser.connected) rows.push(fact(t("beam"), t(laser.beam_on ? "beam.on" : "beam.off"), laser.beam_on && cell.state !== "Execute"));
  if (laser.controller && laser.controller !== "real") rows.push(fact(t("controller"), t(`controller.${laser.controller}`)));
  if (laser.set_by === "choice") rows.push(fact(t("laser.chosen"), [t(`kind.${laser.kind}`), laser.port].filter(Boolean).join(", ")));
  const turned = Object.entries(laser.overrides_wanted || {}).filter(([, percent]) => percent !== 100);
  if (turned.length) rows.push(fact(t("overrides"), turned.map(([what, percent]) => `${t(`override.${what}`)} ${percent} %`).join(", "), true));
  if (Array.isArray(laser.position_mm)) rows.push(fact(t("head"), `${laser.position_mm.map((v) => v.toFixed(1)).join(" / ")} mm`));
  if (laser.firmware) rows.push(fact(t("firmware"), laser.firmware));
  return card(t("machine"), facts(...rows));
}

// ---- the interlock chain --------------------------------------------------------------------------------------------

const kMarks = {good: "✓", warns: "△", blocks: "▲", unknown: "?"};
const kWhere = {stop: "run", consent: "run", certificates: "calibration", camera: "setup", scanner: "scan"};  // where the remedy is

// Each link at its place, whatever its state, so that an eye finds it; what is in the way is counted above.
function interlocks(cell) {
  const chain = cell.interlocks || [];
  const count = (state) => chain.filter((one) => one.state === state).length;
  const summary = count("blocks") ? `▲ ${t("interlocks.blocks", {n: count("blocks")})}`
    : count("unknown") || !chain.length ? `? ${t("interlocks.unknown", {n: count("unknown")})}` : `✓ ${t("interlocks.free")}`;
  return card(t("interlocks"), h("p.big", {id: "interlocks-summary"}, summary), h("ul.facts.interlocks", {}, ...chain.map(interlock)),
    h("p.dim", {}, t("interlocks.emergency")));
}

function interlock({name, state, sentence, remedy, age_s: age}) {
  return h("li", {"data-key": name, "data-state": state, class: state === "blocks" ? "bad" : state},
    h("span.mark", {"aria-hidden": "true"}, kMarks[state]),
    h("span.label", {}, t(`interlock.${name}`), h("span.unseen", {}, `: ${t(`interlock.is_${state}`)}`)),
    h("div", {}, h("p", {}, cellSays(asSentence(sentence)), age !== null && ` ${t("interlock.age", {span: span(age)})}`),
      remedy && h("p.remedy", {}, cellSays(remedy)),
      remedy && kWhere[name] && link(`#${kWhere[name]}`, t("next.go", {screen: t(`screen.${kWhere[name]}`)}), {class: "go"})));
}

function stock() {
  const there = model.panels.filter((panel) => !panel.retired);
  const free = there.reduce((all, panel) => all + (panel.area_book_mm2 ? panel.area_book_mm2.free : 0), 0);
  const without = (mask) => there.filter((panel) => panel.mask === mask).length;
  return card(t("stock"), h("p.big", {}, link("#panels", t("stock.panels", {n: there.length}))), h("p", {}, t("stock.free", {area: squareCm(free)})),
    without("uncounted") > 0 && h("p.dim", {}, t("stock.uncounted", {n: without("uncounted")})),
    without("unreadable") > 0 && h("p.warn", {}, `▲ ${t("stock.unreadable", {n: without("unreadable")})}`));
}
