// What a scan is in doubt about, each with an answer of its own: nobody accepts what was not looked at one by one. Of a strip that it asks about
// the answer is that it is wood, or that it is none; the strip stands on the picture.
import {h, svg} from "./dom.js";
import {asSentence, t} from "./words.js";
import {changed, mayChange, mayDo} from "./model.js";
import {hint, cellSays} from "./parts.js";
import {middleOf} from "./outlines.js";

const kSeen = "seen", kWood = "wood", kNoWood = "no_wood";  // answers; the last two of strips alone
const answered = new Map();  // answers by name of the doubt, by proposal
const answersTo = (seen) => answered.get(seen.number) || new Map();
const stripOf = (seen, name) => (seen.asked || []).find(({warning}) => warning === name);
const numberOf = (name) => name.replace(/^strip-/, "");

export const openDoubts = (seen) => seen.warnings.filter(({name}) => !answersTo(seen).has(name));

// Of somebody else's role, whoever has looked.
export const mayOverrule = (seen) => seen.warnings.every(({overruled_by: role}) => mayDo(role || "operator"));

// What `accept` is told, once all are answered.
export function overruled(seen) {
  const out = {}, said = answersTo(seen);
  for (const {name} of seen.warnings) {
    const answer = said.get(name), word = answer === kWood || answer === kNoWood ? answer : "override";
    out[word] = [...(out[word] || []), name];
  }
  return out;
}

// Of these, all that are open; what was decided on is asked no more.
export function keepDoubts(proposals) {
  for (const number of [...answered.keys()]) if (!proposals.some((one) => one.number === number)) answered.delete(number);
}

function answer(seen, name, is) {
  const said = new Map(answersTo(seen));
  if (is) said.set(name, is); else said.delete(name);
  answered.set(seen.number, said);
  changed();
}

const tick = (seen, name) => h("label.tick", {}, h("input", {type: "checkbox", "data-doubt": name, checked: answersTo(seen).has(name), disabled: !mayChange(), onchange: (event) => answer(seen, name, event.target.checked && kSeen)}), t("doubts.answer"));

// Pressed once more, it is open again.
function choice(seen, name) {
  const said = answersTo(seen).get(name);
  const one = (is, word) => h("button", {type: "button", "data-strip": `${name}-${is}`, "aria-pressed": String(said === is), disabled: !mayChange(), onclick: () => answer(seen, name, said !== is && is)}, t(word));
  return [h("div.commands", {role: "group", "aria-label": t("strip.group", {n: numberOf(name)})}, one(kWood, "strip.wood"), one(kNoWood, "strip.no_wood")),
    said && hint(t(said === kWood ? (stripOf(seen, name).taken ? "strip.as_seen" : "strip.given") : "strip.withheld"))];
}

export function doubtRows(seen) {
  if (!seen.warnings.length) return null;
  const open = openDoubts(seen);
  return [
    h("ul.list.doubts", {"aria-label": t("doubts")}, ...seen.warnings.map(({name, text}) => {
      const strip = stripOf(seen, name);
      return h("li", {"data-key": name, class: open.some((one) => one.name === name) ? "bad" : ""},
        h("div", {}, strip && h("b", {}, t("strip.name", {n: numberOf(name), sure: Math.round(100 * strip.confidence)})), h("p", {}, "▲ ", cellSays(asSentence(text))),
          strip ? choice(seen, name) : tick(seen, name)));
    })),
    !mayOverrule(seen) && h("p.viewer", {}, t("doubts.maintainer")),
    open.length > 0 && hint(t("doubts.first", {n: open.length}))];
}

// The picture with the strips that are asked about, once it is `shown`. What is around it stays: an <img> that moves is another one.
export function withStrips(seen, image, shown) {
  const strips = seen.asked || [];
  if (!strips.length) return image;
  const [wide, high] = seen.size_mm, letter = Math.max(wide, high) / 28, said = answersTo(seen);
  const shape = ({warning, outline_mm: ring}) => {
    const points = ring.map(([x, y]) => `${x.toFixed(2)},${(high - y).toFixed(2)}`).join(" "), [x, y] = middleOf(ring), is = said.get(warning);
    const words = `${numberOf(warning)} ${is === kWood ? "✓" : is === kNoWood ? "✕" : "?"}`, half = letter * (.45 + .32 * words.length);
    return svg("g", {class: is || "open"}, svg("polygon.ground", {points}), svg("polygon.line", {points}),
      svg("rect", {x: x - half, y: high - y - letter, width: 2 * half, height: 2 * letter, rx: letter / 2}),
      svg("text", {x, y: high - y + letter * .42, "font-size": 1.25 * letter, "text-anchor": "middle"}, words));
  };
  return h("div.seen-strips", {"data-key": `strips-${seen.number}`}, image,
    shown && svg("svg", {viewBox: `0 0 ${wide} ${high}`, role: "img", "aria-label": t("strip.picture", {n: strips.length})}, ...strips.map(shape)));
}
