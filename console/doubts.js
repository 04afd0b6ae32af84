// What a scan is in doubt about, each with an answer of its own: nobody accepts what was not looked at one by one.
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {changed, mayChange, mayDo} from "./model.js";
import {hint, inEnglish} from "./parts.js";

const answered = new Map();  // names of doubts by proposal
const answersTo = (seen) => answered.get(seen.number) || new Set();

export const openDoubts = (seen) => seen.warnings.filter(({name}) => !answersTo(seen).has(name));

// Of somebody else's role, whoever has looked.
export const mayOverrule = (seen) => seen.warnings.every(({overruled_by: role}) => mayDo(role || "operator"));

// What `accept` is told, once all are answered.
export const overruled = ({warnings}) => (warnings.length ? {override: warnings.map(({name}) => name)} : {});
// Of these, all that are open; what was decided on is asked no more.
export function keepDoubts(proposals) {
  for (const number of [...answered.keys()]) if (!proposals.some((one) => one.number === number)) answered.delete(number);
}

function answer(seen, name, is) {
  const names = new Set(answersTo(seen));
  if (is) names.add(name); else names.delete(name);
  answered.set(seen.number, names);
  changed();
}

export function doubtRows(seen) {
  if (!seen.warnings.length) return null;
  const open = openDoubts(seen);
  return [
    h("ul.list.doubts", {"aria-label": t("doubts")}, ...seen.warnings.map(({name, text}) => h("li", {"data-key": name, class: open.some((one) => one.name === name) ? "bad" : ""},
      h("div", {}, h("p", {}, "▲ ", inEnglish(asSentence(text))),
        h("label.tick", {}, h("input", {type: "checkbox", "data-doubt": name, checked: answersTo(seen).has(name), disabled: !mayChange(), onchange: (event) => answer(seen, name, event.target.checked)}), t("doubts.answer")))))),
    !mayOverrule(seen) && h("p.viewer", {}, t("doubts.maintainer")),
    open.length > 0 && hint(t("doubts.first", {n: open.length}))];
}
