// Which scanners answer: they are asked once at a time, whichever screen wants to know.
import {t} from "./words.js";
import {doSteps, isBusy, run, workAt, workRow} from "./work.js";

const kPlace = "scanners";
export const findScanners = () => doSteps(kPlace, [{text: t("choose.scanners"), act: () => run(kPlace, "/scanners", {})}]);
export const areSought = () => isBusy(kPlace);
// Of the last search, each {name, make, problem}; null before it has ended.
export const scannersFound = () => (workAt(kPlace).result || {}).scanners || null;
export const scannersRow = () => workRow(kPlace);
