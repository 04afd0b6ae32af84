// The part of a picture that is wanted, as a frame over it: its corners are dragged, by finger or with the arrows of a keyboard, and
// what is between them is moved.
import {h} from "./dom.js";
import {t} from "./words.js";

const kStep = .01;   // of the picture's sides, by an arrow
const kCorners = {upper_left: ["left", "top"], upper_right: ["right", "top"], lower_left: ["left", "bottom"], lower_right: ["right", "bottom"]};
const kWays = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

let hand = null;     // {part, from: [x, y]}: what a finger holds, as it was when it came down

const within = (value, least, most) => Math.min(most, Math.max(least, value));

// The sides of `part` ({left, top, right, bottom} from 0 to 1), of those of `corner`, moved so far, but no nearer to each other
// than `least`, and none beside the picture.
function pulled(part, least, corner, across, down) {
  const [side, end] = kCorners[corner], out = {...part};
  out[side] = side === "left" ? within(part.left + across, 0, Math.max(0, part.right - least)) : within(part.right + across, Math.min(1, part.left + least), 1);
  out[end] = end === "top" ? within(part.top + down, 0, Math.max(0, part.bottom - least)) : within(part.bottom + down, Math.min(1, part.top + least), 1);
  return out;
}

function moved(part, across, down) {
  const x = within(across, -part.left, 1 - part.right), y = within(down, -part.top, 1 - part.bottom);
  return {left: part.left + x, right: part.right + x, top: part.top + y, bottom: part.bottom + y};
}

// `act`: what becomes of the part when a finger has gone so far, in shares of the picture.
const holds = (part, act, take) => ({
  onpointerdown: (event) => {
    if (event.button !== 0 || !event.isPrimary) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    hand = {part, from: [event.clientX, event.clientY]};
  },
  onpointermove: (event) => {
    if (!hand || !event.isPrimary || !event.currentTarget.hasPointerCapture(event.pointerId)) return;
    const box = event.currentTarget.closest(".target-frame").getBoundingClientRect();
    take(act(hand.part, (event.clientX - hand.from[0]) / box.width, (event.clientY - hand.from[1]) / box.height));
  },
  onpointerup: (event) => { if (event.isPrimary) hand = null; },
  onpointercancel: (event) => { if (event.isPrimary) hand = null; },
});

// What lies over the picture, in a node of class target-frame. `take` gets the part that somebody wants, no side of it shorter
// than `least`.
export function cropFrame(part, least, take) {
  const handle = (corner) => {
    const [side, end] = kCorners[corner], act = (of, across, down) => pulled(of, least, corner, across, down);
    return h("button.crop-corner", {type: "button", id: `crop-${corner}`, "aria-label": t(`part.${corner}`), "aria-describedby": "crop-keys", lies: {left: part[side], top: part[end]}, ...holds(part, act, take),
      onkeydown: (event) => {
        const way = kWays[event.key];
        if (!way || event.ctrlKey || event.altKey || event.metaKey) return;
        event.preventDefault();  // nothing scrolls
        take(act(part, kStep * way[0], kStep * way[1]));
      }});
  };
  const whole = part.right - part.left >= 1 && part.bottom - part.top >= 1;  // then a finger on it scrolls the page
  return [h("span.unseen", {id: "crop-keys"}, t("part.keys")),
    h("div.crop-veil", {}, h("div.crop-part", {class: whole ? "" : "movable", lies: {left: part.left, top: part.top, width: part.right - part.left, height: part.bottom - part.top}, ...holds(part, moved, take)})),
    ...Object.keys(kCorners).map(handle)];
}
