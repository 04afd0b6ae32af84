// Speaking with the daemon: requests, the status every two seconds, the event stream in between, and STOP, which is a
// plain POST and waits for neither.
"use strict";

async function ask(method, path, timeoutMs = 5000, body = null) {
  const giveUp = new AbortController();
  const timer = setTimeout(() => giveUp.abort(), timeoutMs);
  try {
    const asked = {method, signal: giveUp.signal, cache: "no-store"};
    if (body) Object.assign(asked, {body: JSON.stringify(body), headers: {"Content-Type": "application/json"}});
    const reply = await fetch(path, asked);
    const told = await reply.json().catch(() => ({}));
    if (reply.ok) return told;
    const sentence = told.error && told.error.message ? told.error.message : `the cell answered ${reply.status}`;
    throw Object.assign(new Error(sentence), {answered: true});
  } catch (fault) {
    if (fault.answered) throw fault;
    throw new Error("The cell does not answer. Is veneerd running?");
  } finally {
    clearTimeout(timer);
  }
}

async function poll() {
  try {
    takeStatus(await ask("GET", "/api/v1/status"));
    const session = await ask("GET", "/api/v1/session");
    if (session.role !== role) { role = session.role; show(); }
  } catch (fault) {
    // The age of the data tells.
  }
  setTimeout(poll, kPollMs);
}

function listen() {
  const socket = new WebSocket(`ws://${location.host}` + "/api/v1/events");
  socket.onopen = () => { loadJobs(); loadPanels(); showBed(); };
  socket.onmessage = (message) => {
    let event;
    try { event = JSON.parse(message.data); } catch (fault) { return; }
    if (event.type === "status" && event.status) takeStatus(event.status);
    if (event.type === "task" && event.task) takeTask(event.task);
    if (event.type === "job") loadJobs();
    if (event.type === "panel") loadPanels();
    if (event.type === "bed") showBed();
  };
  socket.onclose = () => setTimeout(listen, kPollMs);
}

// ---- STOP -----------------------------------------------------------------------------------------------------------

function clockTime() { return new Date().toLocaleTimeString("en-GB"); }

function noteStop(text, bad) {
  $("stop-note").textContent = text;
  $("stop-note").classList.toggle("dead", bad);
  $("stop-note").hidden = false;
}

async function stop(event) {
  event.preventDefault();
  noteStop(`STOP pressed at ${clockTime()}, not confirmed yet.`, true);
  for (let tries = 0; tries < 20; ++tries) {
    try {
      await ask("POST", "/api/v1/stop", 1000);
      noteStop(`STOP confirmed at ${clockTime()}: beam off, the cell is aborting.`, false);
      return;
    } catch (fault) {
      noteStop(`STOP is NOT confirmed (${fault.message}). Use the emergency stop on the machine.`, true);
      await new Promise((again) => setTimeout(again, 200));
    }
  }
}
