// A panel onto the glass and into stock: what is asked before, how far it is, what was found.
import {h} from "../dom.js";
import {dayTime, squareCm, t} from "../words.js";
import {changed, mayChange, model, panelOf} from "../model.js";
import {command, isSure, sameThing} from "../commands.js";
import {get, kAgainMs} from "../link.js";
import {button, card, empty, fact, facts, cellSays, link, taskRow} from "../parts.js";
import {isShown, picture} from "../pictures.js";
import {doubtRows, keepDoubts, mayOverrule, openDoubts, overruled, withStrips} from "../doubts.js";
import {sheetHands} from "./sheet_hands.js";

const wanted = {face: "show", panel: "", more: false, retag: false, bare: false};
let begun = 0;  // the task
let told = 0;   // the task that was told of new tags, or of a part without old ones; then the one that takes it into stock
let proposed = 0;  // what came of it, and waits
let sawn = "";  // the panel whose parts are scanned

// #scan/P-0001 scans that panel again; #scan/part/P-0001 a part that was sawn off it.
export function enter(panel, parent) {
  followSeries();  // what somebody goes to comes after what was begun
  sawn = panel === "part" && parent ? parent : "";
  wanted.bare = false;
  if (panel === "part") { choosePanel(""); wanted.face = "show"; } else if (panel) choosePanel(panel);
}

// New tags were glued to the panel that was chosen before.
function choosePanel(panel) {
  if (wanted.panel !== panel) { wanted.retag = false; told = proposed = 0; }
  wanted.panel = panel;
}

// A face that was never scanned has new tags only. What nobody can see is not sent, unless the tiles before were scanned so.
const knowsFace = () => { const panel = panelOf(wanted.panel); return Boolean(panel) && panel.faces.includes(wanted.face); };
const hasNewTags = () => wanted.retag && (knowsFace() || Boolean((openSeries() || {}).retag));
const mayBeBare = () => Boolean(sawn) && !wanted.panel && wanted.face === "show";

// Once the panel has them the next scan of it is an ordinary one. A panel that has left the stock is scanned as none.
function followChoice(task) {
  const {proposal, panel} = (told && task && task.id === told && task.state === "done" && task.result) || {};
  if (proposal) { told = 0; proposed = proposal; }
  else if (panel) { told = proposed = 0; wanted.retag = wanted.bare = false; }
  if ((panelOf(wanted.panel) || {}).retired) choosePanel("");
}

export function draw() {
  const task = model.tasks.get(begun);
  const busy = Boolean(task && task.state === "running");
  followWaiting(task);
  followSeries();
  followChoice(task);
  return h("div.columns.two", {},
    h("div.column", {}, card(t("screen.scan"), h("p", {}, t("scan.how")),
      h("div.form", {},
        choice(t("scan.face"), wanted.face, [["show", t("face.show")], ["back", t("face.back")]], (face) => { wanted.face = face; }),
        choice(t("scan.which"), wanted.panel, [["", t("scan.new")], ...model.panels.filter((panel) => !panel.retired).map((panel) => [panel.id, panel.id])], choosePanel),
        knowsFace() && tick("retag", t("scan.retag")), mayBeBare() && tick("bare", t("scan.bare", {panel: sawn})), tick("more", t("scan.more"))),
      h("div.commands", {}, button(t("scan.do"), () => { if (!isOther()) scan(); }, {wide: true, id: "do-scan", disabled: !mayChange() || busy || isOther() || !series.isLooked()})),
      seriesPart(busy),
      busy && h("ul.list", {}, taskRow(task, () => command(`/tasks/${task.id}`, {method: "DELETE"})))), sheetHands("scanner", wanted.face)),
    h("div.column", {}, ...waiting.map((seen) => proposalCard(seen, task)), foundCard(task)));
}

const choice = (label, value, options, take) => h("label", {}, label,
  h("select", {value, onchange: (event) => { take(event.target.value); changed(); }}, ...options.map(([word, text]) => h("option", {value: word}, text))));
const tick = (name, text) => h("label.tick", {"data-key": name}, h("input", {type: "checkbox", id: `scan-${name}`, checked: wanted[name], onchange: (event) => { wanted[name] = event.target.checked; changed(); }}), text);

// ---- a series of tiles ----------------------------------------------------------------------------------------------

// The series whose next tile a scan would be, whoever began it: {tiles, panel, face}; null: there is none.
const openSeries = () => (model.cell && model.cell.open_scan) || null;
const series = sameThing();

