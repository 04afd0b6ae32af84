// What the laser burns on its own: run dark, burnt once all is seen to, and what goes on of it, whoever began it.
import {h} from "./dom.js";
import {t} from "./words.js";
import {isStale, mayChange, mayDo, model, operates} from "./model.js";
import {command, isSure} from "./commands.js";
import {button, taskRow} from "./parts.js";
import {doSteps, isBusy, workAt, workRow} from "./work.js";

const kStrokes = ["Execute", "Holding", "Held", "Unholding"];  // a task that is given up ends none of them
export const kCard = "test card", kPattern = "laser test-pattern", kDrawing = "laser run";  // tasks, by their names in the API
const kBurns = [kCard, kPattern, kDrawing];
export const findsHome = () => (model.cell.laser || {}).finds_home !== false;
// At once when somebody tells where the head stands: lines lie elsewhere after it.
const cornerFollowers = [];
export const followCorner = (told) => cornerFollowers.push(told);
export const cornerMoves = () => cornerFollowers.forEach((told) => told());
// One of them goes on, whoever began it, and wherever.
const burning = (...kinds) => (model.cell.tasks || []).find((one) => kinds.includes(one.kind) && one.state === "running");
const isMine = () => ["pattern", "card", "drawing"].some(isBusy);
export const isFree = () => !isMine() && !burning(...kBurns);
const runs = () => !isFree() && kStrokes.includes(model.cell.state);

// Above the cards, since it shuts them all.
export function burnsNow() {
  const now = burning(...kBurns);
  return (now || runs()) && h("div.card", {"data-key": "burns"},
    runs() && h("p.warn", {id: "burns-runs", role: "status"}, `▲ ${t("burns.runs")}`), now && h("ul.list", {}, taskRow(now)));
}

// `asked`: what is asked where nothing is by name. `asShown()`: it is still what is asked about. `mayBurn()`: with the beam on too.
export function burns(place, kind, ticks, asked, asShown, begin, {needs = "maintainer", mayBurn = asShown} = {}) {
  const task = isBusy(place) ? workAt(place).task : (burning(kind) || {}).id, free = mayDo(needs) && mayChange() && isFree();
  const go = (text, body) => { if (body.dry ? asShown() : mayBurn()) doSteps(place, [{text, act: () => begin(body)}]); };
  const burn = async () => {
    const confirmed = ticks.take();
    if (confirmed.length || await isSure(t(asked), () => ticks.ready() && isFree() && mayBurn())) go(t(`${place}.burn`), {dry: false, confirmed});
  };
  const more = {needs, small: t(findsHome() ? "burns.home" : "burns.move")};
  return {
    buttons: [
      button(t(`${place}.dry`), () => go(t(`${place}.dry`), {dry: true}), {...more, disabled: !free || !asShown(), wide: true, id: `${place}-dry`}),
      button(t(`${place}.burn`), burn, {...more, disabled: !free || !mayBurn() || !ticks.ready(), wide: true, id: `${place}-burn`}),
      task > 0 && !runs() && button(t("task.cancel"), () => command(`/tasks/${task}`, {method: "DELETE"}), {disabled: !operates() || isStale(), id: `${place}-cancel`})],
    row: !burning(kind) && workRow(place),
  };
}
