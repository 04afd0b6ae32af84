// Lines that the cell draws over a picture while a hand changes what they depend on: rough ones within a moment, and those that a plan
// would have once nothing else is asked for. One request at a time, of what is wanted by then.
import {ask} from "./link.js";
import {changed} from "./model.js";
import {isHeld, isSketching, onAlone} from "./sketch.js";

const kSettleMs = 120;       // a hand says many things a second
const kPatienceMs = 60000;   // a sketch and other fine lines may go first
const kFullMs = 1500;        // until a cell that has no room for it is asked again

// `path`: of the API. What is wanted is {file, key, name}: another key, other lines; another name, lines that cannot stand for them meanwhile.
// `request`: {query, body} of what is wanted, or it throws a sentence. `waits`: whether fine lines have to. `came`: there are others.
export function liveLines(path, {request, waits = () => false, came}) {
  let wanted = null;
  let shown = null;    // {file, name, key, fine, told}; another key: of a moment ago
  let refused = null;  // {file, key, sentence}
  let asking = null;   // {key, fine, giveUp}
  let timer = 0;

  const isOf = (one) => Boolean(one && wanted && one.file === wanted.file && one.key === wanted.key);
  // Not later because something changes again: lines follow a finger that moves steadily.
  const askSoon = (ms) => { if (!timer) timer = setTimeout(() => { timer = 0; askNext(); }, ms); };
  const giveUp = () => { if (asking) asking.giveUp.abort(); asking = null; };

  onAlone(giveUp);

  async function askNext() {
    if (asking || isHeld() || !wanted || isOf(refused) || (isOf(shown) && (shown.fine || isSketching() || waits()))) return;
    const of = wanted, mine = asking = {key: of.key, fine: isOf(shown), giveUp: new AbortController()};
    changed();
    try {
      const {query, body} = await request(of);
      if (asking !== mine) return;
      if (mine.fine) query.set("fine", "1");
      const told = await ask("POST", `/api/v1${path}?${query}`, {body, timeoutMs: kPatienceMs, until: mine.giveUp.signal});
      if (asking === mine) { shown = {file: of.file, name: of.name, key: mine.key, fine: mine.fine, told}; refused = null; came(); }
    } catch (fault) {
      if (asking === mine && fault.status === 503) { asking = null; return askSoon(kFullMs); }
      if (asking === mine) refused = {file: of.file, key: mine.key, sentence: fault.message};
    }
    if (asking !== mine) return;
    asking = null;
    changed();
    askNext();
  }

  return {
    // null: none are. Whether it is something else than before.
    want(next) {
      if (!next || (asking && asking.fine && (isSketching() || asking.key !== next.key))) giveUp();  // what is wanted at once goes before
      const other = !next || !wanted || wanted.key !== next.key;
      wanted = next;
      if (next) askSoon(kSettleMs);
      return other;
    },
    // What was told of this very picture and name, be it of a moment ago; null: nothing.
    told: () => (shown && wanted && shown.file === wanted.file && shown.name === wanted.name ? shown.told : null),
    isThere: () => isOf(shown),
    isFine: () => isOf(shown) && shown.fine,
    // Whether others are still to come of what is wanted.
    areComing: () => Boolean(wanted) && !isOf(refused) && !(isOf(shown) && shown.fine),
    fault: () => (isOf(refused) ? refused.sentence : ""),
    again() { refused = null; askNext(); },
  };
}
