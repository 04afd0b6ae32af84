// A tag or hole of a panel in words: which it is, and how far it lies from where the others put it.
import {t} from "../words.js";

export const fiducialName = ({kind, tag_id}) => (kind === "tag" ? t("fiducial.tag", {n: tag_id}) : t("fiducial.hole"));
export const offWords = ({off_mm, over_limit}) => (typeof off_mm === "number" ? `${over_limit ? "▲ " : ""}${off_mm.toFixed(3)} mm` : t("fiducial.unknown"));
export function fiducialWords(fiducial) {
  const known = typeof fiducial.off_mm === "number";
  return [`${fiducial.over_limit ? "▲ " : ""}${fiducialName(fiducial)}, ${t(`face.${fiducial.face}`)}`,
    known ? t("fiducial.off", {mm: fiducial.off_mm.toFixed(3), n: fiducial.off_scan}) : t("fiducial.unknown")].join(": ");
}
