// Strokes of a brush as lists of [x, y]. Pure.

// Of a point from a straight way.
export function distance([x, y], [ax, ay], [bx, by]) {
  const dx = bx - ax, dy = by - ay, length2 = dx * dx + dy * dy;
  const along = length2 > 0 ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length2)) : 0;
  return Math.hypot(x - ax - along * dx, y - ay - along * dy);
}

// With fewer points (Douglas and Peucker's): none of those left out lies farther than `tolerance` from what stays.
export function simplified(points, tolerance) {
  const stays = new Set([0, points.length - 1]), open = [[0, points.length - 1]];
  while (open.length) {
    const [from, to] = open.pop();
    let most = tolerance, farthest = 0;
    for (let i = from + 1; i < to; ++i) {
      const away = distance(points[i], points[from], points[to]);
      if (away > most) [most, farthest] = [away, i];
    }
    if (!farthest) continue;
    stays.add(farthest);
    open.push([from, farthest], [farthest, to]);
  }
  return points.filter((_, i) => stays.has(i));
}

// A stroke {give, width_mm, points_mm} as it is kept: with fewer points, and so much wider or narrower that nothing that
// was painted is left out of what is withheld, and nothing beside it is given.
export function kept({give, width_mm: width, points_mm: points}) {
  const tolerance = .05 + width / 100, allowance = give ? -2 * tolerance : 2 * tolerance;
  return {give, width_mm: Math.round((width + allowance) * 1000) / 1000, points_mm: simplified(points, tolerance)};
}

// As edits, of at most `most` points each: runs of strokes that are alike, in their order, since of two that meet the
// later one counts. -> [{give, width_mm, strokes, ended}]; `ended`: so many strokes end in it. One that is longer goes on
// in the next edit, from the point where it was parted.
export function edits(strokes, most) {
  const out = [];
  let room = 0;
  const begin = ({give, width_mm}) => { out.push({give, width_mm, strokes: [], ended: 0}); room = most; };
  for (const stroke of strokes) {
    const {give, width_mm, points_mm: points} = stroke, last = out[out.length - 1];
    if (!last || last.give !== give || last.width_mm !== width_mm || room < Math.min(points.length, most)) begin(stroke);
    for (let at = 0; ; ) {
      const part = points.slice(at, at + room);
      out[out.length - 1].strokes.push(part);
      room -= part.length;
      at += part.length;
      if (at >= points.length) break;
      --at;
      begin(stroke);
    }
    ++out[out.length - 1].ended;
  }
  return out;
}
