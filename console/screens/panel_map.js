// A panel's map: its scan, and over it what is booked in its wood, its tags and its strips. Millimetres of the panel are
// the map's coordinates (CRS.Simple), so that nothing is projected. The scan comes small, and in tiles over that where
// somebody looks closer.
import {h} from "../dom.js";
import {t} from "../words.js";
import {pictureUrl} from "../pictures.js";
import {brushKey} from "../brush_keys.js";
import {tilesOver} from "../map_tiles.js";
import {fiducialWords} from "./fiducial_words.js";
import {hiddenLayers, isShown, kLayers} from "./panel_layers.js";

const kFirstWidth = 1600;  // px, of the scan
const kStates = {  // what a state is drawn as, and on which layer
  leased: ["reserved", {color: "#0072b2", dashArray: "4 4", fillOpacity: .12}],
  reserved: ["reserved", {color: "#0072b2", fillOpacity: .25}],
  cutting: ["suspect", {color: "#e69f00", fillOpacity: .7}],
  cut: ["cut", {color: "#15181a", fillColor: "#ffffff", fillOpacity: .85, weight: 1}],
  suspect: ["suspect", {color: "#15181a", fillColor: "#e69f00", fillOpacity: .75, weight: 2}],
  scrap: ["scrap", {color: "#15181a", fillColor: "#5a6064", fillOpacity: .8, weight: 1}],
};

const at = ([x, y]) => [y, x];  // Leaflet's latitude is our y
const words = (text) => h("span", {}, text);  // Leaflet takes a string for HTML, and a wood's name is what somebody typed
let leaflet = null, sheet = null;

async function library() {
  if (leaflet) return leaflet;
  if (!sheet) {
    sheet = h("link", {rel: "stylesheet", href: "/console/lib/leaflet.css"});
    document.head.append(sheet);
  }
  leaflet = await import("/console/lib/leaflet.js");
  return leaflet;
}