// A tile of another face would end it, and its tiles with it; one of another panel fits none of them.
function isOther() {
  const open = openSeries();
  const isAnother = open && open.panel && (wanted.panel ? wanted.panel !== open.panel : Boolean(sawn));  // a part is none in stock yet
  return Boolean(open) && (wanted.face !== open.face || Boolean(isAnother));
}

// What is chosen begins as the series is of, and is anybody's then.
let chosenFor = "null";
function followSeries() {
  const open = openSeries(), now = JSON.stringify(open && [open.panel, open.face, open.retag]);
  series.drawn(JSON.stringify(open));
  if (now === chosenFor) return;
  chosenFor = now;
  wanted.retag = Boolean(open && open.retag);  // new tags were those of the tiles that are gone
  if (open) Object.assign(wanted, {face: open.face, panel: open.panel || ""});
}

// What is given up is what stood there when it was pressed, and no tile that came meanwhile.
function seriesPart(busy) {
  const open = openSeries(), kept = model.cell && model.cell.kept_scan, key = JSON.stringify(open);
  if (!open) return kept ? keptPart(kept, busy) : null;
  const asShown = () => series.isLooked() && JSON.stringify(openSeries()) === key;
  const anew = async () => { if (await isSure(t("scan.anew.sure", {n: open.tiles}), asShown)) scan({anew: true}); };
  return h("div.note", {"data-key": "series", role: "status"},
    h("p", {}, t("scan.open_series", {n: open.tiles, of: [open.panel, open.face && t(`face.${open.face}`), open.retag && t("scan.with_new_tags")].filter(Boolean).join(", ") || t("scan.of_new")})),
    isOther() ? h("p.warn", {id: "scan-other"}, `▲ ${t("scan.other")}`) : h("p", {}, t("scan.next_tile")),
    h("div.commands", {}, button(t("scan.anew"), anew, {wide: true, id: "scan-anew", small: t("scan.anew.small"), disabled: !mayChange() || busy || !series.isLooked()})));
}

// One that was refused: a tile of it is scanned anew, and what the series is of stays. By its number in the order of scanning.
const keptOne = sameThing();
let tile = 0, tileOf = "";
function keptPart(kept, busy) {
  if (tileOf !== kept.since) { tileOf = kept.since; tile = kept.tiles; }
  const key = JSON.stringify(kept), n = tile >= 1 && tile <= kept.tiles ? tile : kept.tiles;
  keptOne.drawn(key);
  const asShown = () => keptOne.isLooked() && JSON.stringify((model.cell || {}).kept_scan) === key;
  return h("div.note", {"data-key": "kept", role: "status"}, h("p", {}, t("scan.kept_series", {n: kept.tiles, at: dayTime(kept.since)})),
    h("div.form", {}, choice(t("scan.again.which"), String(n), Array.from({length: kept.tiles}, (_, at) => [String(at + 1), t("scan.again.tile", {n: at + 1})]), (word) => { tile = Number(word); })),
    h("div.commands", {}, button(t("scan.again", {n}), () => { if (asShown()) begin({again: n}); }, {wide: true, id: "scan-again-tile", small: t("scan.again.small"), disabled: !mayChange() || busy || !keptOne.isLooked()})));
}

async function begin(body) {
  const started = await command("/scans", {body});
  if (started) begun = started.task;
  changed();
  return started;
}

async function scan({anew = false} = {}) {
  const body = {face: wanted.face, more: wanted.more, ...(anew && {anew})};
  if (wanted.panel) body.panel = wanted.panel;
  if (hasNewTags()) body.retag = true;
  if (wanted.bare && mayBeBare()) body.part_of = sawn;
  const started = await begin(body);
  if (started && !body.more && (body.retag || body.part_of)) told = started.task;
}

function foundCard(task) {
  if (!task || task.state === "running") return null;
  if (task.error) return card(t("scan.found"), h("ul.list", {}, taskRow(task)));
  const {result} = task;
  if (!result) return null;
  if (result.proposal) return null;  // it stands among those that wait
  if (!result.panel) return null;  // a tile: the series tells of it
  return card(t("scan.found"),
    h("p.big", {}, t("scan.result", {panel: result.panel, face: t(`face.${result.face}`)}), result.new && `, ${t("scan.is_new")}`),
    picture(`/panels/${encodeURIComponent(result.panel)}/map.jpg?width=640`, t("panel.map", {panel: result.panel}), {version: String(task.id)}),
    facts(result.usable_mm2 && fact(t("scan.usable"), squareCm(result.usable_mm2)), ...fitFacts(result),
      ...warnings(result),
      result.differences && result.differences.length > 0 && fact(t("scan.warning"), t("panel.differences", {n: result.differences.length}), true)),
    link(`#panels/${result.panel}`, t("scan.open"), {class: "go"}));
}

