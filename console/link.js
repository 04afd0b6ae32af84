// Speaking with the daemon: requests, lists page by page, and the stream of events.

// What a console link or a password opens. On the cell's own machine it lives in this tab only: sessionStorage belongs to
// one scheme, host and port, while a cookie would go to every server of this machine. It travels in a header that no
// other page can set. On another machine, where the page comes by HTTPS, it is in a cookie that no script sees.
const kSession = "veneer_session";
const kByCookie = location.protocol === "https:";
const kPollMs = 2000;

// What the browser keeps of this page: `store()` is localStorage or sessionStorage. Where they are shut or full, as by a setting, that is
// until somebody leaves the page or loads it anew; nothing on the page may fail for it, STOP least of all.
const untilLeft = new Map((history.state && history.state.untilLeft) || []);
if (untilLeft.size) history.replaceState(null, "");
export function recall(name, store = () => localStorage) {
  if (untilLeft.has(name)) return untilLeft.get(name);  // the store may still have what was there before
  try { return store().getItem(name); } catch (fault) { return null; }
}
// null: it is forgotten.
export function remember(name, value, store = () => localStorage) {
  untilLeft.set(name, value);
  try {
    if (value === null) store().removeItem(name); else store().setItem(name, value);
    untilLeft.delete(name);
  } catch (fault) { /* shut, or full */ }
}
// The page is loaded anew by itself: what no store has goes along.
export function beginAnew() {
  if (untilLeft.size) history.replaceState({untilLeft: [...untilLeft]}, "");
  location.reload();
}
const ofTab = () => sessionStorage;

export function headersOf(headers) {
  const session = recall(kSession, ofTab);
  return session ? {...headers, Authorization: `Bearer ${session}`} : headers;
}

// The link's token stands behind the #, which browsers keep to themselves, and is used up at once.
export async function enter() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!token) return;
  history.replaceState(null, "", location.pathname);
  await open({token});
}

async function open(by) {
  const opened = await ask("POST", "/api/v1/session", {body: kByCookie ? {...by, cookie: true} : by});
  if (opened.session) remember(kSession, opened.session, ofTab);
}

// The page begins anew as somebody else.
export async function signIn(user, password) {
  await open({user, password});
  location.hash = "";
  beginAnew();
}

export async function signOut() {
  await ask("DELETE", "/api/v1/session");
  remember(kSession, null, ofTab);
  location.hash = "";
  beginAnew();
}

// A browser has six connections to one server, and a request that finds them taken waits in the browser. Nothing may
// stand before STOP there, a command that is answered once the head stands no more than a picture: STOP ends all of it.
// What the cell was told is done, or was not heard; its state tells.
const kStop = "/api/v1/stop";
let asking = new AbortController();
export const untilStop = () => asking.signal;
export function stopAsking() {
  asking.abort();
  asking = new AbortController();
}

export const kSilent = "The cell does not answer. Is veneerd running?";

// `body`: an object becomes JSON, a File goes as it is. `forStop`: asked because of STOP, which ends all else. `until`: a signal of
// whoever asks, who needs no answer after it.
export async function ask(method, path, {body = null, timeoutMs = 5000, forStop = path === kStop, until = null} = {}) {
  const giveUp = new AbortController();
  const timer = setTimeout(() => giveUp.abort(), timeoutMs);
  const stopped = untilStop();
  const end = () => giveUp.abort();
  if (!forStop) stopped.addEventListener("abort", end);
  if (until && until.aborted) end();
  else if (until) until.addEventListener("abort", end);
  try {
    const headers = {};
    const file = body instanceof Blob;
    if (body) headers["Content-Type"] = file ? "application/octet-stream" : "application/json";
    // Sent twice by whatever lies between, it is done once. STOP may be done as often as it comes.
    if (method !== "GET" && path !== kStop) headers["Idempotency-Key"] = crypto.randomUUID();
    const reply = await fetch(path, {method, signal: giveUp.signal, cache: "no-cache", headers: headersOf(headers),
                                     body: body && !file ? JSON.stringify(body) : body});
    const told = await reply.json().catch(() => ({}));
    if (reply.ok) return told;
    const sentence = told.error && told.error.message ? told.error.message : `the cell answered ${reply.status}`;
    throw Object.assign(new Error(sentence), {answered: true, status: reply.status});
  } catch (fault) {
    if (fault.answered) throw fault;
    if (!forStop && stopped.aborted) throw new Error("Given up for STOP: look whether the cell has done it.");
    throw new Error(kSilent);
  } finally {
    clearTimeout(timer);
    stopped.removeEventListener("abort", end);
  }
}
export const get = (path) => ask("GET", `/api/v1${path}`);

// A long list, page by page; at most `most` of it.
export async function askAll(path, list, most = Infinity) {
  const all = [];
  let next = null;
  do {
    const from = next === null ? "" : `&cursor=${encodeURIComponent(next)}`;
    const page = await get(`${path}${path.includes("?") ? "&" : "?"}limit=${Math.min(1000, most)}${from}`);
    all.push(...(page[list] || []));
    next = page.next ?? null;
  } while (next !== null && all.length < most);
  return all;
}

// `take` gets each event, those that came while the stream was broken too; {type: "open"} when it has begun anew, and
// what came meanwhile is not known.
// Of those that it missed each says so, `missed`: they are of an earlier time.
let life = "", seen = 0;
export function listen(take) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const session = recall(kSession, ofTab);
  const protocols = ["veneer.events"].concat(session ? [`bearer.${session}`] : []);  // a WebSocket has no other headers
  const place = life ? `?life=${encodeURIComponent(life)}&since=${seen}` : "";
  const socket = new WebSocket(`${scheme}://${location.host}` + "/api/v1/events" + place, protocols);
  let newest = 0;
  socket.onmessage = (message) => {
    let event;
    try { event = JSON.parse(message.data); } catch (fault) { return; }
    if (event.seq !== undefined) seen = event.seq;
    if (event.type !== "hello") return take({...event, missed: event.seq <= newest});
    life = event.life;
    newest = event.newest;
    if (!event.resumed) take({type: "open"});
  };
  socket.onclose = () => setTimeout(() => listen(take), kPollMs);
}

// How long until a question that was not answered is asked again; with each drawing would be twice a second.
export const kAgainMs = 5000;
export const pause = (ms) => new Promise((again) => setTimeout(again, ms));
export {kPollMs};
