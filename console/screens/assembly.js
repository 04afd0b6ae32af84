// The picture of a job in its pieces, for whoever lays them: seen from the back, as they are laid, or from the show side.
// A piece is found by a finger, by keyboard or by its mark, and ticked off once it lies at its place.
import {h, svg} from "../dom.js";
import {dayTime, t} from "../words.js";
import {changed, databaseSound, jobOf, mayChange, model, piecesOf, renewPieces} from "../model.js";
import {command, sameThing} from "../commands.js";
import {bar, button, card, empty, fact, facts, link} from "../parts.js";
import {picture} from "../pictures.js";
import {brushKey} from "../brush_keys.js";
import {holds, nextTo} from "../outlines.js";
import {openFile} from "../work.js";
import {boxOf} from "./job_map.js";
import {cannotRedo, kGone, redo, redoneNote, verdicts, woodOf} from "./pieces.js";

const kZooms = [1, 2, 4];  // times as wide as its place on the screen
let back = true, zoom = 1;
let more = false;            // of the piece, on a phone: all that may be done with it, over the map
let followed = "";           // the piece that was last moved into sight
const wanted = new Map();    // what was said of a piece, by job and mark, while the lists do not tell yet

const keyOf = (job, piece) => `${job.id} ${piece.mark}`;
const isLaid = (job, piece) => wanted.get(keyOf(job, piece)) ?? Boolean(piece.assembled);

// How a piece is drawn, and what is said of it.
function lookOf(job, piece) {
  if (isLaid(job, piece)) return "laid";
  if (piece.state === "cut") return "cut";
  return kGone.includes(piece.state) ? "missing" : piece.state === "suspect" ? "suspect" : "open";
}

const said = (job, piece) => `${piece.mark}: ${t(`assembly.is_${lookOf(job, piece)}`)}`;

// The address names the piece, so that it can be come back to; nothing scrolls away from the finger.
function choose(job, mark) {
  history.replaceState(null, "", `#assembly/${job.id}${mark ? `/${encodeURIComponent(mark)}` : ""}`);
  changed();
}

async function tick(job, piece, laid) {
  const key = keyOf(job, piece);
  wanted.set(key, laid);
  changed();
  // What the lists say from then on counts, whoever said it last.
  if (await command(`/jobs/${job.id}/assembled`, {body: {pieces: [piece.mark], assembled: laid}})) await renewPieces(job.id);
  wanted.delete(key);
  changed();
}

export function draw(jobWanted, markWanted) {
  const jobs = model.jobs.filter((job) => job.state !== "cancelled");
  const job = jobOf(Number(jobWanted)) || jobs[jobs.length - 1];
  if (!job) return empty(t("assembly.none"));
  const pieces = piecesOf(job.id);
  const chosen = pieces.find((piece) => piece.mark === markWanted);
  return [
    h("div.tools", {},
      h("label", {}, t("assembly.choose"), h("select", {value: String(job.id), onchange: (event) => { location.hash = `#assembly/${event.target.value}`; }},
        ...jobs.slice().reverse().map((one) => h("option", {value: one.id}, `${one.id} ${one.name}`)))),
      h("label", {}, t("assembly.find"), h("select", {id: "find-piece", value: chosen ? chosen.mark : "", onchange: (event) => choose(job, event.target.value)},
        h("option", {value: ""}, "–"), ...pieces.map((piece) => h("option", {value: piece.mark}, piece.mark)))),
      h("span.grow"), button(t("assembly.print"), () => openFile(`/jobs/${job.id}/map?format=pdf&view=${back ? "back" : "show"}`), {id: "print-map"})),
    h("div.columns.two", {},
      h("div.column", {}, mapCard(job, pieces, chosen)),
      h("div.column", {}, pieceCard(job, pieces, chosen), progressCard(job, pieces)))];
}

