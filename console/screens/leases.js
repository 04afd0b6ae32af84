// Wood that is kept for plans: for which, until when, and how it is given back.
import {h} from "../dom.js";
import {dayTime, t} from "../words.js";
import {loadPlans, mayChange, model} from "../model.js";
import {command} from "../commands.js";
import {button, card} from "../parts.js";

const leases = () => model.plans.filter((plan) => plan.lease).sort((a, b) => a.lease.until.localeCompare(b.lease.until));

export function leasesCard() {
  const all = leases();
  if (!all.length) return null;
  return card(t("leases"), h("p.dim", {}, t("leases.about")), h("ul.list", {}, ...all.map((plan) => h("li", {"data-key": plan.id},
    h("div", {}, h("b", {}, plan.name), h("div", {}, `${t("pieces", {n: plan.placed})}, ${plan.panels.map((one) => one.panel).join(", ")}`),
      h("div.dim", {}, t("leases.until", {until: dayTime(plan.lease.until), who: plan.lease.who}))),
    button(t("leases.back"), () => giveBack(plan.id), {disabled: !mayChange()})))));
}

export async function giveBack(plan) {
  await command(`/plans/${plan}/lease`, {method: "DELETE"});
  loadPlans();
}

// What a panel's card says of them.
export const leasesOn = (panel) => leases().filter((plan) => plan.panels.some((one) => one.panel === panel))
    .map((plan) => h("div.dim", {}, t("panel.lease", {n: plan.id, name: plan.name, until: dayTime(plan.lease.until)})));
