// Who did what, newest first.
import {h} from "../dom.js";
import {dayTime, t} from "../words.js";
import {get, kAgainMs} from "../link.js";
import {changed} from "../model.js";
import {button, empty} from "../parts.js";

let entries = [], next = null, fault = "", search = "";

async function load(cursor) {
  try {
    const page = await get(`/audit?limit=200${cursor ? `&cursor=${cursor}` : ""}`);
    entries = cursor ? [...entries, ...page.entries] : page.entries;
    next = page.next;
    fault = "";
  } catch (error) {
    fault = error.message;
    if (!cursor) setTimeout(() => { if (fault) load(null); }, kAgainMs);
  }
  changed();
}

export const enter = () => load(null);

export function draw() {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const shown = entries.filter((one) => words.every((word) => `${one.at} ${one.who} ${one.what} ${one.detail}`.toLowerCase().includes(word)));
  return [
    h("div.tools", {}, h("label", {}, t("log.search"), h("input", {type: "search", value: search, oninput: (event) => { search = event.target.value; changed(); }}))),
    fault && h("p.warn", {}, t("log.fault", {why: fault})),
    !entries.length && !fault && empty(t("log.none")),
    h("div.table", {}, h("table", {}, h("thead", {}, h("tr", {}, ...["at", "who", "what", "detail"].map((one) => h("th", {scope: "col"}, t(`log.${one}`))))),
      h("tbody", {}, ...shown.map((one) => h("tr", {"data-key": one.id}, h("td", {}, dayTime(one.at)), h("td", {}, one.who), h("td", {}, one.what), h("td", {}, one.detail)))))),
    next !== null && h("div.commands", {}, button(t("log.more"), () => load(next))),
  ];
}
