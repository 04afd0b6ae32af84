// What stands on every screen: the cell's state, how old all of it is, what to do next, the way to the screens.
import {h, put} from "./dom.js";
import {ago, asSentence, kLanguages, language, span, t} from "./words.js";
import {beginAnew, recall, remember} from "./link.js";
import {isStale, model} from "./model.js";
import {chosenInstead, clearing, kSteps, mayClear} from "./commands.js";
import {button, cellSays, link} from "./parts.js";
import {loadPictures} from "./pictures.js";
import {inOwnWords} from "./said.js";
import {countOf} from "./alarms.js";
import {oneSuspect} from "./screens/pieces.js";

const $ = (id) => document.getElementById(id);

// Marks and classes besides the words: shape as well as colour.
const kLooks = {
  Execute: ["▶", ""], Idle: ["●", ""], Complete: ["✓", "attention"], Stopped: ["■", ""],
  Held: ["❚❚", "attention"], Suspended: ["◆", "attention"], Aborted: ["✖", "alarm"], Aborting: ["✖", "alarm"],
};

// For states that come without a reason of their own.
function reasonOf(cell) {
  const name = cell.job ? cell.job.name : t("the_job");
  const found = cell.load && cell.load.found;
  return t(`reason.${cell.state}${cell.state === "Suspended" ? (found ? ".found" : ".waits") : ""}`, {name}).replace(/^reason\..*/, "");
}

// How many alarms nobody has seen stands on every screen.
function tabWords(id) {
  const unseen = id === "alarms" ? countOf("new") + countOf("returned") : 0;
  return unseen ? `${countOf("new") ? "▲ " : ""}${t(`screen.${id}`)} (${unseen})` : t(`screen.${id}`);
}

export function showFrame(screens, current) {
  const {cell} = model;
  put($("nav"), ...screens.map(({id}) => link(`${location.pathname}#${id}`, tabWords(id), {"aria-current": id === current ? "page" : null, class: id === "alarms" && countOf("new") ? "new" : ""})));
  $("theme").hidden = $("language").hidden = false;
  const screen = model.role === "nobody" ? t("account.sign_in") : t(`screen.${current}`);
  if ($("screen-name").textContent !== screen) $("screen-name").textContent = screen;
  const you = [t(`you.${model.role || "viewer"}`), model.session.user].filter(Boolean).join(" · ");
  if ($("role").textContent !== you) $("role").textContent = you;
  if (model.role === "nobody") {
    $("state-word").textContent = t("account.sign_in");
    $("state-reason").textContent = t("account.first");
    $("state-reason").lang = language;
    document.title = screen;
    $("next").hidden = true;
  }
  if (!cell) return;
  const [mark, look] = kLooks[cell.state] || ["…", ""];
  $("state").className = `state ${look}`;
  const said = [["state-mark", mark], ["state-word", cell.state]];
  $("state-reason").lang = language;
  put($("state-reason"), cell.reason ? cellSays(asSentence(cell.reason)) : reasonOf(cell));
  for (const [id, text] of said) if ($(id).textContent !== text) $(id).textContent = text;
  document.title = `${cell.state} – ${screen}`;
  showNext(cell.next_step);
}

// The cell's sentence names what is meant; where this page cannot say it in its own language, it says before it what is to be done.
const saidNext = (next) =>
  language === "en" || inOwnWords(next.sentence) ? [cellSays(next.sentence)] : [t(`step.${next.step}`), " ", h("small", {lang: "en"}, cellSays(next.sentence))];
// Of the job that was chosen on this page, as its Start is.
const ownNext = (next, job) => t(`next.${next.step}_chosen`, {n: job.id, name: job.name});

function showNext(next) {
  $("next").hidden = !next;
  if (!next) return;
  const screen = kSteps[next.step] || "", job = chosenInstead();
  const here = location.hash.slice(1).split("/")[0] || document.querySelector("#nav [aria-current]").hash.slice(1);
  put($("next"),
    h("span.next-mark", {"aria-hidden": "true"}, next.step === "wait" ? "…" : "▶"),
    h("p", {}, h("b", {}, t("next")), " ", ...(job ? [ownNext(next, job)] : saidNext(next)),
      !screen && next.command && h("small", {}, t("next.command", {command: next.command}))),
    // After an abort: one decision at a time, wherever one is.
    next.step === "settle" && oneSuspect(),
    next.step === "clear" && button(t("do.clear"), clearing(), {disabled: !mayClear()}),
    screen && here !== screen && link(`#${screen}`, t("next.go", {screen: t(`screen.${screen}`)}), {class: "go"}));
  loadPictures($("next"), true);
}

// Every half second: nobody operates on what may be no longer true. STOP is not among what is shut off then.
export function showAge() {
  const age = performance.now() - model.cellAt;
  const out = model.role === "nobody";
  const dead = isStale() && !out;
  document.body.classList.toggle("not-live", dead);
  $("main").inert = dead && Boolean(model.cell);
  $("live").classList.toggle("off", dead);
  const words = out ? "" : !model.cell ? t("connecting") : dead ? `▲ ${t("not_live")}` : t("live", {age: ago(age)});
  if ($("live").textContent !== words) $("live").textContent = words;
  $("dead").hidden = !dead || performance.now() < 6000;
  if (dead) $("dead").textContent = model.cell ? t("dead.since", {span: span(age / 1000)}) : t("dead.never");
}

// ---- past all that stands on every screen ---------------------------------------------------------------------------

$("skip").textContent = t("skip");
$("skip").addEventListener("click", (event) => {
  event.preventDefault();  // what stands behind the # is a screen's name
  $("main").focus();
});

// ---- light and dark -------------------------------------------------------------------------------------------------

const kThemes = ["auto", "light", "dark"];
const theme = () => recall("veneer_theme") || "auto";
function showTheme() {
  if (theme() === "auto") delete document.documentElement.dataset.theme; else document.documentElement.dataset.theme = theme();
  const [sign, ...words] = t(`theme.${theme()}`).split(" ");
  put($("theme"), sign, h("span.words", {}, ` ${words.join(" ")}`));
}
$("theme").addEventListener("click", () => {
  remember("veneer_theme", kThemes[(kThemes.indexOf(theme()) + 1) % kThemes.length]);
  showTheme();
});
showTheme();

// ---- language: each word of the page is another then, so it is loaded anew ------------------------------------------

const other = Object.keys(kLanguages).find((one) => one !== language);
$("language").textContent = kLanguages[other].name;
$("language").lang = other;
$("language").addEventListener("click", () => {
  remember("veneer_language", other);
  beginAnew();
});
