// What needs somebody, asked for whenever that changes, and a tone while something is new. The tone is of this browser:
// off until somebody puts it on here.
import {askAll, recall, remember} from "./link.js";
import {changed, followEvent, followStatus, loader, model} from "./model.js";

const kSound = "veneer_sound";
const kEveryMs = 4000;
let alarms = null, told = "", speaker = null, soundedAt = 0;

export const allAlarms = () => alarms || [];
export const countOf = (state) => ((model.cell && model.cell.alarms) || {})[state] || 0;
export const soundOn = () => recall(kSound) === "on";

// A browser lets a page sound only after a hand was on it.
export function setSound(on) {
  remember(kSound, on ? "on" : "off");
  if (on) beep();
  changed();
}

function beep() {
  soundedAt = performance.now();
  try {
    speaker = speaker || new AudioContext();
    speaker.resume();
    for (const [at, pitch] of [[0, 880], [.18, 660]]) {
      const tone = speaker.createOscillator(), loud = speaker.createGain();
      tone.frequency.value = pitch;
      loud.gain.value = .15;
      tone.connect(loud).connect(speaker.destination);
      tone.start(speaker.currentTime + at);
      tone.stop(speaker.currentTime + at + .14);
    }
  } catch (fault) { /* a browser without sound */ }
}

export const loadAlarms = loader(async () => { alarms = await askAll("/alarms", "alarms"); });

// Also where the counts stay: one is over, and another is new.
followEvent("alarms", loadAlarms);
followStatus(() => {
  const now = JSON.stringify((model.cell || {}).alarms || {});
  if (now !== told) { told = now; if (countOf("new") + countOf("acknowledged") + countOf("returned") > 0 || alarms) loadAlarms(); }
  if (soundOn() && countOf("new") > 0 && performance.now() - soundedAt > kEveryMs) beep();
});
