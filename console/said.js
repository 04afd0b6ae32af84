// What the cell says, which is English, in the language of the page: by the sentences of words/said_de.js.
import {sentences} from "./words.js";

const lowered = (text) => text.charAt(0).toLowerCase() + text.slice(1);
const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");
const kPlace = /“?\{=?(\d+)\}/g;  // “{1}” and {=1} are names, whatever their words are

const whole = new Map(), patterns = [];
for (const [english, own] of Object.entries(sentences)) {
  const isName = {};
  for (const [place, n] of english.matchAll(kPlace)) isName[n] = /[“=]/.test(place);
  if (!Object.keys(isName).length) whole.set(lowered(english), own);
  else patterns.push({words: new RegExp(`^${lowered(english).split(/\{=?\d+\}/).map(escaped).join("(.+?)")}$`), own, isName});
}

// A name or a number, as it is; what is said inside of what is said. Nothing for words that nobody has told in this language.
const isProse = (text) => /[a-z]{2,} [a-z]{2,} [a-z]{2,}|[;:] /.test(text);
const insertion = (value, isName) => (isName ? value : translated(value) ?? (isProse(value) ? null : value));

function find(text) {
  const said = whole.get(lowered(text));
  if (said !== undefined) return said;
  for (const {words, own, isName} of patterns) {
    const found = lowered(text).match(words);
    if (!found) continue;
    // As it was written: only a sentence's first letter was lowered.
    const values = found.slice(1).map((value, i) => insertion(i === 0 && found[0].startsWith(value) ? text.slice(0, value.length) : value, isName[i + 1]));
    if (values.every((value) => value !== null)) return own.replace(/\{(\d+)\}/g, (place, n) => values[n - 1]);
  }
  for (const joint of ["; ", ": "]) {
    for (let at = text.indexOf(joint); at > 0; at = text.indexOf(joint, at + 1)) {
      const before = translated(text.slice(0, at)), behind = before && translated(text.slice(at + joint.length));
      if (behind) return before + joint + behind;
    }
  }
  return null;
}

const kMostKept = 500;
const known = new Map();
function translated(text) {
  if (!known.has(text)) {
    if (known.size >= kMostKept) known.clear();
    known.set(text, find(text));
  }
  return known.get(text);
}

// null for what is not known. A sentence stays one, what was none does not become one.
export function inOwnWords(text) {
  if (!whole.size && !patterns.length) return null;
  const isSentence = text.endsWith("."), own = translated(isSentence ? text.slice(0, -1) : text);
  if (own === null) return null;
  return (text[0] === lowered(text)[0] ? own : own.charAt(0).toUpperCase() + own.slice(1)) + (isSentence ? "." : "");
}
