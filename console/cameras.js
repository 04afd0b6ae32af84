// Which cameras of this computer answer, and the picture that one of them was tried with last. Each once at a time.
import {t} from "./words.js";
import {doSteps, forgetWork, isBusy, run, workAt, workRow} from "./work.js";

const kPlace = "cameras", kTrial = "trial";
export const findCameras = () => { forgetWork(kTrial); return doSteps(kPlace, [{text: t("choose.cameras"), act: () => run(kPlace, "/cameras", {})}]); };
export const areCamerasSought = () => isBusy(kPlace);
// Of the last search, each {device, node, name, named_by, problem, formats, controls}; null before it has ended.
export const camerasFound = () => (workAt(kPlace).result || {}).cameras || null;
export const camerasRow = () => workRow(kPlace);

export const tryCamera = (body) => doSteps(kTrial, [{text: t("choose.trying"), act: () => run(kTrial, "/cameras/trial", body)}]);
export const isTrying = () => isBusy(kTrial);
// {trial, device, width, height, format, settings, doubts}; null when none has ended well.
export const lastTrial = () => (!isTrying() && workAt(kTrial).result) || null;
export const trialRow = () => workRow(kTrial);
