// Every job, archived ones too; of one of them its runs, who gave the word, and what became of its pieces.
import {h} from "../dom.js";
import {asSentence, dayTime, span, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, inCuttingOrder, loadJobs, mayChange, model} from "../model.js";
import {command, showRefusal} from "../commands.js";
import {button, card, empty, fact, facts, cellSays, jobWords, link} from "../parts.js";
import {picture} from "../pictures.js";

let told = null;  // GET /jobs/{id}
let steps = [];  // what happened to it as a whole, the oldest first
let planned = null, newest = null;  // the plan that it was made of, and the one that says where its pieces lie now
let version = "";

export function enter() {
  told = planned = newest = null;
  steps = [];
  version = "";
  if (!model.archived) { model.archived = true; loadJobs(); }
}

export function draw(id) {
  if (id) return oneJob(Number(id));
  return card(t("history.jobs"), !model.jobs.length && empty(t("jobs.none")), h("ul.list", {}, ...inCuttingOrder(model.jobs).map((job) => h("li", {"data-key": job.id},
    picture(`/jobs/${job.id}/preview.png?width=120`, "", {version: job.newest_plan, class: "wood", whenSeen: true}),
    h("div", {}, link(`#history/${job.id}`, job.name), h("div", {}, jobWords(job)), h("div.dim", {}, dayTime(job.created)))))));
}

function load(id) {
  const known = model.jobs.find((job) => job.id === id);
  const wanted = `${id} ${known ? JSON.stringify([known.state, known.cut, known.suspect, known.missing, known.archived, known.newest_plan]) : ""}`;
  if (version === wanted) return;
  version = wanted;
  lookUp(id).then(([job, events, ...plans]) => { if (version === wanted) { told = job; steps = events || []; [planned, newest] = plans; changed(); } }, (fault) => {
    if (version !== wanted) return;
    showRefusal(fault.message);
    setTimeout(() => { if (version === wanted) { version = ""; changed(); } }, kAgainMs);
  });
}

async function lookUp(id) {
  const planOf = (number) => get(`/plans/${number}`).catch(() => null);
  const [job, {events}] = await Promise.all([get(`/jobs/${id}`), get(`/history/events?kind=job&job=${id}`)]), plan = await planOf(job.plan);
  return [job, events, plan, job.newest_plan === job.plan ? plan : await planOf(job.newest_plan)];
}

// Of a run that is over, from its first motion to its last, with what it waited for.
const tookOf = (run) => (run.ended ? (new Date(run.ended) - new Date(run.started)) / 1000 : 0);

// What the picture costs, and how long all runs together took beside what was estimated for the plan.
function figures() {
  const cost = newest && newest.report && newest.report.cost_per_pixel, reckoned = planned && planned.report && planned.report.cutting_s;
  const took = (told.runs || []).reduce((sum, run) => sum + tookOf(run), 0);
  const times = [took > 0 && t("history.took", {span: span(took)}), reckoned > 0 && t("history.reckoned", {span: span(reckoned)})].filter(Boolean);
  return [typeof cost === "number" && fact(t("plan.cost"), `${cost.toFixed(4)}, ${t("plan.cost_about")}`), times.length > 0 && fact(t("history.time"), times.join(", "))];
}

async function archive(id, back) {
  if (back) await command(`/jobs/${id}/unarchive`); else await command(`/jobs/${id}/archive`);
  loadJobs();
}

function oneJob(id) {
  load(id);
  const back = link("#history", `← ${t("history.back")}`, {class: "back"});
  if (!told || told.id !== id) return back;
  const over = ["complete", "cancelled"].includes(told.state);
  return [
    h("div.tools", {}, back, h("h2.title", {}, t("history.job", {n: id, name: told.name}))),
    h("div.columns.two", {},
      h("div.column", {}, card(t("job"), picture(`/jobs/${id}/preview.png?width=640`, t("history.preview", {n: id}), {version: told.newest_plan}),
        facts(fact(t("passport.state"), jobWords(told)), fact(t("history.made"), dayTime(told.created)), ...figures(), told.next && fact(t("history.next"), cellSays(asSentence(told.next))),
          ...(told.panels || []).map((one) => fact(one.panel, t("job.cut", {cut: one.cut, n: one.pieces})))),
        h("div.commands", {}, link(`#assembly/${id}`, t("screen.assembly"), {class: "go"}), link(`#log/job/${id}`, t("log.open"), {class: "go"}),
          over && button(t(told.archived ? "history.unarchive" : "history.archive"), () => archive(id, told.archived), {disabled: !mayChange()}),
          !over && !told.now && button(t("history.cancel"), async () => { if (confirm(t("history.cancel_sure", {n: id}))) { await command(`/jobs/${id}/cancel`); loadJobs(); } }, {disabled: !mayChange()})))),
      h("div.column", {}, card(t("history.events"), h("ul.list", {}, ...steps.map((one, at) => h("li", {"data-key": at},
        h("div", {}, h("b", {}, t(`history.was.${one.what.replaceAll(" ", "_")}`)), h("div.dim", {}, [dayTime(one.at), one.who && t("history.by", {who: one.who})].filter(Boolean).join(", "))))))),
      card(t("history.runs"), h("ul.list", {}, ...(told.runs || []).map((run) => h("li", {"data-key": run.id},
        h("div", {}, h("b", {}, t("history.run", {panel: run.panel, at: dayTime(run.started), result: run.result === "done" ? t("history.done") : run.result || t("history.running")})),
          h("div.dim", {}, [run.who && t("history.who", {who: run.who}), t("history.fit", {mm: run.pose_rms_mm.toFixed(3)}), tookOf(run) > 0 && t("history.took", {span: span(tookOf(run))})].filter(Boolean).join(", ")))))))))];
}
