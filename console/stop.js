// STOP, a plain POST that waits for nothing. It needs no other part of the page but this file and link.js; without them
// the form is sent as it is, and a page answers.
import {ask, pause, stopAsking} from "./link.js";

// Its own words, so that a catalogue that did not come keeps nobody from hearing of it.
const german = (localStorage.getItem("veneer_language") || navigator.language).startsWith("de");
const kSaid = german ? {
  button: "Strahl sofort aus",
  pressed: (at) => `STOP um ${at} gedrückt, noch nicht bestätigt.`,
  confirmed: (at) => `STOP um ${at} bestätigt: Strahl aus, die Zelle bricht ab.`,
  not: (why) => `STOP ist NICHT bestätigt (${why}). Drücken Sie den Not-Halt an der Maschine.`,
} : {
  button: "beam off at once",
  pressed: (at) => `STOP pressed at ${at}, not confirmed yet.`,
  confirmed: (at) => `STOP confirmed at ${at}: beam off, the cell is aborting.`,
  not: (why) => `STOP is NOT confirmed (${why}). Use the emergency stop on the machine.`,
};

document.querySelector("#stop small").textContent = kSaid.button;
const note = document.getElementById("stop-note");
let told = "";  // "" none, "told" what became of the last STOP, "aborting" and the status says so too

function say(text, bad) {
  told = bad ? "" : "told";
  note.textContent = text;
  note.classList.toggle("dead", bad);
  note.hidden = false;
}

const clockTime = () => new Date().toLocaleTimeString("en-GB");

async function stop(event) {
  event.preventDefault();
  say(kSaid.pressed(clockTime()), true);
  for (let tries = 0; tries < 20; ++tries) {
    stopAsking();
    try {
      await ask("POST", "/api/v1/stop", {timeoutMs: 1000});
      say(kSaid.confirmed(clockTime()), false);
      return;
    } catch (fault) {
      say(kSaid.not(fault.message), true);
      await pause(200);
    }
  }
}

// What a STOP has done is told until the cell is cleared.
export function followStop(state) {
  if (state.startsWith("Abort")) { if (told) told = "aborting"; return; }
  if (told !== "aborting") return;
  told = "";
  note.hidden = true;
}

document.getElementById("stop").addEventListener("submit", stop);
