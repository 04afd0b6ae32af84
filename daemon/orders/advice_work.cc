#include "daemon/orders/advice_work.h"

#include <string_view>

#include "base/base64.h"
#include "daemon/orders/artwork_file.h"
#include "daemon/orders/artwork_guides.h"
#include "daemon/orders/wood_options.h"
#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/resample.h"
#include "planner/suggest/contact_sheet.h"
#include "planner/suggest/crops.h"
#include "planner/suggest/suggestions.h"

namespace veneer::daemon {
namespace {

constexpr int kAdviceSide = 280;  // pixels of a preview's longer side
constexpr int kAdviceQuality = 82;

std::string preview_text(const cv::Mat& preview) {
  const double scale = static_cast<double>(kAdviceSide) / std::max(preview.cols, preview.rows);
  const auto small =
      planner::stretch(preview, std::max(1, cvRound(preview.cols * scale)), std::max(1, cvRound(preview.rows * scale)));
  return base64(planner::encode_jpeg(small, kAdviceQuality).value_or(""));
}

AdvisedPicture advised(const planner::Suggestion& it, const GiveAdvice& order, const cv::Size& whole) {
  AdvisedPicture out;
  out.crop = !order.crop.empty() ? order.crop : it.crop.size() == whole ? "" : planner::crop_text(it.crop);
  out.layout = planner::layout_text(it.layout);
  out.size_mm = std::min(it.width, it.height).count();
  out.width_mm = it.width.count(), out.height_mm = it.height.count(), out.patch_mm = it.patch.count();
  out.pieces = it.pieces, out.unfilled = it.unfilled;
  out.likeness = it.likeness, out.cutting_s = it.cutting.count();
  out.preview = preview_text(it.preview);
  return out;
}

}  // namespace

Result<AdviceGiven> give_advice(const GiveAdvice& order, const std::filesystem::path&, const TaskProgress& progress) {
  auto read = read_artwork({order.picture}, order.name, order.crop, order.size);
  if (!read) return read.error();
  planner::Artwork artwork = std::move(*read);
  if (const Status weighed = weigh(order.importance, artwork); !weighed) return weighed.error();
  progress(0.02, "reading the stock");
  const auto stock = load_job_wood(order.wood, artwork.width * artwork.height);
  if (!stock) return stock.error();
  auto options = wood_options(order.options, order.wood, *stock, order.kerf, order.recipes);
  if (!options) return options.error();
  options->threads = order.threads;
  planner::AdviceLimits limits;
  limits.size = order.size, limits.crops = order.crop.empty();
  // Both are of borders as they are asked for, although none is refined here.
  options->web = web_of(planner::LayoutKind::kGrid, options->refine);
  limits.cells_web = web_of(planner::LayoutKind::kMosaic, options->refine);
  const auto advice = planner::advise(artwork, *stock, *options, limits, [&](double f, std::string_view text) {
    progress(0.05 + 0.9 * f, std::string(text));
  });
  if (!advice) return advice.error();
  AdviceGiven out;
  out.suggested = advice->best, out.remarks = advice->remarks;
  for (const planner::Suggestion& it : advice->suggestions)
    out.suggestions.push_back(advised(it, order, artwork.picture.size()));
  return out;
}

}  // namespace veneer::daemon