// A piece that was chosen by keyboard or by name comes into sight: in its pane, and between what stays at the top and
// the sheet at the foot of a phone's screen.
export function drawn(place, job, mark) {
  const piece = place.querySelector(".assembly .ring");
  if (followed === `${job} ${mark} ${zoom} ${back}` || !piece) return;
  const pane = place.querySelector(".assembly-pane"), [of, is] = [pane, piece].map((one) => one.getBoundingClientRect());
  if (!is.height) return;  // the picture beneath is on its way
  followed = `${job} ${mark} ${zoom} ${back}`;
  if (is.left < of.left || is.right > of.right) pane.scrollLeft += is.left + is.width / 2 - of.left - of.width / 2;
  if (is.top < of.top || is.bottom > of.bottom) pane.scrollTop += is.top + is.height / 2 - of.top - of.height / 2;
  const sheet = place.querySelector(".assembly-piece");
  const high = document.querySelector("header").getBoundingClientRect().bottom;
  const low = getComputedStyle(sheet).position === "sticky" ? sheet.getBoundingClientRect().top : innerHeight;
  const now = piece.getBoundingClientRect();
  if (now.top < high || now.bottom > low) scrollBy(0, now.top + now.height / 2 - (high + low) / 2);
}

// ---- the map --------------------------------------------------------------------------------------------------------

function mapCard(job, pieces, chosen) {
  const box = boxOf(pieces);
  const side = (is) => h("button", {type: "button", "data-view": is ? "back" : "show", "aria-pressed": String(back === is), onclick: () => { back = is; changed(); }}, t(is ? "assembly.back" : "assembly.show"));
  return card(job.name, h("p.dim", {}, t("assembly.about")),
    h("div.choices.assembly-views", {role: "group", "aria-label": t("assembly.view")}, side(true), side(false),
      ...kZooms.map((one) => h("button", {type: "button", "aria-pressed": String(zoom === one), onclick: () => { zoom = one; changed(); }}, `${one} ×`))),
    h("div.assembly-pane", {}, h("div.view.assembly", {class: `${back ? "mirrored" : ""} x${zoom}`},
      picture(`/jobs/${job.id}/preview.png?width=1200`, t("assembly.alt", {n: job.id}), {version: job.newest_plan}), box && marks(job, pieces, box, chosen))),
    h("p.dim.keys", {id: "assembly-keys"}, t("assembly.keys")),
    h("p.key.dim", {}, ...["laid", "cut", "open", "suspect", "missing"].map((one) => [h(`i.key-piece-${one}`, {"aria-hidden": "true"}), t(`assembly.key_${one}`)])));
}

// Outlines and marks over the picture; from the back left and right change places, and marks stay readable.
function marks(job, pieces, box, chosen) {
  const wide = box.right - box.left, high = box.high - box.low;
  const x = (value) => (back ? box.right - value : value - box.left);
  const pieceAt = (event) => {
    const place = event.currentTarget.getBoundingClientRect();
    const [right, down] = [(event.clientX - place.left) / place.width * wide, (event.clientY - place.top) / place.height * high];
    return pieces.find((piece) => holds(piece.artwork_outline_mm, back ? box.right - right : box.left + right, box.high - down));
  };
  const keyed = (event) => {
    const key = event.key === "Enter" ? {across: 0, down: 0} : brushKey(event);
    const from = chosen || pieces[0];
    if (!key || !from) return;
    event.preventDefault();
    if (!key.across && !key.down) {  // as the button does: only what is chosen and was looked at, once a press
      if (chosen && !event.repeat && mayTick(job, from) && target.isLooked()) tick(job, from, !isLaid(job, from));
      return choose(job, from.mark);
    }
    const to = nextTo(pieces, from, back ? -key.across : key.across, key.down) || from;
    target.is(`${keyOf(job, to)} ${lookOf(job, to)}`);  // whoever goes there by keyboard knows where
    choose(job, to.mark);
  };
  return svg("svg", {viewBox: `0 0 ${wide} ${high}`, preserveAspectRatio: "none", "data-key": "assembly-map", role: "application", tabindex: 0, "aria-label": t("assembly.map"), "aria-describedby": "assembly-keys assembly-said",
    onclick: (event) => { const piece = pieceAt(event); if (piece) choose(job, piece.mark); },
    onkeydown: keyed},
    ...pieces.map((piece) => outline(job, piece, x, box)),
    ...(chosen ? ["ring", "ring.inner"] : []).map((look) => svg(`path.${look}`, {d: pathOf(chosen, x, box)})));
}

const pathOf = (piece, x, box) => `M${piece.artwork_outline_mm.map(([u, v]) => `${x(u).toFixed(2)} ${(box.high - v).toFixed(2)}`).join("L")}Z`;

