// What somebody has begun and not asked for yet, kept in this browser (IndexedDB, which takes files and masks as they are), one draft
// for each user. A store that is missing, shut (a private window) or full only means that nothing is kept: none of these throws.
const kDatabase = "veneer_drafts", kStore = "drafts";
const kVersion = 1;  // of what is kept: what another version of the page has kept is left alone
const kParts = ["form", "picture", "drawing"];

let fault = "";      // "": all of it is kept; "files": all but the picture and the drawing that came with it; "all": nothing is
export const draftFault = () => fault;

let opened = null;   // the database, or that it is on its way
function database() {
  opened ??= new Promise((done, failed) => {
    const request = indexedDB.open(kDatabase, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(kStore);
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

// What `act` asked for, once all of it is on disk.
async function inStore(mode, act) {
  const transaction = (await database()).transaction(kStore, mode);
  const asked = act(transaction.objectStore(kStore));
  return new Promise((done, failed) => {
    transaction.oncomplete = () => done(asked.map(({result}) => result));
    transaction.onabort = () => failed(transaction.error);
  });
}

const placeOf = (user, part) => [user, part];
const isOf = (file, of) => Boolean(file && of && file.name === of.name && file.size === of.size && file.lastModified === of.lastModified);
const nameOf = (file) => (file ? {name: file.name, size: file.size, lastModified: file.lastModified} : null);

// {form: as it was kept, picture, drawing: files, each null where it could not be kept; of: {name, size, lastModified} of the picture, or
// null}; null: there is none.
export async function readDraft(user) {
  try {
    const [form, picture, drawing] = await inStore("readonly", (store) => kParts.map((part) => store.get(placeOf(user, part))));
    if (!form || form.version !== kVersion) return null;
    // Another window may have kept another file since.
    return {form: form.of_form, at: form.at, of: form.picture, picture: isOf(picture, form.picture) ? picture : null, drawing: isOf(drawing, form.drawing) ? drawing : null};
  } catch (refused) {
    fault = "all";
    return null;
  }
}

// Whether the file is in the store, which then holds no other at its place.
async function keepFile(user, part, file) {
  try {
    await inStore("readwrite", (store) => [file ? store.put(file, placeOf(user, part)) : store.delete(placeOf(user, part))]);
    return true;
  } catch (refused) {
    await inStore("readwrite", (store) => [store.delete(placeOf(user, part))]).catch(() => {});
    return false;
  }
}

// One after the other: what is forgotten does not come back with what was on its way.
let last = Promise.resolve();
const inTurn = (act) => { last = last.then(act); return last; };

let lastFiles = null;  // {user, picture, drawing, kept}: files are large, and seldom others
export const keepDraft = (user, {form, picture, drawing}) => inTurn(async () => {
  try {
    if (!lastFiles || lastFiles.user !== user || lastFiles.picture !== picture || lastFiles.drawing !== drawing) {
      const kept = [await keepFile(user, "picture", picture), await keepFile(user, "drawing", drawing)].every(Boolean);
      lastFiles = {user, picture, drawing, kept};
    }
    await inStore("readwrite", (store) => [store.put({version: kVersion, at: Date.now(), of_form: form, picture: nameOf(picture), drawing: nameOf(drawing)}, placeOf(user, "form"))]);
    fault = lastFiles.kept ? "" : "files";
  } catch (refused) {
    lastFiles = null;
    fault = "all";
  }
});

export const forgetDraft = (user) => inTurn(async () => {
  lastFiles = null;
  try { await inStore("readwrite", (store) => kParts.map((part) => store.delete(placeOf(user, part)))); } catch (refused) { fault = "all"; }
});
