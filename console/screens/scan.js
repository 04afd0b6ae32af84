// A panel onto the glass and into stock: what is asked before, how far it is, what was found.
import {h} from "../dom.js";
import {squareCm, t} from "../words.js";
import {changed, mayChange, model} from "../model.js";
import {command} from "../commands.js";
import {button, card, fact, facts, link, taskRow} from "../parts.js";
import {picture} from "../pictures.js";

const wanted = {face: "show", panel: "", more: false};
let begun = 0;  // the task

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
  if (!result.panel) return card(t("scan.found"), h("p.big", {}, t("scan.tiles", {n: result.tiles})));
  const {rms_mm: rms} = result.registration || {};
  return card(t("scan.found"),
    h("p.big", {}, t("scan.result", {panel: result.panel, face: t(`face.${result.face}`)}), result.new && `, ${t("scan.is_new")}`),
    picture(`/panels/${encodeURIComponent(result.panel)}/map.png?width=640`, t("panel.map", {panel: result.panel}), {version: String(task.id)}),
    facts(result.usable_mm2 && fact(t("scan.usable"), squareCm(result.usable_mm2)), typeof rms === "number" && fact(t("scan.rms"), `${rms.toFixed(3)} mm`),
      ...(result.warnings || []).map((warning) => fact(t("scan.warning"), warning, true)),
      result.differences && result.differences.length > 0 && fact(t("scan.warning"), t("panel.differences", {n: result.differences.length}), true)),
    link(`#panels/${result.panel}`, t("scan.open"), {class: "go"}));
}
