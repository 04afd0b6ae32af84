// Copies of all that the cell keeps: making one, those there are; and reading the database through.
import {h} from "../dom.js";
import {asSentence, dayTime, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, isStale, model, operates} from "../model.js";
import {button, card, empty, fact, facts, cellSays} from "../parts.js";
import {doSteps, isBusy, run, workAt, workRow} from "../work.js";

const kShown = 10;
let told = null;  // GET /backups
let more = false, asked = 0;

export async function enterBackups() {
  const mine = ++asked;  // only the last question is answered, and asked again where it was not
  try {
    const fresh = await get(`/backups?limit=${more ? 1000 : kShown}`);
    if (mine === asked) told = fresh;
  } catch (fault) {
    setTimeout(() => { if (mine === asked) enterBackups(); }, kAgainMs);
  }
  changed();
}

const size = (bytes) => (bytes < 1e9 ? `${Math.max(1, Math.round(bytes / 1e6))} MB` : `${(bytes / 1e9).toFixed(1)} GB`);

const backup = () => doSteps("backup", [{text: t("backup.doing"), act: async () => { const made = await run("backup", "/backups"); enterBackups(); return made; }}]);
const check = () => doSteps("check", [{text: t("check.doing"), act: () => run("check", "/integrity-check")}]);

function row(one) {
  if (one.fault) return h("li.bad", {"data-key": one.name}, h("div", {}, h("b", {}, `▲ ${one.name}`), h("div", {}, cellSays(asSentence(one.fault)))));
  const missing = (one.missing || []).length;
  return h("li", {"data-key": one.name, class: missing ? "bad" : ""}, h("div", {}, h("b", {}, dayTime(one.made_at)),
    h("div.dim", {}, [t("stock.panels", {n: one.panels}), t("backup.jobs", {n: one.jobs}), t("pieces", {n: one.pieces}), size(one.bytes)].join(", ")),
    missing > 0 && h("div", {}, `▲ ${t("backup.missing", {n: missing})}`)));
}

export function backupsCard() {
  const {database = {}} = model.cell, made = workAt("backup").result, read = workAt("check").result;
  const off = (place) => !operates() || isStale() || isBusy(place);
  return card(t("backups"), h("p.dim", {}, t("backups.about")),
    h("div.commands", {}, button(t("backup.do"), backup, {id: "do-backup", wide: true, disabled: off("backup")})),
    workRow("backup"), made && h("p", {role: "status", id: "backup-made"}, t("backup.made", {at: dayTime(made.made_at), folder: made.folder})),
    told === null ? empty(t("connecting")) : !told.backups.length ? empty(t("backups.none")) : h("ul.list", {id: "backups"}, ...told.backups.map(row)),
    told && told.next && h("div.commands", {}, button(t("backups.more"), () => { more = true; enterBackups(); }, {wide: true})),
    facts(fact(t("database"), h("span", {}, t(`database.${database.state || "good"}`), database.sentence && " ", database.sentence && cellSays(asSentence(database.sentence))), database.state === "damaged"),
      database.checked && fact(t("database.checked"), dayTime(database.checked))),
    h("div.commands", {}, button(t("check.do"), check, {id: "do-check", wide: true, small: t("check.small"), disabled: off("check")})),
    workRow("check"), read && (database.state || "good") === "good" && h("p", {role: "status", id: "check-done"}, t("check.done")));
}
