// The page: which screen is shown, and when it is drawn again.
import {h, put} from "./dom.js";
import {t} from "./words.js";
import {enter} from "./link.js";
import {begin, changed, follow, model} from "./model.js";
import {loadPictures, nextScreen} from "./pictures.js";
import {showRefusal} from "./commands.js";
import {showAge, showFrame} from "./frame.js";
import * as cell from "./screens/cell.js";
import * as panels from "./screens/panels.js";
import * as newPicture from "./screens/new_picture.js";
import * as run from "./screens/run.js";
import * as assembly from "./screens/assembly.js";
import * as scan from "./screens/scan.js";
import * as history from "./screens/history.js";
import * as log from "./screens/log.js";
import * as account from "./screens/account.js";
import * as setup from "./screens/setup.js";
import * as calibration from "./screens/calibration.js";
import * as settings from "./screens/settings.js";
import * as alarms from "./screens/alarms.js";

// A screen has draw(rest of the address) -> nodes, and perhaps enter(rest) for when it is gone to, drawn(place) for
// what has to be drawn once its nodes are there.
const kScreens = [
  {id: "cell", ...cell}, {id: "setup", ...setup}, {id: "panels", ...panels}, {id: "scan", ...scan}, {id: "new", ...newPicture},
  {id: "run", ...run}, {id: "assembly", ...assembly}, {id: "alarms", ...alarms}, {id: "history", ...history},
  {id: "calibration", ...calibration}, {id: "settings", ...settings}, {id: "log", ...log}, {id: "account", ...account},
];
const screens = () => (model.role === "nobody" ? kScreens.slice(-1) : kScreens);
const place = document.getElementById("main");
let shown = "";

function address() {
  const [id, ...rest] = decodeURIComponent(location.hash.slice(1)).split("/");
  const screen = screens().find((one) => one.id === id) || screens().find((one) => one.id === first) || screens()[0];
  return {screen, rest};
}

// Where somebody comes in who asked for no screen: at a cell that has never cut, where it is set up.
let first = "cell";
function welcome() {
  const {cell} = model;
  if (cell && cell.panels === 0 && cell.next_step && cell.next_step.step.startsWith("calibrate")) first = "setup";
}

function draw() {
  const {screen, rest} = address();
  showFrame(screens(), screen.id);
  place.className = `screen-${screen.id}`;
  put(place, h("h1.unseen", {}, t(`screen.${screen.id}`)), ...[screen.draw(...rest)].flat());
  loadPictures(place);
  if (screen.drawn) screen.drawn(place, ...rest);
}

function go() {
  const {screen, rest} = address();
  const here = [screen.id, ...rest].join("/");
  if (here === shown) return;
  const first = shown === "";
  shown = here;
  showRefusal("");
  place.replaceChildren();
  nextScreen();
  if (screen.enter) screen.enter(...rest);
  draw();
  const tab = document.querySelector("#nav [aria-current]");
  if (tab) tab.scrollIntoView({block: "nearest", inline: "center"});
  if (!first) { place.focus({preventScroll: true}); scrollTo(0, 0); }
}

addEventListener("hashchange", go);
follow(() => { if (shown) draw(); });
enter().catch((fault) => showRefusal(fault.message)).then(begin).then(welcome).then(go);
setInterval(() => { showAge(); if (model.cell) changed(); }, 500);
