// The picture of a job in its pieces, for whoever lays them: seen from the back, as they are laid, or from the show side.
import {h, svg} from "../dom.js";
import {t} from "../words.js";
import {changed, jobOf, model, piecesOf} from "../model.js";
import {card, empty} from "../parts.js";
import {picture} from "../pictures.js";
import {boxOf} from "./job_map.js";

let back = true;

export function draw(jobWanted, markWanted) {
  const jobs = model.jobs.filter((job) => job.state !== "cancelled");
  const job = jobOf(Number(jobWanted)) || jobs[jobs.length - 1];
  if (!job) return empty(t("assembly.none"));
  const pieces = piecesOf(job.id);
  const box = boxOf(pieces);
  const mark = pieces.some((piece) => piece.mark === markWanted) ? markWanted : "";
  return [
    h("div.tools", {},
      h("label", {}, t("assembly.choose"), h("select", {value: String(job.id), onchange: (event) => { location.hash = `#assembly/${event.target.value}`; }},
        ...jobs.slice().reverse().map((one) => h("option", {value: one.id}, `${one.id} ${one.name}`)))),
      h("label", {}, t("assembly.find"), h("select", {value: mark, onchange: (event) => { location.hash = `#assembly/${job.id}/${encodeURIComponent(event.target.value)}`; }},
        h("option", {value: ""}, "–"), ...pieces.map((piece) => h("option", {value: piece.mark}, piece.mark)))),
      h("span.choices", {}, ...[true, false].map((one) => h("button", {type: "button", "aria-pressed": String(back === one), onclick: () => { back = one; changed(); }}, t(one ? "assembly.back" : "assembly.show"))))),
    card(job.name, h("p.dim", {}, t("assembly.about")),
      h("div.view.assembly", {class: back ? "mirrored" : ""}, picture(`/jobs/${job.id}/preview.png?width=1200`, t("assembly.alt", {n: job.id}), {version: job.newest_plan}), box && marks(pieces, box, mark))),
  ];
}

// Outlines and marks over the picture; from the back left and right change places, and marks stay readable.
function marks(pieces, box, chosen) {
  const width = box.right - box.left;
  const x = (value) => (back ? box.right - value : value - box.left);
  return svg("svg", {viewBox: `0 0 ${width} ${box.high - box.low}`, "aria-hidden": "true"}, ...pieces.map((piece) => {
    const ring = piece.artwork_outline_mm;
    const centre = ring.reduce(([u, v], [p, q]) => [u + p / ring.length, v + q / ring.length], [0, 0]);
    const side = Math.min(...[0, 1].map((axis) => Math.max(...ring.map((p) => p[axis])) - Math.min(...ring.map((p) => p[axis]))));
    return svg("g", {class: piece.mark === chosen ? "chosen" : ""},
      svg("path", {class: "border", d: `M${ring.map(([u, v]) => `${x(u).toFixed(2)} ${(box.high - v).toFixed(2)}`).join("L")}Z`}),
      svg("text", {x: x(centre[0]).toFixed(2), y: (box.high - centre[1]).toFixed(2), "font-size": (side * .24).toFixed(2)}, piece.mark));
  }));
}
