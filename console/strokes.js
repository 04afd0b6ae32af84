// Strokes of a brush as lists of [x, y]. Pure.

function distance([x, y], [ax, ay], [bx, by]) {
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
