// What somebody has begun on a form and not asked for yet, kept in this browser (IndexedDB, which takes files and masks as they are), one
// draft for each user. A store that is missing, shut (a private window) or full only means that nothing is kept: none of these throws.
import {changed, model} from "./model.js";
import {beginAnew} from "./link.js";
import {kMostPictureBytes} from "./sketch.js";

const kDatabase = "veneer_drafts", kStore = "drafts";
const kLayout = 2;        // of the store: what lies in one of before goes with it
const kVersion = 2;       // of what is kept: what another version of the page has kept is left alone
const kFiles = ["picture", "drawing"];
const kKeepMs = 400;      // a hand on a slider says many things a second
const kDrawnFirst = 2;    // times that a picture is drawn before it counts as open: what is too large for a tab may show only then
const kMostUsers = 5;     // whose drafts are kept; the oldest go
const kOldestMs = 30 * 24 * 3600 * 1000;

// ---- the store ------------------------------------------------------------------------------------------------------

let opened = null;   // the database, or that it is on its way
function database() {
  opened ??= new Promise((done, failed) => {
    const request = indexedDB.open(kDatabase, kLayout);
    request.onupgradeneeded = () => {
      const {result} = request;
      for (const name of [...result.objectStoreNames]) result.deleteObjectStore(name);
      result.createObjectStore(kStore);
    };
    request.onerror = () => failed(request.error);
    request.onsuccess = () => {
      const {result} = request;
      result.onclose = result.onversionchange = () => { result.close(); opened = null; };
      done(result);
    };
  });
  opened.catch(() => { opened = null; });
  return opened;
}

const answered = (request) => new Promise((done, failed) => {
  request.onsuccess = () => done(request.result);
  request.onerror = () => failed(request.error);
});

let current = null;  // the transaction that was begun last
// All that `act(store)` does, in one transaction: what it returns once that is on disk; nothing is done where any of it fails.
async function inStore(mode, act) {
  const transaction = current = (await database()).transaction(kStore, mode);
  const over = new Promise((done, failed) => {
    transaction.oncomplete = done;
    transaction.onabort = () => failed(transaction.error || new DOMException("it was given up", "AbortError"));
  });
  over.catch(() => {});  // it is told below
  try {
    const told = await act(transaction.objectStore(kStore));
    await over;
    return told;
  } catch (refused) {
    try { transaction.abort(); } catch (ended) { /* it is over */ }
    throw refused;
  }
}

// An owner is ["user", "anna"], or ["link", "uid 1000"].
const placeOf = (owner, part) => [...owner, part];
const allOf = (owner) => IDBKeyRange.bound(owner, [...owner, []]);
const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);
const some = (names, from) => Object.fromEntries(names.map((name) => [name, from[name]]));
const isGivenUp = (refused) => refused.name === "AbortError";  // by the page, which is being left: no matter of room
const isUsable = (record) => Boolean(record) && record.version === kVersion;

// A file is known by this, in all tabs, once it was kept; it is large, and put into the store once.
const ids = new WeakMap();
export function fileId(file) {
  if (!file) return null;
  if (!ids.has(file)) ids.set(file, crypto.randomUUID());
  return ids.get(file);
}

// Of whom nobody has heard for long, and of more than are kept.
async function forgetOld(store, owner) {
  const forms = (await answered(store.getAllKeys())).filter(([, , part]) => part === "form");
  const all = await Promise.all(forms.map(async (place) => ({of: place.slice(0, 2), at: Number((await answered(store.get(place))).at) || 0})));
  let room = kMostUsers - 1;  // beside the owner's
  for (const {of, at} of all.sort((a, b) => b.at - a.at))
    if (at < Date.now() - kOldestMs || (!isSame(of, owner) && room-- <= 0)) store.delete(allOf(of));
}

let known = {};  // ids of the files that the store holds, as this tab has seen it last
async function lookInto(store, owner) {
  const [record, picture, drawing] = await Promise.all(["form", ...kFiles].map((part) => answered(store.get(placeOf(owner, part)))));
  if (!isUsable(record)) return null;
  const held = {picture, drawing}, files = {};
  for (const part of kFiles) {
    files[part] = held[part] && held[part].id === record[part] ? held[part].file : null;
    if (files[part]) ids.set(files[part], record[part]);
  }
  known = some(kFiles, record);
  const {id, at, form, of, drawing_name, opening} = record;
  return {id, at, form, of, drawing_name, opening, ...files};
}