// Shows the panel in `place`, which is the map's own from then on. `onPiece` is told of a tap. -> {show(allocations),
// choose(piece), layer(name, shown), fiducials(list), zones(zones), zone(number), renewFree(), renewScan(), brush(how), strokes(list),
// outline(how), corners(list), close()}
export async function openMap(place, panel, onPiece) {
  const L = await library();
  place.setAttribute("role", "application");  // its keys are its own
  place.setAttribute("aria-label", t("panel.map", {panel: panel.id}));
  const box = [[0, 0], [panel.height_mm, panel.width_mm]];
  const map = L.map(place, {crs: L.CRS.Simple, minZoom: -4, maxZoom: 6, zoomSnap: .25, attributionControl: false, maxBoundsViscosity: .8, preferCanvas: true});
  map.setMaxBounds(L.latLngBounds(box).pad(.5));
  map.fitBounds(box);
  ["scan", "tiles"].forEach((name, i) => { map.createPane(name).style.zIndex = 200 + i; });  // below what is drawn over them
  const layers = Object.fromEntries(kLayers.map((name) => [name, L.layerGroup()]));
  for (const name of kLayers) if (isShown(name)) layers[name].addTo(map);

  const id = encodeURIComponent(panel.id);
  let scan = null, closed = false;
  const isSeen = () => !closed && place.isConnected;  // whoever goes to another screen closes nothing
  const urls = new Set();  // of pictures that the map has not read yet
  const drop = (url) => { URL.revokeObjectURL(url); urls.delete(url); };
  const overlay = (url, where, more) => {
    urls.add(url);
    return L.imageOverlay(url, where, more).on("load error", () => drop(url));
  };
  let laid = 0;
  const lay = async () => {
    const mine = ++laid;
    const url = await pictureUrl(`/panels/${id}/map.jpg?width=${kFirstWidth}`, () => isSeen() && mine === laid);
    if (closed || !url || mine !== laid) return drop(url);
    const before = scan;
    scan = overlay(url, box, {alt: t("panel.map", {panel: panel.id}), pane: "scan"}).addTo(map);
    if (before) before.remove();
  };
  lay();
  const tiles = tilesOver(L, map, panel, "tiles", kFirstWidth / panel.width_mm);
  let freeOf = 0;  // raised when what is free has changed: what was asked before is old
  const freeWood = async () => {
    const mine = freeOf;
    const url = layers.free.getLayers().length ? "" : await pictureUrl(`/panels/${id}/stock.jpg?width=${kFirstWidth}`, () => isSeen() && mine === freeOf);
    if (!url || mine !== freeOf) return drop(url);
    // Its key stands below the panel: as wide as that it is, and higher.
    const picture = new Image();
    picture.src = url;
    await picture.decode().catch(() => {});
    if (closed || mine !== freeOf || !picture.naturalWidth || layers.free.getLayers().length) return drop(url);
    const high = picture.naturalHeight * panel.width_mm / picture.naturalWidth;
    layers.free.addLayer(overlay(url, [[panel.height_mm - high, 0], box[1]]));
  };
  layers.free.on("add", freeWood);
  if (isShown("free")) freeWood();

  // One that lies too far off has a label that stays, so that nobody has to look for it.
  let fiducialsOf = "";
  function drawFiducials(list) {
    if (fiducialsOf === JSON.stringify(list)) return;  // or what somebody reads would go and come
    fiducialsOf = JSON.stringify(list);
    layers.fiducials.clearLayers();
    for (const fiducial of list) {
      const look = fiducial.over_limit ? {color: "#b00000", weight: 6} : {color: "#005f46", weight: 3};
      const marker = fiducial.kind === "tag" && fiducial.corners_mm.length === 4
          ? L.polygon(fiducial.corners_mm.map(at), {...look, fillOpacity: .1, dashArray: fiducial.face === "back" ? "3 5" : null})
          : L.circleMarker(at(fiducial.centre_mm), {...look, radius: 6, fillOpacity: 0});
      layers.fiducials.addLayer(marker.bindTooltip(words(fiducialWords(fiducial))));
      if (fiducial.over_limit)
        layers.fiducials.addLayer(L.tooltip({permanent: true, direction: "auto", offset: [8, 0], className: "over-limit"}).setLatLng(at(fiducial.centre_mm)).setContent(words(`▲ ${fiducial.tag_id ?? "○"}: ${fiducial.off_mm.toFixed(2)} mm`)));
    }
  }
  drawFiducials(panel.fiducials || []);
  let strips = [], strip = null;  // strip: the one that is shown
  const outlineOf = (zone) => L.polygon(zone.shape_mm.map((ring) => ring.map(at)), {color: "#5a2ca0", weight: 2, fillOpacity: .05});

  // What a brush draws, [{give, width_mm, points_mm}], as wide as it is on the wood. What is given back has a dashed
  // line in its middle: not by colour alone.
  const strokeLayer = L.layerGroup().addTo(map);
  const weightOf = (width) => Math.max(2, width * 2 ** map.getZoom());
  function drawStroke({give, width_mm: width, points_mm: points}) {
    const [x, y] = points[0];
    const path = points.length > 1 ? points : [[x, y], [x + .01, y]];
    const line = L.polyline(path.map(at), {color: give ? "#005f94" : "#b00000", opacity: .6, weight: weightOf(width), lineCap: "round", lineJoin: "round", smoothFactor: 0, interactive: false});
    line.width_ = width;
    const middle = give && L.polyline(path.map(at), {color: "#ffffff", weight: 2, dashArray: "6 6", smoothFactor: 0, interactive: false});
    return strokeLayer.addLayer(L.layerGroup(give ? [line, middle] : [line]));
  }
  map.on("zoomend", () => strokeLayer.eachLayer((stroke) => stroke.eachLayer((line) => { if (line.width_) line.setStyle({weight: weightOf(line.width_)}); })));
  let crosshair = null;
  const markCross = (point) => {
    if (crosshair && !point) { crosshair.remove(); crosshair = null; }
    if (!point) return;
    if (!crosshair) crosshair = L.marker(at(point), {icon: L.divIcon({className: "crosshair", iconSize: [48, 48]}), interactive: false, keyboard: false}).addTo(map);
    crosshair.setLatLng(at(point));
    map.panInside(at(point), {padding: [48, 48], animate: false});
  };
  const hand = brushHand(place, map, {wide: panel.width_mm, high: panel.height_mm, markCross}, drawStroke, () => { const lines = strokeLayer.getLayers(); if (lines.length) strokeLayer.removeLayer(lines[lines.length - 1]); });

  // The outline that somebody draws, corner by corner; the last one is the largest.
  const outlineLayer = L.layerGroup().addTo(map);
  function drawCorners(corners) {
    outlineLayer.clearLayers();
    if (!corners.length) return;
    const line = corners.map(at), look = {color: "#5a2ca0", weight: 4, dashArray: "8 6", interactive: false};
    outlineLayer.addLayer(corners.length > 2 ? L.polygon(line, {...look, fillOpacity: .15}) : L.polyline(line, look));
    line.forEach((corner, n) => outlineLayer.addLayer(L.circleMarker(corner, {radius: n + 1 === line.length ? 9 : 5, color: "#ffffff", weight: 2, fillColor: "#5a2ca0", fillOpacity: 1, interactive: false})));
  }
  const outlining = cornerHand(place, map, {wide: panel.width_mm, high: panel.height_mm, markCross});

  const drawn = new Map();  // polygons by piece
  let chosen = null;
  return {
    show(allocations) {
      for (const polygon of drawn.values()) polygon.remove();
      drawn.clear();
      for (const name of ["reserved", "cut", "suspect", "scrap"]) layers[name].clearLayers();
      allocations.forEach((one, number) => {
        if (!kStates[one.state]) return;  // given back
        const [layer, look] = kStates[one.state];
        const rings = one.outline_mm && one.outline_mm.length > 2 ? [one.outline_mm.map(at)] : (one.allocation_mm || []).map((ring) => ring.map(at));
        const polygon = L.polygon(rings, {weight: 2, ...look}).bindTooltip(words([one.mark, t(`state.${one.state}`)].filter(Boolean).join(", ")));
        polygon.on("click", () => { if (!hand.paints() && !outlining.draws()) onPiece(one); });
        drawn.set(one.piece || `none-${number}`, polygon);
        layers[layer].addLayer(polygon);
        polygon.usual_ = {weight: 2, ...look};
      });
    },
    choose(piece) {
      if (chosen && drawn.has(chosen)) drawn.get(chosen).setStyle(drawn.get(chosen).usual_);
      chosen = piece;
      const polygon = drawn.get(piece);
      if (!polygon) return;
      polygon.setStyle({color: "#c00000", weight: 5}).bringToFront();
      if (!map.getBounds().contains(polygon.getBounds())) map.panTo(polygon.getBounds().getCenter());
    },
    layer(name, shown) {
      if (shown) hiddenLayers.delete(name); else hiddenLayers.add(name);
      if (shown) layers[name].addTo(map); else layers[name].remove();
    },
    fiducials: drawFiducials,
    zones(zones) {
      strips = zones.filter((zone) => Array.isArray(zone.shape_mm) && zone.shape_mm.length > 0);
      layers.zones.clearLayers();
      for (const zone of strips) layers.zones.addLayer(outlineOf(zone).bindTooltip(words(`${zone.zone}: ${zone.material || t("panel.unnamed")}`)));
    },
    // By its number; 0 = none.
    zone(number) {
      if (strip) strip.remove();
      const zone = strips.find((one) => one.zone === number);
      strip = zone ? outlineOf(zone).setStyle({weight: 7, interactive: false}).addTo(map) : null;
    },
    renewFree() { ++freeOf; layers.free.clearLayers(); if (isShown("free")) freeWood(); },
    renewScan() { lay(); tiles.renew(); },
    brush: hand.take,
    outline: outlining.take,
    corners: drawCorners,
    strokes(list) { strokeLayer.clearLayers(); list.forEach(drawStroke); },
    close() { closed = true; tiles.close(); map.remove(); urls.forEach(drop); },
  };
}

