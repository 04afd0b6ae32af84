// What needs somebody: new, acknowledged, or gone again before anybody saw it; and what is over.
import {h} from "../dom.js";
import {asSentence, dayTime, t} from "../words.js";
import {changed, operates} from "../model.js";
import {command} from "../commands.js";
import {button, empty, cellSays} from "../parts.js";
import {allAlarms, loadAlarms, setSound, soundOn} from "../alarms.js";

const kStates = ["new", "acknowledged", "returned", "over"];
const kMarks = {new: "▲", acknowledged: "△", returned: "◇", over: "✓"};
let search = "", shown = "";  // a state; "" = all

export const enter = () => loadAlarms();

const acknowledge = async (path, body = null) => { await command(path, {body}); loadAlarms(); };

export function draw() {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const all = allAlarms().slice().sort((a, b) => kStates.indexOf(a.state) - kStates.indexOf(b.state) || b.id - a.id);
  const of = all.filter((one) => (!shown || one.state === shown) && words.every((word) => `${one.sentence} ${one.about} ${one.acknowledged_by || ""} ${one.since}`.toLowerCase().includes(word)));
  const open = all.filter((one) => one.state === "new" || one.state === "returned");
  // All are seen only when all are shown, and what comes meanwhile is not.
  const allShown = open.every((one) => of.includes(one));
  const acknowledgeAll = () => acknowledge("/alarms/acknowledge-all", {up_to: Math.max(...open.map((one) => one.id))});
  return [
    h("div.tools", {},
      h("label", {}, t("log.search"), h("input", {type: "search", value: search, oninput: (event) => { search = event.target.value; changed(); }})),
      h("label", {}, t("alarm.which"), h("select", {value: shown, onchange: (event) => { shown = event.target.value; changed(); }},
        h("option", {value: ""}, t("alarm.all")), ...kStates.map((state) => h("option", {value: state}, t(`alarm.${state}`))))),
      button(t(soundOn() ? "alarm.sound_on" : "alarm.sound_off"), () => setSound(!soundOn()), {"aria-pressed": String(soundOn()), id: "sound"}),
      open.length > 1 && allShown && button(t("alarm.acknowledge_all", {n: open.length}), acknowledgeAll, {disabled: !operates(), id: "acknowledge-all"})),
    !of.length && empty(t(all.length ? "alarm.none_found" : "alarm.none")),
    of.length > 0 && h("section.card", {"aria-label": t("screen.alarms")}, h("ul.list.alarms", {}, ...of.map(row)))];
}

const row = (one) => h("li", {"data-key": one.id, class: one.state === "new" ? (one.urgent ? "bad urgent" : "bad") : ""},
  h("span.mark", {"aria-hidden": "true"}, kMarks[one.state]),
  h("div", {}, h("b", {}, cellSays(asSentence(one.sentence))),
    h("div.dim", {}, [t(`alarm.${one.state}`), t("alarm.since", {at: dayTime(one.since)}), one.until && t("alarm.until", {at: dayTime(one.until)}),
      one.acknowledged_by && t("alarm.seen_by", {who: one.acknowledged_by, at: dayTime(one.acknowledged_at)})].filter(Boolean).join(", "))),
  (one.state === "new" || one.state === "returned") && button(t("alarm.acknowledge"), () => acknowledge(`/alarms/${one.id}/acknowledge`), {disabled: !operates(), "data-alarm": one.id}));
