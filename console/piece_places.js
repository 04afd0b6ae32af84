// Where pieces of a plan lie on their panels, and whether two of them could lie there both. Rings of [x, y] in
// millimetres. Pure.
import {holds, middleOf} from "./outlines.js";

// How a piece came from the artwork to its panel: turned, then shifted.
function poseOf({artwork_outline_mm: from, panel_outline_mm: to}) {
  const away = ([x, y]) => Math.hypot(x - from[0][0], y - from[0][1]);
  const far = from.reduce((best, point, i) => (away(point) > away(from[best]) ? i : best), 0);
  const turn = (ring) => Math.atan2(ring[far][1] - ring[0][1], ring[far][0] - ring[0][0]);
  const angle = turn(to) - turn(from), [cos, sin] = [Math.cos(angle), Math.sin(angle)], [u, v] = from[0];
  return {cos, sin, x: to[0][0] - (cos * u - sin * v), y: to[0][1] - (sin * u + cos * v)};
}

const moved = ({cos, sin, x, y}, [u, v]) => [cos * u - sin * v + x, sin * u + cos * v + y];

// The ring of `piece` once it lies centred where the other one lay, turned like it; both have wood.
export function inPlaceOf(piece, other) {
  const pose = poseOf(other), [x, y] = moved(pose, middleOf(other.artwork_outline_mm)), [u, v] = middleOf(piece.artwork_outline_mm);
  return piece.artwork_outline_mm.map(([a, b]) => moved({...pose, x, y}, [a - u, b - v]));
}

export const boxOf = (ring) => [0, 1].map((i) => [Math.min(...ring.map((p) => p[i])), Math.max(...ring.map((p) => p[i]))]);

function away([x, y], [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay], long2 = dx * dx + dy * dy;
  const at = long2 ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / long2)) : 0;
  return Math.hypot(x - ax - at * dx, y - ay - at * dy);
}

const side = ([ax, ay], [bx, by], [x, y]) => Math.sign((bx - ax) * (y - ay) - (by - ay) * (x - ax));
const cross = (a, b, c, d) => side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;

export const apart = (a, b, gap) => a[0][0] - gap >= b[0][1] || b[0][0] - gap >= a[0][1] || a[1][0] - gap >= b[1][1] || b[1][0] - gap >= a[1][1];

// Whether the two overlap, or lie nearer to each other than `gap`.
export function tooNear(one, other, gap) {
  if (apart(boxOf(one), boxOf(other), gap)) return false;
  if (holds(one, ...other[0]) || holds(other, ...one[0])) return true;
  return one.some((p, i) => {
    const q = one[(i + 1) % one.length];
    return other.some((r, k) => {
      const s = other[(k + 1) % other.length];
      return cross(p, q, r, s) || away(p, r, s) < gap || away(q, r, s) < gap || away(r, p, q) < gap || away(s, p, q) < gap;
    });
  });
}
