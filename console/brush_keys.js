// A brush in the hand of a keyboard. -> {across, down: -1, 0 or 1, paints: whether it paints on its way}, or null for any
// other key: arrows move its crosshair, with Shift they paint as well, and Space paints where it stands.
const kWays = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1], " ": [0, 0]};

export function brushKey(event) {
  const way = kWays[event.key];
  if (!way || event.ctrlKey || event.altKey || event.metaKey) return null;
  event.preventDefault();  // nothing scrolls, and no map moves
  return {across: way[0], down: way[1], paints: event.shiftKey || event.key === " "};
}
