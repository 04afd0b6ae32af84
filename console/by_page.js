// What the cell says to do is told as commands (`veneerctl job redo 3 A1-2`), since it speaks to whoever asked. On the
// page each is told by the screen and the button that do the same; what the page has no button for stays as it is. So are options and
// parameters of a request, by the fields that say the same.
import {t} from "./words.js";
import {fieldAt, kNextName} from "./field_names.js";

// A1-2; without rows A312; short ones 7K, but none of signs alone that are the same in a mirror.
const kOneMark = "(?:[A-Z]+\\d+(?:-\\d+)?|(?![8AHMUVWXY]+(?![\\w-]))[1-8ACDEFHKLMNPRUVWXY]{1,4})(?![\\w-])";
const kPanel = "(P-\\d+)", kJob = "(\\d+)", kMark = `(${kOneMark})`, kMarks = `${kOneMark}(?: ${kOneMark})*`, kText = "[^\\s`,;:()]+";
const kEnd = `(?! -| PIECE| JOB| \\d| ${kOneMark})`;  // nothing more that belongs to the command
const about = (...words) => words.filter(Boolean);

// Of each: the words of the command; then from what they name, the screen it is done on, and what stands there:
// [address, words ...]. Longer ones before those that they begin with.
const scan = (face, panel, ...more) => ["scan", about(face && t(`face.${face}`), panel, ...more)];
const kCommands = [
  // Panels and scans
  [`panel scan --face (show|back)(?: --panel ${kPanel})?`, (face, panel) => scan(face, panel)],
  [`panel scan --panel ${kPanel}(?: --face (show|back))?`, (panel, face) => scan(face, panel)],
  ["panel scan --anew", () => scan("", "", t("scan.anew"))],
  [`panel scan --again ${kJob}`, (n) => scan("", "", t("scan.again", {n}))],
  ["panel scan --more", () => scan("", "", t("scan.more"))],
  [`panel scan${kEnd}`, () => scan("", "", t("scan.do"))],
  [`panel restore ${kPanel}`, (panel) => [`panels/${panel}`, [t("retire.back_do", {panel})]]],
  [`panel retire ${kPanel}`, (panel) => [`panels/${panel}`, [t("retire.do", {panel})]]],
  [`panel split ${kPanel}`, (panel) => [`panels/${panel}`, [t("split.do", {panel})]]],
  [`panel merge ${kPanel} ${kPanel}`, (panel, other) => [`panels/${panel}`, [t("merge.do", {panel, other})]]],
  ["panel restore", () => ["panels", [t("retire.back")]]],
  [`panel mask ${kPanel} --list`, (panel) => [`panels/${panel}`, [panel, t("brush.painted")]]],
  [`panel mask(?: ${kPanel})?`, (panel) => [panel ? `panels/${panel}` : "panels", about(panel, t("brush.on"))]],
  [`panel material(?: ${kPanel})?`, (panel) => [panel ? `panels/${panel}` : "panels", about(panel, t("say"))]],
  [`panel scans ${kPanel}`, (panel) => [`panels/${panel}`, [panel, t("versions")]]],
  [`panel decide ${kPanel} \\d+ written-off`, (panel) => [`panels/${panel}`, [panel, t("difference.write_off")]]],
  [`panel decide ${kPanel} \\d+ accepted`, (panel) => [`panels/${panel}`, [panel, t("difference.leave")]]],
  ["\\.\\.\\. accepted", () => ["panels", [t("difference.leave")]]],
  [`panel (?:differences|show) ${kPanel}`, (panel) => [`panels/${panel}`, [panel]]],
  [`panel accept \\d+(?: --override ${kText})*`, () => ["scan", [t("scan.accept")]]],
  ["panel refuse \\d+", () => ["scan", [t("scan.refuse")]]],
  ["panel proposals(?: \\d+| --all)?", () => ["scan", []]],
  ["panel list --all", () => ["panels", [t("panels.retired")]]],
  ["panel list", () => ["panels", []]],
  // Jobs and pieces
  [`job start ${kJob}`, (job) => [`run/${job}`, [t("job.number", {n: job}), t("do.start")]]],
  [`job settle ${kJob} --as-seen --there (?:scrap|released) --pieces (${kMarks})`, (job, marks) => ["run", [t("suspects"), marks.split(" ").join(", ")]]],
  [`job settle ${kJob} ${kMark} (cut|scrap|released)`, (job, mark, verdict) => ["run", [mark, t(`verdict.${verdict}`)]]],
  [`job settle ${kJob} ${kMark} suspect`, (job, mark) => ["run", [mark, t("missing.take_back")]]],
  [`job settle ${kJob} ${kMark}`, (job, mark) => ["run", [t("suspects"), mark]]],
  [`job settle(?: ${kJob})?(?: PIECE VERDICT)?${kEnd}`, () => ["run", [t("suspects")]]],
  [`job redo ${kJob} ${kMark} --lost`, (job, mark) => ["run", [mark, t("lost.do")]]],
  [`job redo(?: ${kJob}| JOB)?(?: PIECE)? --lost(?: ${kMark})?`, (job, mark) => ["run", about(mark, t("lost.do"))]],
  [`job redo(?: ${kJob})?(?: ${kMark})?${kEnd}`, (job, mark) => ["run", about(mark, t("missing.one"))]],
  [`job cancel ${kJob}`, (job) => [`history/${job}`, [t("job.number", {n: job}), t("history.cancel")]]],
  [`job pieces ${kJob}`, (job) => [`assembly/${job}`, [t("job.number", {n: job})]]],
  [`job change ${kJob} --alternatives \\d+`, (plan) => ["new", [t("plan.number", {n: plan}), t("places.find")]]],
  [`job new --plan ${kJob}`, (plan) => ["new", [t("plan.number", {n: plan}), t("plan.job")]]],
  [`job release(?: ${kJob})?`, () => ["cell", [t("leases.back")]]],
  ["job advise", () => ["new", [t("picture.advise")]]],
  ["job plan PICTURE", () => ["new", [t("picture.plan")]]],
  ["job plans", () => ["new", [t("plans")]]],
  ["job list", () => ["history", []]],
  // The machine
  ["calibrate (scanner|camera|laser|kerf)(?: --(?:more|height-mm \\S+|board-width-mm \\S+|board-height-mm \\S+))*", (step) => [`setup/${step}`, [t(`setup.${step}`)]]],
  ["(hold|unhold|unsuspend|clear|reset)", (name) => ["run", [t(`do.${name}`)]]],
  ["write-off-look", () => ["cell", [t("owed.write_off")]]],
  ["device", () => ["setup/devices", [t("setup.devices")]]],
  ["recipe list", () => ["settings", [t("recipes")]]],
  ["camera (?:list|try \"[^\"]*\")", () => ["setup/devices", [t("setup.devices")]]],
  ["scanner list", () => ["settings", [t("scanners.find")]]],
  ["laser here", () => ["settings", [t("corner.do")]]],
  ["laser test-pattern", () => ["settings", [t("pattern")]]],
  ["db backups", () => ["settings", [t("backups")]]],
  ["db backup", () => ["settings", [t("backup.do")]]],
  ["db check", () => ["settings", [t("check.do")]]],
  ["user list", () => ["account", [t("account.users")]]],
  ["token (?:list|revoke)", () => ["account", [t("account.tokens")]]],
].map(([words, place]) => ({words: new RegExp(`^(?:${words})(?![\\w-])`), place}));