// One finger, pen or mouse draws while a brush is in hand; two fingers move and zoom the map as ever, and what the first
// of them had begun is dropped. By keyboard a crosshair draws (brush_keys.js), with Shift one stroke until it is let go.
// -> {take(how), paints()}; how: {give, width_mm, room, onStroke, onCross} or null. onStroke is given the stroke, and draws
// it; onCross where the crosshair stands.
function brushHand(place, map, {wide, high, markCross}, drawStroke, dropStroke) {
  const kStep = 1 / 6;         // of its width, between two points
  const kLongestPath = 4000;  // points, before it is simplified
  let how = null, begunWith = null, stroke = null, pointer = 0;
  const fingers = new Set();
  const placeOf = (event) => { const {lat, lng} = map.mouseEventToLatLng(event); return [Math.round(lng * 100) / 100, Math.round(lat * 100) / 100]; };

  function drop() {
    if (stroke) dropStroke();
    stroke = null;
  }
  place.addEventListener("pointerdown", (event) => {
    if (event.isPrimary) fingers.clear();  // one that was lifted beside the map
    fingers.add(event.pointerId);
    if (!how || event.target.closest(".leaflet-control") || event.button !== 0) return;
    if (fingers.size > 1) return drop();
    if (how.room < 1) return;
    finish();
    if (!how) return;
    cross = null;
    markCross(null);
    pointer = event.pointerId;
    begunWith = how;
    place.setPointerCapture(pointer);
    stroke = {give: how.give, width_mm: how.width_mm, points_mm: [placeOf(event)]};
    drawStroke(stroke);
  });
  place.addEventListener("pointermove", (event) => {
    if (!stroke || event.pointerId !== pointer) return;
    const [x, y] = placeOf(event), [fromX, fromY] = stroke.points_mm[stroke.points_mm.length - 1];
    if (Math.hypot(x - fromX, y - fromY) < Math.max(.3, how.width_mm * kStep)) return;
    stroke.points_mm.push([x, y]);
    dropStroke();
    if (stroke.points_mm.length >= kLongestPath) {  // it goes on as another one, where there is room for more
      const full = stroke;
      stroke = null;
      begunWith.onStroke(full);
      if (!how || how.room < 1) return;
      begunWith = how;
      stroke = {give: how.give, width_mm: how.width_mm, points_mm: [[x, y]]};
    }
    drawStroke(stroke);
  });
  const end = (event) => {
    fingers.delete(event.pointerId);
    if (!stroke || event.pointerId !== pointer) return;
    const done = stroke, last = placeOf(event);
    stroke = null;
    dropStroke();
    if (event.type === "pointercancel") return;
    if (String(last) !== String(done.points_mm[done.points_mm.length - 1])) done.points_mm.push(last);
    begunWith.onStroke(done);
  };
  place.addEventListener("pointerup", end);
  place.addEventListener("pointercancel", end);

  const kKeys = -1;  // the pointer that a keyboard's stroke has
  let cross = null;
  const finish = () => {
    if (!stroke || pointer !== kKeys) return;
    const done = stroke;
    stroke = null;
    dropStroke();
    begunWith.onStroke(done);
  };
  place.addEventListener("keydown", (event) => {
    const key = how && event.target === place && !(stroke && pointer !== kKeys) ? brushKey(event) : null;
    if (!key) return;
    const {lat, lng} = map.getCenter(), step = Math.max(.5, how.width_mm / 2);
    const from = cross || [lng, lat].map((mm) => Math.round(mm * 100) / 100);
    cross = [from[0] + key.across * step, from[1] - key.down * step].map((mm, i) => Math.min(i ? high : wide, Math.max(0, mm)));
    markCross(cross);
    if (!key.paints || !event.shiftKey) finish();
    if (!how) return;
    how.onCross(cross);
    if (!key.paints || how.room < 1) return;
    if (stroke) {
      dropStroke();
    } else {
      pointer = kKeys;
      begunWith = how;
      stroke = {give: how.give, width_mm: how.width_mm, points_mm: [from]};
    }
    if (String(cross) !== String(stroke.points_mm[stroke.points_mm.length - 1]) && stroke.points_mm.length < kLongestPath) stroke.points_mm.push(cross);
    drawStroke(stroke);
    if (!event.shiftKey) finish();
  });
  place.addEventListener("keyup", (event) => { if (event.key === "Shift") finish(); });
  place.addEventListener("blur", () => { finish(); cross = null; markCross(null); });

  return {
    paints: () => how !== null,
    take(wanted) {
      if (Boolean(how) !== Boolean(wanted)) {
        for (const part of ["dragging", "boxZoom", "doubleClickZoom", "keyboard"]) if (map[part]) map[part][wanted ? "disable" : "enable"]();
        place.classList.toggle("painting", Boolean(wanted));
        if (wanted) place.setAttribute("aria-describedby", "brush-keys"); else place.removeAttribute("aria-describedby");
      }
      if (!wanted) { drop(); cross = null; markCross(null); }
      how = wanted;
    },
  };
}

