// A panel's scan in tiles, over its small picture: what is looked at is fetched, as fine as the screen shows it, and
// nothing else of a scan that may have two hundred million pixels.
import {get} from "./link.js";
import {dropUnwanted, pictureUrl} from "./pictures.js";

const kAtOnce = 2, kFineEnough = .75;  // pixels of a tile for one of the screen

// In `pane` of the Leaflet map; where the screen shows less than `coarse` pixels a millimetre, the small picture under
// it will do. -> {renew(), close()}
export function tilesOver(L, map, panel, pane, coarse) {
  const path = `/panels/${encodeURIComponent(panel.id)}`;
  let tiles = null, asked = false, closed = false, fetching = 0, scan = 0;
  let wanted = new Map();   // what the view shows, the nearest to its middle first: key -> tile
  const shown = new Map();  // key -> overlay

  const drop = (key) => { shown.get(key).remove(); shown.delete(key); };
  const boxOf = ({side, column, row}) => {
    const top = tiles.levels[0].height_px / tiles.px_per_mm - row * side, left = column * side;
    return [[top - side, left], [top, left + side]];
  };
  // Beyond the panel's edges a tile goes on with its last pixels.
  const cutOff = ({level, column, row}) => {
    const beyond = (size, place) => Math.max(0, 100 * (1 - (size / tiles.tile_px - place)));
    const {width_px: wide, height_px: high} = tiles.levels[level];
    return `inset(0 ${beyond(wide, column)}% ${beyond(high, row)}% 0)`;
  };

  // The coarsest level that is fine enough.
  function levelNow() {
    const needed = 2 ** map.getZoom() * window.devicePixelRatio;
    if (needed <= coarse) return null;
    const level = Math.floor(Math.log2(tiles.px_per_mm / (kFineEnough * needed)));
    return Math.min(tiles.levels.length - 1, Math.max(0, level));
  }

  function lookedAt() {
    const level = levelNow(), found = [];
    if (level === null) return new Map();
    const side = tiles.tile_px * 2 ** level / tiles.px_per_mm;  // mm
    const top = tiles.levels[0].height_px / tiles.px_per_mm, view = map.getBounds(), middle = map.getCenter();
    const last = (size) => Math.ceil(size / tiles.tile_px) - 1;
    const from = (mm) => Math.max(0, Math.floor(mm / side)), to = (mm, most) => Math.min(most, Math.floor(mm / side));
    const right = to(view.getEast(), last(tiles.levels[level].width_px));
    const below = to(top - view.getSouth(), last(tiles.levels[level].height_px));
    for (let row = from(top - view.getNorth()); row <= below; ++row)
      for (let column = from(view.getWest()); column <= right; ++column)
        found.push({level, column, row, side, far: Math.hypot((column + .5) * side - middle.lng, top - (row + .5) * side - middle.lat)});
    found.sort((a, b) => a.far - b.far);
    return new Map(found.map((tile) => [`${tile.level}/${tile.column}/${tile.row}`, tile]));
  }

  // A level stays until the next one is there whole.
  function dropOthers() {
    if ([...wanted.keys()].every((key) => shown.has(key))) for (const key of [...shown.keys()]) if (!wanted.has(key)) drop(key);
  }

  async function fetchNext() {
    const next = [...wanted.entries()].find(([key, tile]) => !shown.has(key) && !tile.asked);
    if (!next || fetching >= kAtOnce || closed) return;
    const [key, tile] = next, of = tiles;
    tile.asked = true;
    ++fetching;
    fetchNext();
    const url = await pictureUrl(`${path}/map-tile.jpg?level=${tile.level}&column=${tile.column}&row=${tile.row}`, () => !closed && map.getContainer().isConnected && of === tiles && wanted.get(key) === tile);
    --fetching;
    if (url && !closed && of === tiles && wanted.get(key) === tile) {
      const overlay = L.imageOverlay(url, boxOf(tile), {pane});
      overlay.on("load error", () => URL.revokeObjectURL(url));
      shown.set(key, overlay.addTo(map));
      overlay.getElement().style.clipPath = cutOff(tile);
    } else if (url) {
      URL.revokeObjectURL(url);
    }
    // Once more when the view moves; where it has moved away meanwhile, on with what is seen now.
    if (!url) tile.asked = false;
    if (!url && wanted.get(key) === tile) return;
    dropOthers();
    fetchNext();
  }

  async function look() {
    if (closed) return;
    if (!tiles) {
      if (asked || 2 ** map.getZoom() * window.devicePixelRatio <= coarse) return;
      asked = true;
      const mine = scan, told = await get(`${path}/map-tiles`).catch(() => null);
      asked = false;
      if (closed) return;
      if (mine !== scan) return look();
      if (!told) return;  // asked again when the view moves
      tiles = told;
    }
    const before = wanted;
    wanted = lookedAt();
    for (const [key, tile] of before) if (wanted.has(key)) wanted.set(key, tile);
    dropUnwanted();
    dropOthers();
    fetchNext();
  }
  map.on("moveend", look);
  look();
  return {
    renew() {
      ++scan;
      tiles = null;
      wanted = new Map();
      for (const key of [...shown.keys()]) drop(key);
      look();
    },
    close() { closed = true; },
  };
}
