// Speaking with the daemon: requests, the status every two seconds, the event stream in between, and STOP, which is a
// plain POST and waits for neither.
"use strict";

// What a console link opens. It lives in this tab only: sessionStorage belongs to one scheme, host and port, while a
// cookie would go to every server of this machine. It travels in a header that no other page can set.
const kSession = "veneer_session";

function headersOf(headers) {
  const session = sessionStorage.getItem(kSession);
  return session ? {...headers, Authorization: `Bearer ${session}`} : headers;
}

// The link's token stands behind the #, which browsers keep to themselves, and is used up at once.
async function enter() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!token) return;
  history.replaceState(null, "", location.pathname);
  try {
    sessionStorage.setItem(kSession, (await ask("POST", "/api/v1/session", 5000, {token})).session);
  } catch (fault) {
    showRefusal(fault.message);
  }
}

// A browser has six connections to one server, and a request that finds them taken waits in the browser. Nothing that
// only reads may stand before STOP there: pictures, which can be slow, take two at most, and STOP ends all reading.
const kPicturesAtOnce = 2;
let reading = new AbortController();

function stopReading() {
  reading.abort();
  reading = new AbortController();
}

async function ask(method, path, timeoutMs = 5000, body = null) {
  const giveUp = new AbortController();
  const timer = setTimeout(() => giveUp.abort(), timeoutMs);
  if (method === "GET") reading.signal.addEventListener("abort", () => giveUp.abort(), {once: true});
  try {
    const headers = {};
    if (body) headers["Content-Type"] = "application/json";
    // Sent twice by whatever lies between, it is done once. STOP may be done as often as it comes.
    if (method !== "GET" && path !== "/api/v1/stop") headers["Idempotency-Key"] = crypto.randomUUID();
    const reply = await fetch(path, {method, signal: giveUp.signal, cache: "no-cache", headers: headersOf(headers),
                                     body: body ? JSON.stringify(body) : undefined});
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

// A long list, page by page.
async function askAll(path, list) {
  const all = [];
  for (let cursor = 0; cursor !== null && cursor !== undefined;) {
    const page = await ask("GET", `${path}${path.includes("?") ? "&" : "?"}limit=1000&cursor=${cursor}`);
    all.push(...(page[list] || []));
    cursor = page.next;
  }
  return all;
}

let picturesOnTheirWay = 0;
const picturesWaiting = [];

// Asked for as this console, not as anybody's <img>: a crowd of anonymous clients does not take its place. "" when none
// comes.
async function pictureUrl(path) {
  if (picturesOnTheirWay >= kPicturesAtOnce) await new Promise((turn) => picturesWaiting.push(turn));
  ++picturesOnTheirWay;
  try {
    const reply = await fetch(path, {cache: "no-cache", headers: headersOf({}), signal: reading.signal});
    return reply.ok ? URL.createObjectURL(await reply.blob()) : "";
  } catch (fault) {
    return "";
  } finally {
    --picturesOnTheirWay;
    if (picturesWaiting.length > 0) picturesWaiting.shift()();
  }
}

function putPicture(image, url) {
  const before = image.dataset.url;
  image.src = image.dataset.url = url;
  if (before) URL.revokeObjectURL(before);
}

// Shows the picture as it is now; the last one stays until it is there, and when none comes. Did it come?
async function renewPicture(image, path) {
  const url = await pictureUrl(path);
  if (url) putPicture(image, url);
  return Boolean(url);
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
  const session = sessionStorage.getItem(kSession);
  const protocols = ["veneer.events"].concat(session ? [`bearer.${session}`] : []);  // a WebSocket has no other headers
  const socket = new WebSocket(`ws://${location.host}` + "/api/v1/events", protocols);
  socket.onopen = () => { loadJobs(); loadPanels(); showBed(); };
  socket.onmessage = (message) => {
    let event;
    try { event = JSON.parse(message.data); } catch (fault) { return; }
    if (event.type === "status" && event.status) takeStatus(event.status);
    if (event.type === "task" && event.task) takeTask(event.task);
    if (event.type === "job") loadJobs();
    if (event.type === "panel") { loadPanels(); lookAgainAtSuspects(); }
    if (event.type === "bed") showBed();
  };
  socket.onclose = () => setTimeout(listen, kPollMs);
}

// ---- STOP -----------------------------------------------------------------------------------------------------------

function clockTime() { return new Date().toLocaleTimeString("en-GB"); }

let stopNote = "";  // "" none, "told" what became of the last STOP, "aborting" and the status says so too

// What a STOP has done is told until the cell is cleared.
function forgetStop() {
  if (cell.state.startsWith("Abort")) { if (stopNote) stopNote = "aborting"; return; }
  if (stopNote !== "aborting") return;
  stopNote = "";
  $("stop-note").hidden = true;
}

function noteStop(text, bad) {
  stopNote = bad ? "" : "told";
  $("stop-note").textContent = text;
  $("stop-note").classList.toggle("dead", bad);
  $("stop-note").hidden = false;
}

async function stop(event) {
  event.preventDefault();
  stopReading();
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
