// What the audit keeps of a request or of what came of it, as a person reads it: JSON becomes "size 30 mm, patch 10 mm".

// What a row is about, in the words of a catalogue (words/log_en.js); null where it has none.
export function whatOf(what, {names, ends}) {
  if (Object.hasOwn(names, what)) return names[what];
  const [, name, end] = what.match(/^(.*)\.(done|failed|cancelled|refused)$/) || [];
  return name && Object.hasOwn(names, name) ? ends[end].replace("{what}", () => names[name]) : null;
}

const kUnits = [[/_mm2$/, (value) => `${round(value / 100)} cm²`], [/_um$/, (value) => `${round(value / 1000)} mm`], [/_mm_s$/, (value) => `${round(value)} mm/s`], [/_mm$/, (value) => `${round(value)} mm`],
                [/_deg$/, (value) => `${round(value)}°`], [/_s$/, (value) => `${round(value)} s`], [/_bytes$/, (value) => `${value} bytes`]];
// To three decimals: what was asked for is told as it was.
const round = (value) => String(Number(Math.abs(value) < .001 ? value.toPrecision(3) : value.toFixed(3)));
const plain = (name) => name.replace(/_/g, " ").trim();

function valueOf(value, unit) {
  if (typeof value === "number") return unit ? unit[1](value) : Number.isInteger(value) ? String(value) : round(value);
  if (Array.isArray(value)) return value.map((one) => valueOf(one, unit)).join(value.length === 2 && areNumbers(value) ? " × " : ", ");
  if (value && typeof value === "object") return `(${partsOf(value).join(", ")})`;
  return String(value);
}
const areNumbers = (value) => [value].flat().every((one) => typeof one === "number");

const kThings = ["air", "more"];  // "no air", but "not assembled"

// Nothing is said of what is not there; of what is so, its name alone.
function partsOf(object) {
  return Object.entries(object).flatMap(([name, value]) => {
    if (value === null || value === "" || (Array.isArray(value) && !value.length) || name === "schema_version") return [];
    if (value === true) return [plain(name)];
    if (value === false) return [`${kThings.includes(name) ? "no" : "not"} ${plain(name)}`];
    const unit = kUnits.find(([ends]) => ends.test(name) && areNumbers(value));
    return [`${plain(unit ? name.replace(unit[0], "") : name)} ${valueOf(value, unit)}`];
  });
}

function parsed(text) {
  try { return JSON.parse(text); } catch (fault) { return undefined; }
}

// A sentence that the cell kept as JSON, its quotes and marks with it, or what such an object says.
function saidBy(json) {
  if (typeof json === "string") return json;
  if (json === null || typeof json !== "object") return String(json);
  const {message} = json.error || json;
  return typeof message === "string" ? message : (Array.isArray(json) ? valueOf(json) : partsOf(json).join(", "));
}

const kRequest = /^(GET|POST|PUT|PATCH|DELETE) (?:\/api\/v1)?(\/[^\s?]*)(?:\?(\S*))?(?: (\{.*\}))?(?: \((\d+) bytes\))?(.*)$/s;
const kVerbs = {GET: "asked for", POST: "", PUT: "", PATCH: "", DELETE: "remove"};

// A number stays a number, so that its unit is told.
const typed = (text) => (/^-?\d+(\.\d+)?$/.test(text) ? Number(text) : text);

export function told(what, detail) {
  if (what === "cell.frame") {
    const found = detail.match(/^([\d.]+)(?:; confirmed: (.*))?$/s);
    if (found) return [Number(found[1]) > 0 ? `at ${round(100 * Number(found[1]))} % power` : "dark", found[2] && `confirmed: ${found[2]}`].filter(Boolean).join("; ");
  }
  const json = /^\s*[[{"]/.test(detail) ? parsed(detail) : undefined;
  if (json !== undefined) return saidBy(json);
  const request = detail.match(kRequest);
  if (!request) return detail;
  const [, verb, path, query, body, bytes, rest] = request;
  const given = body ? parsed(body) : {};
  if (given === undefined) return detail;
  const asked = Object.fromEntries([...new URLSearchParams(query || "")].map(([name, value]) => [name, typed(value)]));
  const facts = [...partsOf(asked), ...partsOf(given), bytes && `${bytes} bytes`].filter(Boolean).join(", ");
  return [kVerbs[verb], `${decoded(path)}${facts ? `: ${facts}` : ""}`].filter(Boolean).join(" ") + rest;
}
function decoded(path) {
  try { return decodeURIComponent(path); } catch (fault) { return path; }
}
