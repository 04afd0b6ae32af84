// Who did what, newest first: found by its words, its kind, a job or a panel, and a time; the cell looks for it, so that
// what is older than this page is found too. What a row names can be gone to.
import {h} from "../dom.js";
import {dayTime, language, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed, model} from "../model.js";
import {button, empty, link, tWith} from "../parts.js";
import {told, whatOf} from "./log_words.js";

const kPage = 200;
const kTypedMs = 300;  // somebody who types is not done yet
const kKinds = ["alarm", "run", "job", "cell", "laser", "device", "mask", "lease", "task", "api"];  // what rows begin with
const kNothing = {text: "", kind: "", job: "", panel: "", since: "", until: ""};

let wanted = {...kNothing};
let filters = false;  // on a phone, where they are shown only when they are asked for
let entries = null, next = null, fault = "";
let asked = 0;  // the last question; answers to earlier ones are old
let typing = 0;

// What rows are about, in the page's language; until it has come, by the names that the cell gives.
let catalogue = {names: {}, ends: {}};
async function loadWords() {
  try { catalogue = await import(`../words/log_${language}.js`); } catch (fault) { setTimeout(loadWords, kAgainMs); }
  changed();
}

const utc = (local) => (local ? new Date(local).toISOString() : "");

function query() {
  const {text, kind, job, panel, since, until} = wanted;
  const parts = Object.entries({text: text.trim(), kind, job, panel, since: utc(since), until: utc(until)}).filter(([, value]) => value);
  return parts.map(([name, value]) => `&${name}=${encodeURIComponent(value)}`).join("");
}

async function load(cursor = null) {
  const mine = ++asked;
  try {
    const page = await get(`/audit?limit=${kPage}${cursor === null ? "" : `&cursor=${cursor}`}${query()}`);
    if (mine !== asked) return;
    entries = cursor === null ? page.entries : [...entries, ...page.entries];
    next = page.next ?? null;
    fault = "";
  } catch (error) {
    if (mine !== asked) return;
    fault = error.message;
    if (!error.answered) setTimeout(() => { if (mine === asked) load(cursor); }, kAgainMs);
  }
  changed();
}

function want(what, waitMs = 0) {
  wanted = {...wanted, ...what};
  clearTimeout(typing);
  if (waitMs) typing = setTimeout(() => load(), waitMs); else load();
  changed();
}

// #log/job/3 and #log/panel/P-0001 are what is noted of that one.
export function enter(of, which) {
  wanted = {...kNothing, ...(["job", "panel"].includes(of) && which ? {[of]: which} : {})};
  entries = null;
  loadWords();
  load();
}

export function draw() {
  const narrowed = Object.values(wanted).some(Boolean);
  return [
    tools(narrowed),
    fault && h("p.warn", {role: "alert"}, tWith("log.fault", "why", fault)),
    entries === null ? !fault && empty(t("log.asking")) : !entries.length && empty(t(narrowed ? "log.none_found" : "log.none")),
    entries && entries.length > 0 && h("div.table", {}, h("table", {}, h("thead", {}, h("tr", {}, ...["at", "who", "what", "detail"].map((one) => h("th", {scope: "col"}, t(`log.${one}`))))),
      h("tbody", {}, ...entries.map((one) => h("tr", {"data-key": one.id}, h("td", {}, dayTime(one.at)), h("td", {}, one.who), whatCell(one.what), h("td", {lang: "en"}, ...withLinks(one))))))),
    next !== null && h("div.commands", {}, button(t("log.more"), () => load(next), {id: "log-more"})),
  ];
}

// With its own name under it, which is what the search finds.
function whatCell(what) {
  const words = whatOf(what, catalogue), name = h("small.dim", {lang: "en"}, what);
  return h("td", {}, ...(words ? [words, " ", name] : [name]));
}

function tools(narrowed) {
  const choice = (name, options) => h("label", {}, t(`log.of.${name}`), h("select", {id: `log-${name}`, value: wanted[name], onchange: (event) => want({[name]: event.target.value})},
    h("option", {value: ""}, t("log.all")), ...options.map(([value, text]) => h("option", {value}, text))));
  const time = (name) => h("label", {}, t(`log.of.${name}`), h("input", {type: "datetime-local", id: `log-${name}`, value: wanted[name], onchange: (event) => want({[name]: event.target.value})}));
  // Whatever is asked for can be seen to be: an archived job and a panel that is gone too.
  const withOwn = (options, own) => (own && !options.some(([value]) => value === own) ? [[own, own], ...options] : options);
  const jobs = withOwn(model.jobs.slice().reverse().map((job) => [String(job.id), `${job.id} ${job.name}`]), wanted.job);
  const panels = withOwn(model.panels.map((panel) => [panel.id, panel.id]), wanted.panel);
  const {text, ...others} = wanted, more = filters || Object.values(others).some(Boolean);
  return h("div.tools.log-tools", {role: "search", class: more ? "more" : ""},
    h("label.words", {}, t("log.search"), h("input", {type: "search", id: "log-text", value: text, placeholder: t("log.search_hint"), oninput: (event) => want({text: event.target.value}, kTypedMs)})),
    button(t(more ? "log.fewer_filters" : "log.filters"), () => { filters = !more; changed(); }, {id: "log-filters", "aria-expanded": String(more)}),
    choice("kind", kKinds.map((kind) => [kind, t(`log.kind.${kind}`)])), choice("job", jobs), choice("panel", panels), time("since"), time("until"),
    button(t("log.again"), () => load(), {id: "log-again"}),
    narrowed && button(t("log.everything"), () => want({...kNothing}), {id: "log-everything"}));
}

// Panels and jobs by the names that the cell gives them: "run 3 of job 12 on P-0001", "/jobs/12/start". Whatever
// somebody has typed into the cell stands here as text.
const kNamed = /\b(P-\d+)\b|\bjob (\d+)\b|\/jobs\/(\d+)/g;
function withLinks({what, detail}) {
  if (what === "job.start" && /^\d+$/.test(detail)) return [link(`#history/${detail}`, t("log.job", {n: detail}))];
  const out = [], words = told(what, detail);
  let at = 0;
  for (const found of words.matchAll(kNamed)) {
    const [text, panel, job, request] = found;
    out.push(words.slice(at, found.index), link(panel ? `#panels/${panel}` : `#history/${job || request}`, text));
    at = found.index + text.length;
  }
  return [...out, words.slice(at)];
}
