// What a panel's wood was seen as, version by version, and taking one back; and taking the panel out of stock, or putting
// it back.
import {h} from "../dom.js";
import {dayTime, squareCm, t} from "../words.js";
import {askAll, kAgainMs} from "../link.js";
import {changed, loadPanels, mayChange} from "../model.js";
import {command} from "../commands.js";
import {button} from "../parts.js";

const code = encodeURIComponent;
let versions = [], of = "", reason = "";

function load(id, version) {
  const key = `${id} ${version}`;
  if (of === key) return;
  if (!of.startsWith(`${id} `)) versions = [], reason = "";  // what was said of another panel is no reason here
  of = key;
  askAll(`/panels/${code(id)}/masks`, "versions").then((all) => { if (of === key) { versions = all; changed(); } },
    () => setTimeout(() => { if (of === key) { of = ""; changed(); } }, kAgainMs));
}

async function revert(panel, version) {
  if (!confirm(t("versions.sure", {n: version}))) return;
  await command(`/panels/${code(panel.id)}/revert`, {body: {version}});
  loadPanels();
}

const about = (one) => [dayTime(one.made), one.usable_mm2 === null ? "" : t("versions.usable", {area: squareCm(one.usable_mm2)}),
  one.painted ? t("versions.painted") : "", one.same_as ? t("versions.same", {n: one.same_as}) : ""].filter(Boolean).join(", ");

// The newest counts, and stands first.
export function versionsCard(panel) {
  load(panel.id, panel.mask_version);
  return h("details.card", {"data-key": "versions"}, h("summary", {}, `${t("versions")} (${versions.length})`), h("p.dim", {}, t("versions.about")),
    h("ul.list", {}, ...versions.map((one, at) => h("li", {"data-key": one.version, "data-version": one.version},
      h("div", {}, h("b", {}, t(at ? "versions.one" : "versions.now", {n: one.version})), h("div.dim", {}, about(one))),
      at > 0 && button(t("versions.revert"), () => revert(panel, one.version), {disabled: !mayChange() || Boolean(panel.retired)})))));
}

async function move(panel) {
  const more = {body: reason.trim() ? {reason: reason.trim()} : {}};
  const done = await (panel.retired ? command(`/panels/${code(panel.id)}/restore`, more) : command(`/panels/${code(panel.id)}/retire`, more));
  if (done) reason = "";
  loadPanels();
}

// A panel that was sawn apart lives on in its parts.
export function stockCard(panel) {
  if (panel.retired && panel.retired.sawn) return null;
  const out = Boolean(panel.retired);
  return h("details.card", {"data-key": `retire-${panel.id}`, open: out}, h("summary", {}, t(out ? "retire.back" : "retire")), h("p.dim", {}, t(out ? "retire.back_about" : "retire.about")),
    h("div.form", {}, h("label", {}, t(out ? "retire.back_why" : "retire.why"), h("input", {type: "text", id: "retire-why", maxlength: 500, value: reason, oninput: (event) => { reason = event.target.value; changed(); }}))),
    h("div.commands", {}, button(t(out ? "retire.back_do" : "retire.do", {panel: panel.id}), () => move(panel), {id: "do-retire", wide: true, disabled: !mayChange() || (!out && !reason.trim())})));
}