function outline(job, piece, x, box) {
  const ring = piece.artwork_outline_mm, look = lookOf(job, piece);
  const centre = ring.reduce(([u, v], [p, q]) => [u + p / ring.length, v + q / ring.length], [0, 0]);
  const side = Math.min(...[0, 1].map((axis) => Math.max(...ring.map((p) => p[axis])) - Math.min(...ring.map((p) => p[axis]))));
  return svg("g", {class: `piece-${look}`},
    svg("path", {d: pathOf(piece, x, box)}),
    svg("text", {x: x(centre[0]).toFixed(2), y: (box.high - centre[1]).toFixed(2), "font-size": (side * .24).toFixed(2)}, look === "laid" ? `✓ ${piece.mark}` : piece.mark));
}

// ---- the piece ------------------------------------------------------------------------------------------------------

const target = sameThing();
const mayTick = (job, piece) => mayChange() && !wanted.has(keyOf(job, piece)) && (piece.state === "cut" || Boolean(piece.assembled));

// That still lies on the table, behind this one in the order of the plan.
function nextToLay(job, pieces, chosen) {
  const at = pieces.indexOf(chosen) + 1;
  return [...pieces.slice(at), ...pieces.slice(0, at)].find((piece) => piece !== chosen && lookOf(job, piece) === "cut");
}

function pieceCard(job, pieces, chosen) {
  const next = nextToLay(job, pieces, chosen);
  const goOn = button(next ? t("assembly.next", {mark: next.mark}) : t("assembly.no_next"), () => choose(job, next.mark), {id: "next-piece", wide: true, disabled: !next, next: Boolean(next) && (!chosen || lookOf(job, chosen) !== "cut")});
  if (!chosen)
    return h("section.card.assembly-piece", {"aria-label": t("assembly.piece"), "data-key": "piece"}, h("p", {id: "assembly-said", role: "status"}, t("assembly.tap")), h("div.commands", {}, goOn));
  const look = lookOf(job, chosen), laid = look === "laid";
  target.drawn(`${keyOf(job, chosen)} ${look}`);
  const may = mayTick(job, chosen) && target.isLooked();
  return h("section.card.assembly-piece", {"aria-label": t("assembly.piece"), "data-key": "piece", class: more ? "more" : ""},
    h("div.load", {}, chosen.panel ? woodOf(chosen) : null, h("div", {}, h("p.big", {id: "assembly-said", role: "status"}, said(job, chosen)),
      laid && chosen.assembled && h("p.dim.seldom", {}, t("assembly.laid_by", {who: chosen.assembled.who, at: dayTime(chosen.assembled.at)})),
      chosen.panel && h("p.dim.seldom", {}, link(`#panels/${chosen.panel}/${chosen.id}`, t("assembly.passport", {panel: chosen.panel})))),
      (laid || look === "cut") && button(t(more ? "assembly.less" : "assembly.more"), () => { more = !more; changed(); }, {id: "piece-more", "aria-expanded": String(more)})),
    h("div.commands", {},
      (laid || look === "cut") && button(t(laid ? "assembly.untick" : "assembly.tick", {mark: chosen.mark}), () => tick(job, chosen, !laid), {id: "tick-piece", wide: true, next: !laid && may, disabled: !may}),
      goOn,
      look === "missing" && button(t("missing.one"), () => redo(job.id, [chosen.mark]), {wide: true, id: "redo-piece", disabled: cannotRedo(job.id)}),
      (laid || look === "cut") && button(t("assembly.lost", {mark: chosen.mark}), () => { if (confirm(t("lost.sure", {mark: chosen.mark}))) redo(job.id, [chosen.mark], {lost: true}); },
        {wide: true, id: "redo-piece", "data-seldom": "", disabled: cannotRedo(job.id) || Boolean(job.now) || !databaseSound()})),
    look === "suspect" && verdicts({job, piece: chosen}),
    redoneNote());
}

function progressCard(job, pieces) {
  const count = (look) => pieces.filter((piece) => lookOf(job, piece) === look).length;
  const laid = count("laid");
  return card(t("assembly.progress"), bar(pieces.length ? laid / pieces.length : 0, {label: t("assembly.laid", {n: laid, of: pieces.length})}),
    h("p", {id: "laid-count"}, t("assembly.laid", {n: laid, of: pieces.length})),
    facts(...["cut", "open", "suspect", "missing"].filter((look) => count(look) > 0).map((look) => fact(t(`assembly.key_${look}`), t("pieces", {n: count(look)}), ["suspect", "missing"].includes(look)))),
    count("missing") > 1 && job.missing > 0 && button(t("missing.all"), () => redo(job.id, null), {disabled: cannotRedo(job.id)}));
}