// Taps set corners while an outline is drawn, and a finger that goes on moves the map as ever; a tap beside the panel is one on its edge.
// By keyboard a crosshair does it: arrows move it, with Shift in small steps, Space sets a corner, Delete takes the last one back,
// Escape ends it. -> {take(how), draws()}; how: {onCorner, onBack, onCross, onAway} or null. onCorner is given a place and
// how far from the last one, in mm, it has to lie, onCross where the crosshair stands.
function cornerHand(place, map, {wide, high, markCross}) {
  const kStepMm = 5, kSmallStepMm = .5, kSameTapPx = 6;
  let how = null, cross = null;
  const within = (point) => point.map((mm, i) => Math.round(100 * Math.min(i ? high : wide, Math.max(0, mm))) / 100);
  const mmOf = (px) => map.containerPointToLatLng([px, 0]).lng - map.containerPointToLatLng([0, 0]).lng;
  const away = () => { cross = null; markCross(null); };

  map.on("click", ({latlng: {lat, lng}}) => {
    if (!how) return;
    away();
    how.onCorner(within([lng, lat]), mmOf(kSameTapPx));
  });
  place.addEventListener("keydown", (event) => {
    if (!how || event.target !== place) return;
    if (event.key === "Escape") { event.preventDefault(); how.onAway(); return; }
    if (["Delete", "Backspace"].includes(event.key)) { event.preventDefault(); how.onBack(); return; }
    const key = brushKey(event);
    if (!key) return;
    const {lat, lng} = map.getCenter(), step = event.shiftKey ? kSmallStepMm : kStepMm, [x, y] = cross || [lng, lat];
    cross = within([x + key.across * step, y - key.down * step]);
    markCross(cross);
    if (event.key === " ") how.onCorner(cross, 0); else how.onCross(cross);
  });
  place.addEventListener("blur", () => { if (how) away(); });

  return {
    draws: () => how !== null,
    take(wanted) {
      if (Boolean(how) !== Boolean(wanted)) {
        for (const part of ["boxZoom", "doubleClickZoom", "keyboard"]) if (map[part]) map[part][wanted ? "disable" : "enable"]();
        place.classList.toggle("outlining", Boolean(wanted));
        if (wanted) place.setAttribute("aria-describedby", "outline-keys"); else place.removeAttribute("aria-describedby");
        away();
      }
      how = wanted;
    },
  };
}