// Of how many tiles, and how well tags and holes fit; of a first scan of one tile nothing tells that.
function fitFacts({tiles, registration}) {
  const {rms_mm, max_mm, left_out_mm} = registration || {};
  const length = (label, mm) => typeof mm === "number" && fact(t(label), `${mm.toFixed(3)} mm`);
  return [tiles > 1 && fact(t("scan.tile_count"), String(tiles)), length("scan.rms", rms_mm), length("scan.max", max_mm), length("scan.left_out", left_out_mm)];
}

const warnings = (seen) => (seen.warnings || []).map((warning) => fact(t("scan.warning"), cellSays(warning.text), true));

// What was seen and is not in stock yet, whoever scanned it; asked for anew whenever that may have changed.
let waiting = [], waitingFor = null;
function followWaiting(task) {
  const over = [...model.tasks.values()].filter(({state}) => state !== "running").length;  // anybody's: one of them may have decided
  const now = `${task ? task.id + task.state : ""} ${over} ${model.cell && model.cell.next_step ? model.cell.next_step.command : ""}`;
  if (now === waitingFor) return;
  waitingFor = now;
  const again = () => setTimeout(() => { if (waitingFor === now) { waitingFor = null; changed(); } }, kAgainMs);
  get("/proposals").then(({proposals}) => {
    if (waitingFor !== now) return;
    waiting = proposals;
    keepDoubts(proposals);
    changed();
    if (proposed && !proposals.some(({number}) => number === proposed)) followVerdict(proposed).catch((fault) => { if (fault.status === 404) proposed = 0; else again(); });  // the cell knows it no more
  }, again);
}

// Somebody has decided, here or elsewhere: once it is in stock, the ticks that it was scanned with are over.
async function followVerdict(number) {
  const {decided} = await get(`/proposals/${number}`);
  if (!decided || number !== proposed) return;
  if (decided.verdict === "accepted") wanted.retag = wanted.bare = false;
  proposed = 0;
  changed();
}

// What it is in doubt about stands before the buttons, each with its own answer.
function proposalCard(seen, task) {
  const {number, panel} = seen, mine = task && task.result && task.result.proposal === seen.number ? task.result : null;
  const take = async () => {
    if (openDoubts(seen).length || !mayOverrule(seen)) return;  // the button may be of a moment ago
    const accepted = await command(`/proposals/${number}/accept`, {body: overruled(seen)});
    if (accepted) begun = accepted.task;
    if (accepted && number === proposed) told = accepted.task;
    changed();
  };
  const refuse = async () => { await command(`/proposals/${number}/refuse`, {body: {}}); changed(); };
  // Nobody accepts what has not been shown yet.
  const path = `/proposals/${number}/picture.png`;
  const seenYet = isShown(document.querySelector(`img[data-picture="${path}"]`), path);
  return card(panel ? t("scan.proposal_of", {panel}) : t("scan.proposal"),
    !seenYet && empty(t("wood.picture_comes")),
    withStrips(seen, picture(path, t("scan.picture_of", {n: number}), {version: String(number), "data-key": `proposal-${number}`}), seenYet),
    facts(fact(t("scan.size"), `${seen.size_mm.map((side) => side.toFixed(1)).join(" × ")} mm`), fact(t("scan.usable"), squareCm(seen.usable_mm2)),
      seen.lost_mm2 > 0 && fact(t("scan.lost"), squareCm(seen.lost_mm2), true), seen.gained_mm2 > 0 && fact(t("scan.gained"), squareCm(seen.gained_mm2), true), ...(mine ? fitFacts(mine) : [])),
    (seen.remarks || []).map((remark) => h("p.fact", {}, cellSays(remark))),
    doubtRows(seen),
    h("div.commands", {},
      button(t("scan.accept"), take, {id: `accept-${number}`, disabled: !mayChange() || !seenYet || !mayOverrule(seen) || openDoubts(seen).length > 0}),
      button(t("scan.refuse"), refuse, {id: `refuse-${number}`, disabled: !mayChange()})));
}