// What is left out of a command, or said of one. `of`: only where the same sentence has led to that screen already, since
// other commands have such an option too.
const kOptions = [
  [`--face (show|back)(?: --panel ${kPanel})?`, (face, panel) => scan(face, panel)],
  ["--lost", () => ["run", [t("lost.do")]]],
  ["--retag", () => scan("", "", t("scan.choose"), t("scan.retag"))],
  ["--list", () => ["panels", [t("brush.painted")]]],
  ["--anew", () => scan("", "", t("scan.anew")), "#scan"],
  ["--more", () => scan("", "", t("scan.more")), "#scan"],
].map(([words, place, of]) => ({words: new RegExp(`^(?:${words})(?![\\w-])`), place, of}));

const kOr = "(or released for scrap, when ";  // of the verdicts on what a scan saw

const kTicks = /^(?:[Vv]eneerctl by )?(?:--confirm "[^"]*" ?)+/;

function placeOf(text, all) {
  for (const {words, place} of all) {
    const found = text.match(words);
    if (!found) continue;
    const [screen, what] = place(...found.slice(1));
    return {length: found[0].length, href: `#${screen}`, text: titleOf(screen, what)};
  }
  return null;
}

const titleOf = (screen, what) => [t(`screen.${screen.split("/")[0]}`), ...what].join(": ");
const kNext = new RegExp(`\`|veneerctl |--[a-z]|\\(or released|${kNextName}`, "i");

