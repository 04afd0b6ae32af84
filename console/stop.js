// STOP, a plain POST that waits for nothing. It needs no other part of the page but this file and link.js; without them
// the form is sent as it is, and a page answers.
//
// It is sent again until the cell confirms it: quickly at first, then once a second, and never more than two at once.
// What became of it is told until the cell, asked anew after it was confirmed, says that it rests: what the stream of
// events tells may be older. Unconfirmed it ends only when somebody who was told so says that it is seen to, or once the
// cell has aborted since and was cleared by a person.
import {ask, pause, recall, stopAsking} from "./link.js";

// Its own words, so that a catalogue that did not come keeps nobody from hearing of it.
const german = (recall("veneer_language") || navigator.language).startsWith("de");
const kSaid = german ? {
  button: "Strahl sofort aus",
  pressed: (at) => `STOP um ${at} gedrückt, noch nicht bestätigt.`,
  confirmed: (at) => `STOP um ${at} bestätigt: Strahl aus, die Zelle bricht ab.`,
  rests: (at) => `STOP um ${at} bestätigt: Strahl aus, die Zelle steht.`,
  silentLaser: (at) => `STOP wurde um ${at} gesendet, aber der Laser antwortet nicht: Drücken Sie den Not-Halt an der Maschine.`,
  goesOn: (at, state) => `STOP um ${at} bestätigt, und jetzt meldet die Zelle ${state}. Hat niemand sie wieder freigegeben, drücken Sie den Not-Halt an der Maschine.`,
  not: (why) => `STOP ist NICHT bestätigt (${why}). Drücken Sie den Not-Halt an der Maschine. STOP wird weiter gesendet.`,
  seenTo: "Ich habe mich darum gekümmert: STOP nicht mehr senden",
  read: "Ich habe es gelesen",
  silent: "die Zelle antwortet nicht",
} : {
  button: "beam off at once",
  pressed: (at) => `STOP pressed at ${at}, not confirmed yet.`,
  confirmed: (at) => `STOP confirmed at ${at}: beam off, the cell is aborting.`,
  rests: (at) => `STOP confirmed at ${at}: beam off, the cell has stopped.`,
  silentLaser: (at) => `STOP was sent at ${at}, but the laser does not answer: use the emergency stop on the machine.`,
  goesOn: (at, state) => `STOP was confirmed at ${at}, and now the cell says ${state}. If nobody has cleared it and begun again, use the emergency stop on the machine.`,
  not: (why) => `STOP is NOT confirmed (${why}). Use the emergency stop on the machine. STOP goes on being sent.`,
  seenTo: "I have seen to it: send STOP no more",
  read: "I have read it",
  silent: "the cell does not answer",
};

document.querySelector("#stop small").textContent = kSaid.button;
const kQuickTries = 20, kQuickMs = 200, kSlowMs = 1000;
const kAtOnce = 2;       // that nobody has answered yet
const kBesideMs = 1000;  // until another goes beside one that is not answered
const kGivenUpMs = 2000; // and until that one is given up
const kToldMs = 3000;    // nobody can say that it is seen to before it could be read
const kLookMs = 1000;
// Where nothing burns, and where a person has brought it from Aborted.
const kCleared = ["Clearing", "Stopped", "Resetting", "Idle", "Complete"];

const note = document.getElementById("stop-note");
const words = note.appendChild(document.createElement("span"));
const seenTo = note.appendChild(document.createElement("button"));
seenTo.type = "button";
seenTo.hidden = true;
seenTo.addEventListener("click", end);

let press = 0;             // the last one; what an earlier one does is over
let confirmedAt = "";      // the time of day when the cell confirmed it, "" before
let before = "";           // the cell's state, as it was told last
const underWay = new Set();

function say(text, bad) {
  if (words.textContent !== text) words.textContent = text;
  note.classList.toggle("dead", bad);
  note.hidden = false;
}

function offerEnd(label) {
  if (seenTo.textContent !== label) seenTo.textContent = label;
  seenTo.hidden = false;
}

function end() {
  ++press;
  confirmedAt = "";
  note.hidden = seenTo.hidden = true;
}

const clockTime = () => new Date().toLocaleTimeString("en-GB");

// Resolves when it is over, however it ended.
function send(mine, since) {
  stopAsking();
  const one = ask("POST", "/api/v1/stop", {timeoutMs: kGivenUpMs}).then(() => taken(mine),
    (fault) => notTaken(mine, since, fault.answered ? fault.message : kSaid.silent));
  underWay.add(one);
  return one.finally(() => underWay.delete(one));
}

function taken(mine) {
  if (mine !== press || confirmedAt) return;
  confirmedAt = clockTime();
  seenTo.hidden = true;
  say(kSaid.confirmed(confirmedAt), false);
}

function notTaken(mine, since, why) {
  if (mine !== press || confirmedAt) return;
  say(kSaid.not(why), true);
  if (performance.now() - since >= kToldMs) offerEnd(kSaid.seenTo);
}

async function stop(event) {
  event.preventDefault();
  end();
  const mine = press, since = performance.now(), wasAborted = before.startsWith("Abort");
  say(kSaid.pressed(clockTime()), true);
  for (let tries = 1; mine === press && !confirmedAt; ++tries) {
    // Of an earlier press: a tired connection takes what it was given, or gives it up.
    while (underWay.size >= kAtOnce) await Promise.race(underWay);
    if (mine !== press) return;
    const sent = send(mine, since);
    if (tries === 1) followCell(mine, wasAborted);  // no question goes before STOP
    const answered = await Promise.race([sent.then(() => true), pause(kBesideMs)]);
    if (answered) await pause(tries < kQuickTries ? kQuickMs : kSlowMs);
    else notTaken(mine, since, kSaid.silent);
  }
}

// Asks the cell itself how it is, as long as something is said of this press.
async function followCell(mine, wasAborted) {
  for (let aborted = false; mine === press; await pause(kLookMs)) {
    const asked = confirmedAt;  // what is asked from here on is younger than that
    let state = "", laser = null;
    try { ({state, laser} = await ask("GET", "/api/v1/status", {timeoutMs: kGivenUpMs, forStop: true})); } catch (fault) {
      // Who has not signed in is not told.
      if (mine === press && asked && fault.status >= 400 && fault.status < 500) offerEnd(kSaid.read);
      continue;
    }
    if (mine !== press) return;
    if (!state) continue;  // the answer broke off
    const aborts = state.startsWith("Abort");
    if (asked && kCleared.includes(state)) return end();
    if (!asked && aborted && !aborts) return end();
    aborted = aborted || (aborts && !wasAborted);
    if (!asked) continue;
    if (!aborts) offerEnd(kSaid.read); else seenTo.hidden = true;
    // A machine that is asked and does not answer may do anything; one that nobody has asked yet is at rest.
    if (aborts && laser && !laser.connected && laser.why_not_connected) say(kSaid.silentLaser(asked), true);
    else say(aborts ? (state === "Aborted" ? kSaid.rests : kSaid.confirmed)(asked) : kSaid.goesOn(asked, state), !aborts);
  }
}

export const followStop = (state) => { before = state; };

document.getElementById("stop").addEventListener("submit", stop);
