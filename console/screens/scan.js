// A panel onto the glass and into stock: what is asked before, how far it is, what was found.
import {h} from "../dom.js";
import {squareCm, t} from "../words.js";
import {changed, mayChange, model} from "../model.js";
import {command} from "../commands.js";
import {button, card, fact, facts, link, taskRow} from "../parts.js";
import {picture} from "../pictures.js";

const wanted = {face: "show", panel: "", more: false};
let begun = 0;  // the task
const verdicts = new Map();  // by proposal

export function draw() {
  const task = model.tasks.get(begun);
  const busy = Boolean(task && task.state === "running");
  return h("div.columns.two", {},
    h("div.column", {}, card(t("screen.scan"), h("p", {}, t("scan.how")),
      h("div.form", {},
        choice(t("scan.face"), wanted.face, [["show", t("face.show")], ["back", t("face.back")]], (face) => { wanted.face = face; }),
        choice(t("scan.which"), wanted.panel, [["", t("scan.new")], ...model.panels.filter((panel) => !panel.retired).map((panel) => [panel.id, panel.id])], (panel) => { wanted.panel = panel; }),
        h("label.tick", {}, h("input", {type: "checkbox", checked: wanted.more, onchange: (event) => { wanted.more = event.target.checked; changed(); }}), t("scan.more"))),
      h("div.commands", {}, button(t("scan.do"), scan, {wide: true, id: "do-scan", disabled: !mayChange() || busy})),
      busy && h("ul.list", {}, taskRow(task, () => command(`/tasks/${task.id}`, {method: "DELETE"}))))),
    h("div.column", {}, foundCard(task)));
}

const choice = (label, value, options, take) => h("label", {}, label,
  h("select", {value, onchange: (event) => { take(event.target.value); changed(); }}, ...options.map(([word, text]) => h("option", {value: word}, text))));

async function scan() {
  const body = {face: wanted.face, more: wanted.more};
  if (wanted.panel) body.panel = wanted.panel;
  const started = await command("/scans", {body});
  if (started) begun = started.task;
  changed();
}

function foundCard(task) {
  if (!task || task.state === "running") return null;
  if (task.error) return card(t("scan.found"), h("ul.list", {}, taskRow(task)));
  const {result} = task;
  if (!result) return null;
  if (result.proposal) return proposalCard(result);
  if (!result.panel) return card(t("scan.found"), h("p.big", {}, t("scan.tiles", {n: result.tiles})));
  const {rms_mm: rms} = result.registration || {};
  return card(t("scan.found"),
    h("p.big", {}, t("scan.result", {panel: result.panel, face: t(`face.${result.face}`)}), result.new && `, ${t("scan.is_new")}`),
    picture(`/panels/${encodeURIComponent(result.panel)}/map.png?width=640`, t("panel.map", {panel: result.panel}), {version: String(task.id)}),
    facts(result.usable_mm2 && fact(t("scan.usable"), squareCm(result.usable_mm2)), typeof rms === "number" && fact(t("scan.rms"), `${rms.toFixed(3)} mm`),
      ...warnings(result),
      result.differences && result.differences.length > 0 && fact(t("scan.warning"), t("panel.differences", {n: result.differences.length}), true)),
    link(`#panels/${result.panel}`, t("scan.open"), {class: "go"}));
}

const warnings = (result) => (result.warnings || []).map((warning) => fact(t("scan.warning"), warning.text, true));

// It waits for a word. Its warnings stand beside the button that overrules them, each by its name.
function proposalCard(result) {
  const {proposal: number, warnings: doubts = []} = result;
  const decided = verdicts.get(number);
  if (decided) {
    const task = model.tasks.get(decided.task);
    if (task && task.state === "done" && !decided.refused) return card(t("scan.found"), h("p.big", {}, t("scan.accepted")));
    if (decided.refused) return card(t("scan.found"), h("p.big", {}, t("scan.refused")));
    if (task && task.state !== "failed") return card(t("scan.found"), h("ul.list", {}, taskRow(task)));
  }
  const keep = (told, refused) => { if (told) verdicts.set(number, {task: told.task, refused}); changed(); };
  const accept = async () => keep(await command(`/proposals/${number}/accept`, {body: doubts.length ? {override: doubts.map((doubt) => doubt.name)} : {}}), false);
  const refuse = async () => keep(await command(`/proposals/${number}/refuse`, {body: {}}), true);
  return card(t("scan.proposal"),
    picture(`/proposals/${number}/picture.png`, t("scan.proposal"), {version: String(number)}),
    facts(result.size_mm && fact(t("scan.size"), result.size_mm.map((side) => side.toFixed(1)).join(" × ") + " mm"),
      result.usable_mm2 && fact(t("scan.usable"), squareCm(result.usable_mm2)), ...warnings(result)),
    h("div.commands", {},
      button(t(doubts.length ? "scan.accept_all_the_same" : "scan.accept"), accept, {id: "do-accept", disabled: !mayChange()}),
      button(t("scan.refuse"), refuse, {id: "do-refuse", disabled: !mayChange()})));
}