// {id, at, form: as it was kept, of: which picture it was, as the form said it, or null; drawing_name; picture, drawing: files, null where
// they could not be kept; opening: the page ended while it opened the picture, or its opening cannot be noted}; null: there is none.
export async function readDraft(owner) {
  try {
    return await inStore("readwrite", async (store) => {
      await forgetOld(store, owner);
      const draft = await lookInto(store, owner);
      if (draft && draft.picture && !draft.opening) await noteOpening(store, owner, true);
      return draft;
    });
  } catch (refused) { /* a full disk can still be read */ }
  const draft = await inStore("readonly", (store) => lookInto(store, owner));
  return draft && {...draft, opening: true};
}

// That a picture is being opened: one that ends the page is not opened unasked again.
async function noteOpening(store, owner, opening) {
  const record = await answered(store.get(placeOf(owner, "form")));
  if (isUsable(record)) store.put({...record, opening}, placeOf(owner, "form"));
}

const refusedFiles = new WeakSet();  // for which there was no room: each stroke would copy them in vain
const mayBeKept = (file) => (file && file.size <= kMostPictureBytes && !refusedFiles.has(file) ? file : null);

// All of it, with these of its files; `held`: ids of those that are there already. -> ids of those that are there then.
function putInto(store, owner, {picture, drawing, ...form}, files, held) {
  const kept = Object.fromEntries(kFiles.map((part) => [part, fileId(files[part])]));
  for (const part of kFiles) {
    if (!files[part]) store.delete(placeOf(owner, part));
    else if (held[part] !== kept[part]) store.put({id: kept[part], file: files[part]}, placeOf(owner, part));
  }
  store.put({version: kVersion, at: Date.now(), ...form, drawing_name: drawing ? drawing.name : "", ...kept}, placeOf(owner, "form"));
  return kept;
}

// One transaction, whatever another tab has put there meanwhile: files that the store does not hold yet go with the form. Whether it keeps
// all of them; it throws where it keeps nothing.
async function putDraft(owner, draft) {
  const {picture, drawing} = draft, [large, small] = [mayBeKept(picture), mayBeKept(drawing)];
  const ways = [{picture: large, drawing: small}, {picture: large, drawing: null}, {picture: null, drawing: small}, {picture: null, drawing: null}];
  const tries = ways.filter((way, n) => ways.findIndex((one) => kFiles.every((part) => one[part] === way[part])) === n);
  for (const [n, files] of tries.entries()) {
    try {
      known = await inStore("readwrite", async (store) => {
        const before = await answered(store.get(placeOf(owner, "form")));
        return putInto(store, owner, draft, files, isUsable(before) ? before : {});
      });
      const lost = [picture, drawing].filter((file) => file && !Object.values(files).includes(file));
      for (const file of lost) refusedFiles.add(file);
      return lost.length === 0;
    } catch (refused) {
      if (isGivenUp(refused) || n === tries.length - 1) throw refused;
    }
  }
}

// The page is being left, and hears no answer any more: nothing is read before. Files that another tab has put there meanwhile are told by
// their ids.
async function doLast(act) {
  try {
    const db = await database();
    try { current.abort(); } catch (ended) { /* it is over, and holds nothing up */ }
    const transaction = db.transaction(kStore, "readwrite");
    act(transaction.objectStore(kStore));
    transaction.commit();
  } catch (refused) { /* nobody is there to be told */ }
}
const putLast = (owner, draft) => doLast((store) => putInto(store, owner, draft, {picture: mayBeKept(draft.picture), drawing: mayBeKept(draft.drawing)}, known));
const dropLast = (owner) => doLast((store) => store.delete(allOf(owner)));

// Unless it is another draft, which another tab has begun; `id` null: whichever it is.
const dropDraft = (owner, id) => inStore("readwrite", async (store) => {
  const record = await answered(store.get(placeOf(owner, "form")));
  if (id === null || !record || record.id === id) store.delete(allOf(owner));
});

// ---- whose it is ----------------------------------------------------------------------------------------------------

// null: of nobody, who has not signed in; undefined: the cell has not said yet. Who uses one console link after the other ("console link
// 3 of uid 1000") is the same user.
function ownerNow() {
  const {user, who} = model.session;
  if (user) return ["user", user];
  if (!who) return undefined;
  const [, maker] = who.match(/^console link \d+ of (.+)$/) || [];
  return maker ? ["link", maker] : null;
}

