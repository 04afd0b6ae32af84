// STOP, a plain POST that waits for nothing. It needs no other part of the page but this file and link.js; without them
// the form is sent as it is, and a page answers.
import {ask, pause, stopReading} from "./link.js";

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
  stopReading();
  say(`STOP pressed at ${clockTime()}, not confirmed yet.`, true);
  for (let tries = 0; tries < 20; ++tries) {
    try {
      await ask("POST", "/api/v1/stop", {timeoutMs: 1000});
      say(`STOP confirmed at ${clockTime()}: beam off, the cell is aborting.`, false);
      return;
    } catch (fault) {
      say(`STOP is NOT confirmed (${fault.message}). Use the emergency stop on the machine.`, true);
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
