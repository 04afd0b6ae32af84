// STOP, a plain POST that waits for nothing. It needs no other part of the page but this file and link.js; without them
// the form is sent as it is, and a page answers.
//
// It is sent again until the cell confirms it: quickly at first, then once a second. It ends unconfirmed only when
// somebody who was told so says that it is seen to, or once the cell has aborted since and was cleared by a person.
import {ask, pause, stopAsking} from "./link.js";

// Its own words, so that a catalogue that did not come keeps nobody from hearing of it.
const german = (localStorage.getItem("veneer_language") || navigator.language).startsWith("de");
const kSaid = german ? {
  button: "Strahl sofort aus",
  pressed: (at) => `STOP um ${at} gedrückt, noch nicht bestätigt.`,
  confirmed: (at) => `STOP um ${at} bestätigt: Strahl aus, die Zelle bricht ab.`,
  not: (why) => `STOP ist NICHT bestätigt (${why}). Drücken Sie den Not-Halt an der Maschine. STOP wird weiter gesendet.`,
  seenTo: "Ich habe mich darum gekümmert: STOP nicht mehr senden",
} : {
  button: "beam off at once",
  pressed: (at) => `STOP pressed at ${at}, not confirmed yet.`,
  confirmed: (at) => `STOP confirmed at ${at}: beam off, the cell is aborting.`,
  not: (why) => `STOP is NOT confirmed (${why}). Use the emergency stop on the machine. STOP goes on being sent.`,
  seenTo: "I have seen to it: send STOP no more",
};

document.querySelector("#stop small").textContent = kSaid.button;
const kQuickTries = 20, kQuickMs = 200, kSlowMs = 1000;
const kToldMs = 3000;  // nobody can say that it is seen to before it could be read

const note = document.getElementById("stop-note");
const words = note.appendChild(document.createElement("span"));
const seenTo = note.appendChild(document.createElement("button"));
seenTo.type = "button";
seenTo.textContent = kSaid.seenTo;
seenTo.hidden = true;
seenTo.addEventListener("click", end);

let press = 0;          // the last one; what an earlier one does is over
let told = false;       // something is said of a STOP
let confirmed = false;  // and the cell has confirmed it
let state = "";         // of the cell, as it was told last
let aborted = false;    // the cell has said so since STOP was pressed, not only before

function say(text, bad) {
  told = true;
  if (words.textContent !== text) words.textContent = text;
  note.classList.toggle("dead", bad);
  note.hidden = false;
}

function end() {
  ++press;
  told = confirmed = aborted = false;
  note.hidden = seenTo.hidden = true;
}

const clockTime = () => new Date().toLocaleTimeString("en-GB");

async function stop(event) {
  event.preventDefault();
  end();
  const mine = press, since = performance.now();
  say(kSaid.pressed(clockTime()), true);
  for (let tries = 1; mine === press; ++tries) {
    stopAsking();
    try {
      await ask("POST", "/api/v1/stop", {timeoutMs: 1000});
      if (mine !== press) return;
      seenTo.hidden = confirmed = true;
      aborted = state.startsWith("Abort");
      return say(kSaid.confirmed(clockTime()), false);
    } catch (fault) {
      if (mine !== press) return;
      say(kSaid.not(fault.message), true);
      seenTo.hidden = performance.now() - since < kToldMs;
      await pause(tries < kQuickTries ? kQuickMs : kSlowMs);
    }
  }
}

// What a STOP has done is told until the cell is cleared.
export function followStop(now) {
  const before = state;
  state = now;
  if (!told) return;
  if (now.startsWith("Abort")) aborted = aborted || confirmed || !before.startsWith("Abort");
  else if (aborted) end();
}

document.getElementById("stop").addEventListener("submit", stop);
