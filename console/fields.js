// Numbers that people type: with a point or a comma, and what is wrong with one said where it stands.
import {h} from "./dom.js";
import {language, t} from "./words.js";

const kNumber = /^-?(\d+([.,]\d*)?|[.,]\d+)$/;  // no sign for more than nothing, no exponent
// 1.200 is twelve hundred to whoever writes 1,2, and the other way round: nobody is asked to guess which was meant.
const kThousands = language === "de" ? /^-?[1-9]\d{0,2}\.\d{3}$/ : /^-?[1-9]\d{0,2},\d{3}$/;

// NaN: it is none. Blank is none either.
export function numberOf(text) {
  const typed = String(text).trim();
  return kNumber.test(typed) && !kThousands.test(typed) ? Number(typed.replace(",", ".")) : NaN;
}

// As this page's language writes it.
export const written = (value) => (language === "de" ? String(value).replace(".", ",") : String(value));

// "" when it may be so, else a sentence.
export function faultOf(text, {whole = false, least = -Infinity, most = Infinity, optional = false} = {}) {
  const typed = String(text).trim();
  if (!typed) return optional ? "" : t("number.blank");
  const value = numberOf(typed);
  if (kThousands.test(typed)) return t("number.thousands");
  if (!Number.isFinite(value)) return t("number.junk");
  if (whole && (!Number.isInteger(value) || /[.,]/.test(typed))) return t("number.whole");
  if (value < least) return t("number.least", {n: written(least)});
  return value > most ? t("number.most", {n: written(most)}) : "";
}

// Several, told at once where one button needs all of them: {label, text, rules} each.
export const firstFault = (...fields) => fields.map(({label, text, rules}) => ({label, fault: faultOf(text, rules)})).find(({fault}) => fault) || null;
export const faultWords = (found) => (found ? t("number.of", {label: found.label, fault: found.fault}) : "");

// `take` is given what was typed, faulty or not: whoever uses it asks faultOf first. `said`: the id of what says the fault, where it is
// not said under the field.
export function numberField(label, text, take, {whole = false, least, most, optional, said = "", ...more} = {}) {
  const fault = faultOf(text, {whole, least, most, optional});
  return h("label", {}, label,
    h("input", {type: "text", inputmode: whole ? "numeric" : "decimal", autocomplete: "off", value: String(text), "aria-invalid": fault ? "true" : null, "aria-describedby": said || null,
                oninput: (event) => take(event.target.value), ...more}),
    fault && !said && h("small.number-fault", {role: "status"}, `▲ ${fault}`));
}
