// The hands of a simulated cell: what a person would lay down or take away, the page does by a button. A cell with real
// devices has none, and shows none.
import {t} from "./words.js";
import {command} from "./commands.js";
import {mayDo, model} from "./model.js";
import {Refused} from "./work.js";

export const hasHands = () => Boolean(model.cell && model.cell.hands) && mayDo("operator");

export async function lay(sheet, on, more = {}) {
  if (!await command("/sim/lay", {body: {sheet, on, ...more}, timeoutMs: 60000})) throw new Refused("");
}
export async function lift(from) {
  if (!await command("/sim/lift", {body: {from}})) throw new Refused("");
}
export async function lid(open) {
  if (!await command("/sim/lid", {body: {open}})) throw new Refused("");
}

// As a step of work.js.
export const layStep = (sheet, on, more = {}) => ({text: t(`hands.lay.${sheet in kSheets ? sheet : "other"}.${on}`, {sheet}), act: () => lay(sheet, on, more)});
const kSheets = {grid: 1, board: 1, panel: 1};
