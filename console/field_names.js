// What the cell calls its options and parameters (`--patch-mm`, `size_mm`), by the label of the field that says the same on the page.
// What no field of the page says is told in words.
import {t} from "./words.js";

// Of each the screens that have such a field, with its label; the first one counts where none of them is looked at.
const one = (screen, label) => [[screen, label]];
const picture = (label) => one("new", label);
const kFields = {
  size_mm: [["new", "picture.size"], ["settings", "pattern.size"]], patch_mm: picture("picture.patch"), layout: picture("picture.layout"), optimize: picture("picture.care"), refine: picture("picture.refine"),
  rematch: picture("more.rematch"), max_panels: picture("picture.panels"), panels: picture("more.panels"), remnants_first: picture("more.remnants"), triangles: picture("more.triangles"), marks: picture("more.marks"), alternatives: picture("picture.elsewhere"),
  wood: picture("picture.woods"), material: picture("picture.woods"), wood_limit: picture("limits"), material_limit: picture("limits"),
  crop: picture("picture.part"), segmentation: picture("picture.drawing.short"), importance: picture("matters"), large_edges: picture("edges"), fine_edges: picture("edges"), pinned_vertices: picture("lines"),
  cell_sizes: picture("sizes"), cell_aspect: picture("cells.shape"), flow_lines: picture("cells"), flow_lines_only: picture("cells.edges"),
  ...Object.fromEntries(["intensity", "edge", "colour", "texture", "hist", "range", "detail", "gamut", "grain"].map((weight) => [`w_${weight}`, picture(`w.${weight}`)])),
  speed_mm_s: one("settings", "recipe.speed_mm_s"), kerf_back_mm: one("settings", "recipe.kerf_back_mm"), kerf_show_mm: one("settings", "recipe.kerf_show_mm"),
  travel_x_mm: one("setup/devices", "choose.travel_x_mm"), travel_y_mm: one("setup/devices", "choose.travel_y_mm"),
  height_mm: one("setup/camera", "camera.blocks"), board_width_mm: one("setup/laser", "board.width"), board_height_mm: one("setup/laser", "board.height"),
  veneer_mm: one("panels", "say.veneer_mm"), substrate_mm: one("panels", "say.substrate_mm"), retag: one("scan", "scan.retag"),
};
const kUnsaid = ["min_width_mm", "min_size_mm", "edge_mm", "dpi"];  // of a plan, by veneerctl only
// Where the value is named behind the option, as in `--layout morph`.
const kChoices = {layout: {grid: "layout.grid", morph: "layout.morph", mosaic: "layout.mosaic", segmentation: "layout.segmentation"}, optimize: {greedy: "care.quick", global: "care.global"}, marks: {place: "marks.place", short: "marks.short"}};

const kOption = /^--([a-z][a-z0-9]*(?:-[a-z0-9]+)*)(?![\w-])/, kName = /^([a-z][a-z0-9]*(?:_[a-z0-9]+)+)(?!\w|[./-]\w)/i;
export const kNextName = "\\b[a-z][a-z0-9]*_[a-z]";  // where a parameter may begin

// What `text` begins with, as {length, screen: "" where no field says it, words: [...]}; null: nothing that the page knows.
export function fieldAt(text) {
  const found = text.match(kOption) || text.match(kName);
  if (!found) return null;
  const [all] = found, name = found[1].replace(/-/g, "_").replace(/^[A-Z]/, (letter) => letter.toLowerCase());
  if (kUnsaid.includes(name)) return {length: all.length, screen: "", words: [t(`unsaid.${name}`)]};
  if (!Object.hasOwn(kFields, name)) return null;
  const here = location.hash.slice(1), [screen, label] = kFields[name].find(([of]) => here.startsWith(of)) || kFields[name][0];
  const value = all.startsWith("--") && kChoices[name] && text.slice(all.length).match(/^ ([a-z]+)(?![\w-])/), choice = value && kChoices[name][value[1]];
  return {length: all.length + (choice ? value[0].length : 0), screen, words: [t(label), ...(choice ? [t(choice)] : [])]};
}
