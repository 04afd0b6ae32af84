// What the bed camera sees at this moment, for whoever lays something down.
import {h} from "../dom.js";
import {asSentence, t} from "../words.js";
import {changed, mayChange, model} from "../model.js";
import {button} from "../parts.js";
import {bedView} from "../watch.js";
import {doSteps, isBusy, run, workRow} from "../work.js";

const kRest = ["Stopped", "Idle", "Complete", "Aborted"];
let sight = null;  // the last BedSight

export const lookStep = () => ({text: t("bed.looking"), act: async () => { sight = await run("bed", "/bed/look", {}); changed(); return sight; }});
export const look = () => doSteps("bed", [lookStep()]);

export const lookButton = () => button(t("bed.look"), look, {id: "look", disabled: !mayChange() || isBusy("bed") || !kRest.includes(model.cell.state)});

export function sightWords() {
  if (!sight) return "";
  if (sight.grid_tags > 0) return t("bed.grid", {n: sight.grid_tags, of: sight.grid_has});
  if (sight.panels.length) return t("bed.panels", {panels: sight.panels.join(", ")});
  return sight.tags.length ? t("bed.strange", {n: sight.tags.length}) : t("bed.no_tags");
}

export const bedPicture = () => [
  workRow("bed"),
  ...bedView(t("bed.none_yet")),
  sightWords() && h("p.dim", {}, asSentence(sightWords()))];
