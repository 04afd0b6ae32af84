#include "daemon/orders/sketch_work.h"

#include "base/base64.h"
#include "daemon/orders/artwork_file.h"
#include "daemon/orders/artwork_guides.h"
#include "daemon/orders/kept_wood.h"
#include "daemon/orders/wood_options.h"
#include "planner/pictures/jpeg_codec.h"
#include "planner/suggest/contact_sheet.h"
#include "planner/suggest/picture_sketch.h"

namespace veneer::daemon {
namespace {

constexpr int kSketchQuality = 85;

}  // namespace

Result<SketchDrawn> draw_sketch(const DrawSketch& order, const std::filesystem::path&, const TaskProgress&) {
  auto artwork = read_artwork({order.picture}, order.name, order.crop, order.size);
  if (!artwork) return artwork.error();
  const Status guided = order.fine ? guide(order, *artwork) : weigh(order.importance, *artwork);
  if (!guided) return guided.error();
  const auto stock = load_job_wood(order.wood, artwork->width * artwork->height, kept_wood(order.kept_dir));
  if (!stock) return stock.error();
  auto options = wood_options(order.options, order.wood, *stock, order.kerf, order.recipes);
  if (!options) return options.error();
  options->threads = 1;  // somebody else may be planning
  const auto effort = order.fine ? planner::GridEffort::kFine : planner::GridEffort::kCoarse;
  const auto sketch = planner::sketch_picture(*artwork, *stock, *options, effort);
  if (!sketch) return sketch.error();
  SketchDrawn out;
  out.layout = planner::layout_text(sketch->layout);
  out.width_mm = artwork->width.count(), out.height_mm = artwork->height.count(), out.patch_mm = sketch->patch.count();
  out.pieces = sketch->plan.pieces.size(), out.unfilled = planner::unfilled(sketch->plan);
  out.likeness = sketch->likeness;
  if (sketch->cutting) out.cutting_s = sketch->cutting->count();
  out.remarks = sketch->remarks;
  out.preview = base64(planner::encode_jpeg(sketch->preview, kSketchQuality).value_or(""));
  return out;
}

}  // namespace veneer::daemon
