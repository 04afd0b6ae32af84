// Parts that several screens are made of.
import {h} from "./dom.js";
import {asSentence, language, learn, span, t} from "./words.js";
import {kAgainMs, pause} from "./link.js";
import {changed, mayDo, model} from "./model.js";
import {byPage} from "./by_page.js";
import {inOwnWords} from "./said.js";

export const card = (title, ...children) => h("section.card", {"aria-label": title}, h("h2", {}, title), ...children);

// One that is not allowed to this role says so itself. `needs`: the role that it needs when it is disabled.
export const button = (label, act, {disabled = false, next = false, wide = false, small = "", needs = "operator", ...more} = {}) =>
    h("button", {type: "button", disabled, onclick: act, class: `${next ? "next" : ""} ${wide ? "wide" : ""}`, ...more},
      label, (disabled && lacking(needs)) || (small && h("small", {}, small)));

// What the cell says is English: told in the page's words where they are known, else read as what it is. What it says to do leads to
// where that is.
export function cellSays(text) {
  if (!text) return text;
  const own = inOwnWords(text), parts = byPage(own ?? text);
  if (language !== "en" && own === null) return h("span", {lang: "en"}, ...parts.map((part) => (part.href ? link(part.href, part.text, {lang: language}) : part.text ? h("span", {lang: language}, part.text) : part)));
  return parts.some(({text: told}) => told) ? parts.map((part) => (part.href ? link(part.href, part.text) : part.text || part)) : own ?? text;
}
// An entry of the catalogue, with what the cell says in the place of {name}.
export function tWith(key, name, said) {
  const [before, after] = t(key).split(`{${name}}`);
  return [before, cellSays(said), after];
}

// "needs an operator"; nothing when this role may.
export const lacking = (needs) => (model.role && !mayDo(needs) ? h("small.lacking", {}, t(`needs.${needs}`)) : null);

export const viewerHint = () => (model.role && !mayDo("operator") ? h("p.viewer", {}, t("viewer"), " ", link("#account", t("account.sign_in"), {class: "go"})) : null);

export const bar = (share, {suspect = 0, label = ""} = {}) =>
    h("div.bar", {role: "progressbar", "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": Math.round(100 * share), "aria-label": label || t("progress")},
      h("div.done", {share}), suspect > 0 && h("div.doubt", {share: suspect}));

export const fact = (label, text, bad = false) =>
    h("li", {class: bad ? "bad" : ""}, h("span", {"aria-hidden": "true"}, bad ? "▲" : ""), h("span.label", {}, label), h("span", {}, text));

export const facts = (...rows) => h("ul.facts", {}, ...rows);

export const empty = (text) => h("p.empty", {}, text);

export const hint = (text) => (text ? h("p.dim.hint", {}, text) : null);

// What is seldom wanted comes after the rest of its screen, with words of its own. `part`: it, once it is there; `comes()`: a line until
// then. However often it is asked for, it is fetched by one at a time.
export function later(fetch) {
  let asked = false;
  const one = {
    part: null,
    comes: () => (one.part ? null : empty(t("connecting"))),
    async ask() {
      if (asked) return;
      asked = true;
      while (!one.part) {
        try { [one.part] = await Promise.all([fetch(), learn("seldom")]); } catch (fault) { await pause(kAgainMs); }
      }
      changed();
    },
  };
  return one;
}

// Why a button is shut off by a link of the chain, and what to do; nothing when none is.
export const blockedHint = (link) => link && h("p.warn", {"data-blocked": link.name, role: "status"}, `▲ ${t(`interlock.${link.name}`)}: `, cellSays(asSentence(link.sentence)), " ", cellSays(link.remedy));

export function taskRow(task, cancel = null) {
  const failed = task.state === "failed" && task.error;
  return h("li.task", {"data-key": `task-${task.id}`},
    h("span", {}, failed && "▲ ", cellSays(failed ? task.error.message : task.text || task.kind)),
    task.state === "running" && bar(task.progress || 0, {label: task.text || task.kind}),
    task.state === "running" && cancel && button(t("task.cancel"), cancel));
}

export function jobWords(job) {
  // Of the job under way the status is newer than the list: one page tells one number.
  const current = model.cell && model.cell.job && model.cell.job.id === job.id;
  const {cut, suspect} = current ? model.cell.job : job;
  const now = current ? model.cell.job.now : job.now;
  const waits = !now && job.queue_place && model.jobs.filter((one) => one.queue_place).length > 1;
  const words = [t("job.number", {n: job.id}), waits && t("job.queue", {n: job.queue_place}), job.archived ? t("job.archived") : "", now ? cellSays(now) : t(`job.${job.state}`), t("job.cut", {cut, n: job.pieces})];
  if (suspect) words.push(`▲ ${t("job.suspect", {n: suspect})}`);
  if (job.state === "incomplete") words.push(`▲ ${t("job.missing", {n: job.missing})}`);
  return words.filter(Boolean).flatMap((word, at) => (at ? [", ", word] : [word]));
}

export const nowWords = (job) => (language === "en" ? asSentence([job.now, leftWords(job)].filter(Boolean).join(", "))
  : [cellSays(asSentence(job.now)), " ", asSentence(leftWords(job))]);

export const leftWords = (job) => (typeof job.eta_s === "number" ? t("left", {span: span(job.eta_s)}) : "");

export const link = (href, text, more = {}) => h("a", {href, ...more}, text);
