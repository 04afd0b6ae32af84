#include "daemon/orders/advice_work.h"

#include <fstream>
#include <iterator>
#include <string_view>

#include "daemon/orders/wood_options.h"
#include "planner/pictures/jpeg_codec.h"
#include "planner/pictures/pictures.h"
#include "planner/pictures/resample.h"
#include "planner/suggest/contact_sheet.h"
#include "planner/suggest/crops.h"
#include "planner/suggest/suggestions.h"

namespace veneer::daemon {
namespace {

constexpr int kAdviceSide = 280;  // pixels of a preview's longer side
constexpr int kAdviceQuality = 82;

std::string base64_of(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[three >> (6 * (3 - k)) & 63U] : '=';
  }
  return out;
}

std::string preview_text(const cv::Mat& preview) {
  const double scale = static_cast<double>(kAdviceSide) / std::max(preview.cols, preview.rows);
  const auto small =
      planner::stretch(preview, std::max(1, cvRound(preview.cols * scale)), std::max(1, cvRound(preview.rows * scale)));
  return base64_of(planner::encode_jpeg(small, kAdviceQuality).value_or(""));
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
  std::ifstream file(order.picture, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  auto picture = planner::decode_picture(bytes, order.name);
  if (!picture) return picture.error();
  planner::Artwork artwork;
  artwork.name = order.name;
  artwork.letter = planner::artwork_letter(0);
  artwork.picture = std::move(*picture);
  if (!order.crop.empty()) {
    const auto crop = planner::crop_of(order.crop, artwork.picture.size(), order.name);
    if (!crop) return crop.error();
    planner::crop_pictures(artwork, *crop);
  }
  const auto size = planner::artwork_size(artwork.picture, order.size);
  artwork.width = size.width, artwork.height = size.height;
  progress(0.02, "reading the stock");
  const auto stock = load_job_wood(order.wood, size.width * size.height);
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
