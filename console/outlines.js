// Outlines of pieces as rings of [x, y] in millimetres. Pure.

// Whether the ring holds the point; both in one frame.
export function holds(ring, x, y) {
  let inside = false;
  ring.forEach(([ax, ay], i) => {
    const [bx, by] = ring[(i + 1) % ring.length];
    if ((ay > y) !== (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)) inside = !inside;
  });
  return inside;
}

// Of its upright box.
export const middleOf = (ring) => [0, 1].map((i) => (Math.min(...ring.map((p) => p[i])) + Math.max(...ring.map((p) => p[i]))) / 2);

// The nearest of the pieces of an artwork that way; one aside is as far as one twice as far ahead.
export function nextTo(pieces, from, across, down) {
  const [x, y] = middleOf(from.artwork_outline_mm);
  let best = null, nearest = Infinity;
  for (const piece of pieces) {
    const [to, up] = middleOf(piece.artwork_outline_mm);
    const ahead = (to - x) * across - (up - y) * down, aside = Math.abs((to - x) * down + (up - y) * across);
    if (piece === from || ahead <= aside / 2 || ahead + 2 * aside >= nearest) continue;
    best = piece;
    nearest = ahead + 2 * aside;
  }
  return best;
}

// Half the side of the largest upright square about the point that no side of the ring crosses. On a side max(|x|, |y|)
// is least at an end, or where x or y is 0, or where both are as large.
function roomAt(ring, x, y) {
  let room = Infinity;
  ring.forEach(([cx, cy], i) => {
    const [ex, ey] = ring[(i + 1) % ring.length], [ax, ay, dx, dy] = [cx - x, cy - y, ex - cx, ey - cy];
    for (const along of [0, 1, -ax / dx, -ay / dy, (ax - ay) / (dy - dx), -(ax + ay) / (dx + dy)])
      if (along >= 0 && along <= 1) room = Math.min(room, Math.max(Math.abs(ax + along * dx), Math.abs(ay + along * dy)));
  });
  return room;
}

// The largest upright square that lies in the ring whole, within a tenth: {x, y, half}, its middle and half its side;
// null where there is none. Fields that cannot hold a larger one are left out, others are parted in four (a point that
// lies d further has d more room at most).
export function heartOf(ring) {
  if (ring.length < 3) return null;
  const [xs, ys] = [0, 1].map((i) => ring.map((p) => p[i]));
  const left = Math.min(...xs), low = Math.min(...ys), width = Math.max(...xs) - left, height = Math.max(...ys) - low;
  const wide = Math.min(width, height) / 2;
  let best = null;
  const open = [];
  const look = (x, y, reach) => {
    const room = roomAt(ring, x, y), inside = holds(ring, x, y);
    if (inside && room > (best ? best.half : 0)) best = {x, y, half: room};
    open.push({x, y, reach, most: (inside ? room : -room) + reach});
  };
  if (!(wide > 0)) return null;
  for (let x = left + wide; x < left + width + wide; x += 2 * wide) for (let y = low + wide; y < low + height + wide; y += 2 * wide) look(x, y, wide);
  for (let steps = 0; open.length && steps < 2000; ++steps) {
    const {x, y, reach, most} = open.splice(open.reduce((at, one, i) => (one.most > open[at].most ? i : at), 0), 1)[0];
    if (most <= (best ? 1.1 * best.half : wide / 100)) break;
    const half = reach / 2;
    for (const i of [-1, 1]) for (const j of [-1, 1]) look(x + i * half, y + j * half, half);
  }
  return best;
}