// ---- a form's draft -------------------------------------------------------------------------------------------------

// `form`: {state(): a text, another one once a hand has changed something; isBegun(); isOpened(): whether the picture that is chosen is open,
// if one is; taken(): {form, of, picture, drawing, opening: whether the picture still waits to be opened}; restore(draft), as readDraft()
// gives it: whether the form took it, which it does not once a hand has set something; clear()}.
// -> {follow(): to be called whenever the form is drawn; forget(): the form begins anew; told(): {at: when what stands there was kept, null
// once it was changed; fault: "" | "files" | "all" | "nobody": what is not kept}}.
export function draftOf(form) {
  let owner = null;           // whose it is; whoever is signed in after that begins the page anew
  let id = crypto.randomUUID();  // of this draft in all tabs, until one of them begins afresh
  let isTaken = false;        // what was kept has come
  let keptAs = "";            // form.state() of what is in the store, or on its way
  let noted = 0;              // drawings until the note goes that the picture is being opened; 0: there is none
  let at = null, fault = "", timer = 0, isLeaving = false;
  const begun = () => { keptAs = form.state(); at = null; noted = 0; clearTimeout(timer); timer = 0; };

  async function take() {
    const asked = id;
    let draft = null;
    try { draft = await readDraft(owner); } catch (refused) { fault = "all"; }
    if (asked !== id) return;  // somebody has begun afresh
    isTaken = true;
    let isRestored = false;
    if (draft) {
      id = draft.id;
      noted = draft.picture ? kDrawnFirst : 0;
      try { isRestored = form.restore(draft); } catch (strange) { /* it is none that this page understands */ }
    }
    if (isRestored) at = draft.at;
    keptAs = isRestored || !form.isBegun() ? form.state() : "";
    changed();
  }

  // One after the other, and of those that wait the newest: a draft is all that there is.
  let waiting = null, isKeeping = false;
  async function keepInTurn(next) {
    waiting = next;
    if (isKeeping) return;
    isKeeping = true;
    while (waiting) {
      const act = waiting;
      waiting = null;
      try { fault = await act() ? "" : "files"; } catch (refused) { if (!isGivenUp(refused)) fault = "all"; }
    }
    isKeeping = false;
    changed();
  }

  function keepNow(put) {
    clearTimeout(timer);
    timer = 0;
    if (!form.isOpened()) { keptAs = ""; return; }  // another picture was chosen meanwhile
    const draft = {id, ...form.taken()};
    noted = draft.opening ? kDrawnFirst : 0;
    put(draft);
  }
  const keepSoon = () => keepNow((draft) => keepInTurn(() => putDraft(owner, draft)));
  addEventListener("pagehide", () => {
    if (isKeeping && !form.isBegun()) dropLast(owner);
    else if (timer || isKeeping) keepNow((draft) => putLast(owner, draft));
  });

  function follow() {
    const now = ownerNow();
    if (now && owner && !isSame(now, owner) && !isLeaving) { isLeaving = true; beginAnew(); }
    if (!now || isLeaving) return;
    if (!owner) { owner = now; take(); }
    if (!isTaken || !form.isOpened()) return;
    if (noted && !form.taken().opening && --noted === 0) {
      inStore("readwrite", (store) => noteOpening(store, owner, false)).catch(() => {});
    }
    const state = form.state();
    if (state === keptAs) return;
    keptAs = state;
    at = null;
    timer ||= setTimeout(keepSoon, kKeepMs);
  }

  // Other tabs that show the same draft begin afresh too: what was forgotten would come back with their next change.
  const tabs = "BroadcastChannel" in window ? new BroadcastChannel(kDatabase) : null;
  const isOwners = () => Boolean(owner) && isSame(ownerNow(), owner);  // nobody forgets another one's
  const drop = (which) => { if (isOwners()) keepInTurn(() => dropDraft(owner, which).then(() => true)); };
  function forget() {
    const which = isTaken ? id : null;
    if (tabs && isTaken && isOwners()) tabs.postMessage({forgotten: id});
    id = crypto.randomUUID();
    isTaken = Boolean(owner);
    begun();
    drop(which);
  }
  if (tabs) tabs.onmessage = ({data}) => {
    if (!isTaken || data.forgotten !== id) return;
    form.clear();
    id = crypto.randomUUID();
    begun();
    drop(data.forgotten);
    changed();
  };

  return {follow, forget, told: () => ({at, fault: ownerNow() === null ? "nobody" : fault})};
}