// A sentence of the cell's in parts: its own words, which are English, and {text, href} in the page's language for each
// way that the page has, and for what it has no field for (href: "").
export function byPage(sentence) {
  const parts = [];
  let own = "";
  const take = (words) => { own += words; };
  const tell = (place) => {
    own = own.replace(/\b(?:run|Run) $/, (run) => (run[0] === "R" ? "Go to " : "go to "));
    if (own) parts.push(own);
    own = "";
    parts.push({text: place.href ? t("by.quoted", {what: place.text}) : place.text, href: place.href});
  };
  const wayOf = (field) => field && {length: field.length, href: field.screen && `#${field.screen}`, text: field.screen ? titleOf(field.screen, field.words) : field.words[0]};
  let at = 0;
  while (at < sentence.length) {
    const rest = sentence.slice(at), field = at === 0 || /[\s(]/.test(sentence[at - 1]) ? fieldAt(rest) : null;
    const quoted = rest.match(/^`([^`]*)`/);
    if (quoted) {
      const inner = quoted[1].replace(/^veneerctl /i, ""), place = placeOf(inner, kCommands);
      if (place && place.length === inner.length) tell(place); else take(quoted[0]);
      at += quoted[0].length;
    } else if (kTicks.test(rest)) {
      const [all] = rest.match(kTicks), names = [...all.matchAll(/"([^"]*)"/g)].map(([, name]) => `“${name}”`);
      take(`the tick${names.length > 1 ? "s" : ""} ${names.join(", ")}${all.endsWith(" ") ? " " : ""}`);
      at += all.length;
    } else if (/^veneerctl [a-z]/i.test(rest) && (at === 0 || !/[\w`“„]/.test(sentence[at - 1]))) {
      const place = placeOf(rest.slice("veneerctl ".length), kCommands);
      // What follows one that the page does not know belongs to it.
      const length = place ? "veneerctl ".length + place.length : rest.match(/^veneerctl (?:[a-z-]+ ?)*(?:--[^,;:.]*)?/i)[0].length;
      if (place) tell(place); else take(rest.slice(0, length));
      at += length;
    } else if (rest.startsWith(kOr)) {
      take("(or ");
      tell({text: `${t("screen.run")}: ${t("verdict.released")}`, href: "#run"});
      take(", when ");
      at += kOr.length;
    } else if (/^--[a-z]/.test(rest) && (at === 0 || /[\s(]/.test(sentence[at - 1]))) {
      const place = placeOf(rest, kOptions.filter(({of}) => !of || parts.some(({href}) => href === of))) || wayOf(field), [option] = rest.match(/^--[a-z-]+/);
      if (place) tell(place); else take(option);
      at += place ? place.length : option.length;
    } else if (field) {
      tell(wayOf(field));
      at += field.length;
    } else {
      const next = rest.slice(1).search(kNext);
      const length = next < 0 ? rest.length : next + 1;
      take(rest.slice(0, length));
      at += length;
    }
  }
  if (own) parts.push(own);
  return parts;
}
