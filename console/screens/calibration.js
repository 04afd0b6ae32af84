// What the cell knows of its devices, how well, until when, and how that has moved over the certificates before.
import {h, svg} from "../dom.js";
import {dayTime, t} from "../words.js";
import {askAll, kAgainMs} from "../link.js";
import {changed, model} from "../model.js";
import {card, empty, fact, facts, link, viewerHint} from "../parts.js";
import {certificateFacts} from "./setup_calibrate.js";

const kKinds = ["scanner", "camera", "axes", "kerf"];
const kStep = {scanner: "scanner", camera: "camera", axes: "laser", kerf: "kerf"};
const kFigure = {kerf: "kerf_mm"};  // what is drawn of a kind; else its rms
const kMost = 200;

let certificates = null, asked = "";

export const enter = () => { asked = ""; };

function follow() {
  const now = JSON.stringify((model.cell || {}).calibration);
  if (now === asked) return;
  asked = now;
  askAll("/certificates", "certificates", kMost).then((list) => { certificates = list; changed(); }, () => setTimeout(() => { if (asked === now) { asked = ""; changed(); } }, kAgainMs));
}

export function draw() {
  if (!model.cell) return empty(t("connecting"));
  follow();
  if (!certificates) return empty(t("connecting"));
  return [viewerHint(), h("p.dim.intro", {}, t("calib.about")), h("div.columns.two-even", {}, ...kKinds.map(kindCard))];
}

function kindCard(kind) {
  const state = model.cell.calibration[kind];
  const of = certificates.filter((one) => one.kind === kind);
  const good = state === "valid";
  return h("section.card", {"aria-label": t(kind), "data-key": kind},
    h("h2.title", {}, t(kind)),
    facts(fact(t("calib.state"), t(`certificate.${state}`), !good && state !== "missing")),
    of.length > 0 && certificateFacts(of[0]),
    drift(kind, of),
    h("div.commands", {}, link(`#setup/${kStep[kind]}`, t(state === "missing" ? "calib.begin" : "calib.anew"), {class: "go wide"})));
}

// The newest on the right; one point says nothing of drift.
function drift(kind, of) {
  const name = kFigure[kind] || "rms_mm";
  const points = of.slice(0, 24).reverse().filter((one) => typeof one[name] === "number");
  if (points.length < 2) return h("p.dim", {}, t("calib.no_drift"));
  const values = points.map((one) => one[name]);
  const top = Math.max(...values) * 1.15 || 1;
  const at = (n) => [10 + n * 280 / (points.length - 1), 78 - 66 * values[n] / top];
  const label = t("calib.drift", {what: t(kind === "kerf" ? "calib.kerf" : "calib.rms"), first: values[0].toFixed(3), last: values[values.length - 1].toFixed(3), n: points.length});
  return h("figure.drift", {},
    svg("svg", {viewBox: "0 0 300 84", role: "img", "aria-label": label},
      svg("path", {class: "axis", d: "M10 78H290"}),
      svg("path", {class: "line", d: `M${values.map((_, n) => at(n).map((v) => v.toFixed(1)).join(" ")).join("L")}`}),
      ...values.map((value, n) => svg("circle", {cx: at(n)[0].toFixed(1), cy: at(n)[1].toFixed(1), r: n === values.length - 1 ? 4.5 : 3}, svg("title", {}, `${dayTime(points[n].issued)}: ${value.toFixed(3)} mm`)))),
    h("figcaption.dim", {}, label));
}
