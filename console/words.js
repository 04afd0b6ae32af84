// What the page says, from one catalogue of each language (words/en.js, words/de.js). What the cell itself says comes
// from the daemon, in English; words/said_de.js has its sentences in German.
import {kAgainMs, pause, recall} from "./link.js";

// Its own name for each, which is on the button that changes to it, and how it writes dates.
export const kLanguages = {
  en: {name: "English", dates: "en-GB"},
  de: {name: "Deutsch", dates: "de-DE"},
};
const chosen = recall("veneer_language") || navigator.language.slice(0, 2);
// One is asked for, by whoever reads it; another one that does not come leaves English. While neither comes both are asked for
// again: the daemon may begin anew just then.
async function firstOf(...asked) {
  for (; ; await pause(kAgainMs)) {
    for (const one of asked) try {
      const [{words}, {said}] = await Promise.all([import(`./words/${one}.js`), one === "en" ? {said: {}} : import(`./words/said_${one}.js`)]);
      return {language: one, words, sentences: said};
    } catch (fault) { continue; }
  }
}
const {language, words, sentences} = await firstOf(...(chosen in kLanguages && chosen !== "en" ? [chosen] : []), "en");
export {language, sentences};
document.documentElement.lang = language;
const {dates} = kLanguages[language];

// What is seldom wanted has words of its own, which come with it: words/seldom_en.js.
const learnt = {};
export async function learn(name) { Object.assign(learnt, (await import(`./words/${name}_${language}.js`)).words); }

// t("pieces", {n: 3}): an entry may be {one, other}, chosen by n.
export function t(key, values = {}) {
  let text = words[key] ?? learnt[key];
  if (text === undefined) return key;
  if (typeof text === "object") text = text[new Intl.PluralRules(language).select(values.n)] || text.other;
  return text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? values[name] : whole));
}

export const asSentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) + (/[.!?)]$/.test(text) ? "" : ".") : "");

export function span(seconds) {
  if (seconds < 90) return t("seconds", {n: Math.round(seconds)});
  if (seconds < 5400) return t("minutes", {n: Math.round(seconds / 60)});
  return t("hours", {h: Math.floor(seconds / 3600), m: Math.round((seconds % 3600) / 60)});
}
export const ago = (ms) => (ms < 1500 ? t("now") : t("ago", {span: span(ms / 1000)}));
export const clockTime = (at = new Date()) => at.toLocaleTimeString(dates);
export const dayTime = (at) => new Date(at).toLocaleString(dates, {dateStyle: "medium", timeStyle: "short"});
export const squareCm = (mm2) => `${Math.round((mm2 || 0) / 100)} cm²`;
export const sizeOf = (thing) => `${Math.round(thing.width_mm)} × ${Math.round(thing.height_mm)} mm`;
