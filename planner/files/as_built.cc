#include "planner/files/as_built.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

const cv::Vec3b kBelow(40, 40, 40);  // the board, in the shade of an open joint
const cv::Vec3b kChar(20, 25, 33);   // burnt wood
constexpr double kMinuteOfArc = kPi / 180 / 60;
constexpr double kWidthOfBlur = 2.355;  // its width at half height, in standard deviations

// Across a border, counted from its middle: a gap, then char that fades away.
class Section {
 public:
  Section(const AsBuilt& look, double px_per_mm)
      : gap_(look.clearance.count() / 2 * px_per_mm),
        width_(look.char_width.count() * px_per_mm),
        depth_(look.char_depth) {}

  double reach() const { return gap_ + width_; }  // pixels
  struct Share {
    float gap, burnt;
  };
  // Of a pixel whose centre lies `distance` pixels from the border.
  Share of_pixel(double distance) const {
    const double from = distance - 0.5, to = distance + 0.5;
    return {static_cast<float>(gap_to(to) - gap_to(from)), static_cast<float>(burnt_to(to) - burnt_to(from))};
  }

 private:
  // From the middle to x, odd.
  double gap_to(double x) const { return std::copysign(std::min(std::abs(x), gap_), x); }
  double burnt_to(double x) const {
    const double into = std::clamp(std::abs(x) - gap_, 0.0, width_);
    return width_ > 0 ? std::copysign(depth_ * (into - into * into / (2 * width_)), x) : 0;
  }

  double gap_, width_, depth_;
};

double distance_to(cv::Point2d p, cv::Point2d a, cv::Point2d b) {
  const cv::Point2d along = b - a, to = p - a;
  const double length = along.dot(along);
  const double t = length > 0 ? std::clamp(to.dot(along) / length, 0.0, 1.0) : 0.0;
  return std::hypot(to.x - t * along.x, to.y - t * along.y);
}

// How far each pixel's centre is from the nearest border, in pixels; those farther than `reach` have more than that.
cv::Mat distances(const Plan& plan, std::size_t artwork, const cv::Size& size, double px_per_mm, double reach) {
  cv::Mat out(size, CV_32FC1, cv::Scalar(reach + 1));
  const Millimetres height = plan.artworks[artwork].height;
  for (const Piece& piece : plan.pieces) {
    if (piece.artwork != artwork) continue;
    const Ring<ArtworkFrame>& ring = piece.artwork_outline;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const auto pixel = [&](const Point<ArtworkFrame>& p) {
        return cv::Point2d(p.x.count() * px_per_mm, (height - p.y).count() * px_per_mm);
      };
      const cv::Point2d a = pixel(ring[i]), b = pixel(ring[(i + 1) % ring.size()]);
      const cv::Rect box = cv::Rect(cv::Point(cvFloor(std::min(a.x, b.x) - reach), cvFloor(std::min(a.y, b.y) - reach)),
                                    cv::Point(cvCeil(std::max(a.x, b.x) + reach), cvCeil(std::max(a.y, b.y) + reach))) &
                           cv::Rect({}, size);
      for (int r = box.y; r < box.br().y; ++r) {
        auto* row = out.ptr<float>(r);
        for (int c = box.x; c < box.br().x; ++c)
          row[c] = std::min(row[c], static_cast<float>(distance_to({c + 0.5, r + 0.5}, a, b)));
      }
    }
  }
  return out;
}

}  // namespace

Result<cv::Mat> as_built(const Plan& plan, std::size_t artwork, const cv::Mat& preview, const AsBuilt& look) {
  if (artwork >= plan.artworks.size())
    return Error{ErrorCode::kInvalidArgument, fmt::format("the plan has no artwork number {}", artwork)};
  const auto is_size = [](Millimetres it) { return it >= Millimetres(0) && std::isfinite(it.count()); };
  if (preview.empty() || !is_size(look.clearance) || !is_size(look.char_width) || !is_size(look.distance) ||
      !(look.char_depth >= 0 && look.char_depth <= 1))
    return Error{ErrorCode::kInvalidArgument,
                 "the picture as built needs a preview and sizes that are not negative: give 0 or more"};
  const double px_per_mm = preview.cols / plan.artworks[artwork].width.count();
  const Section section(look, px_per_mm);
  const double reach = section.reach() + 0.5;
  const cv::Mat distance = distances(plan, artwork, preview.size(), px_per_mm, reach);
  const cv::Vec3b filled = look.putty.value_or(kBelow);
  cv::Mat out = preview.clone();
  out.forEach<cv::Vec3b>([&](cv::Vec3b& wood, const int* at) {
    const float d = distance.at<float>(at[0], at[1]);
    if (d > reach) return;
    const Section::Share share = section.of_pixel(d);
    for (int k = 0; k < 3; ++k)
      wood[k] = cv::saturate_cast<std::uint8_t>(static_cast<float>(wood[k]) * (1 - share.gap - share.burnt) +
                                                static_cast<float>(filled[k]) * share.gap +
                                                static_cast<float>(kChar[k]) * share.burnt);
  });
  const double blur = look.distance.count() * kMinuteOfArc / kWidthOfBlur * px_per_mm;
  if (blur > 0.2) cv::GaussianBlur(out, out, {}, blur, 0, cv::BORDER_REPLICATE);
  return out;
}

Result<cv::Vec3b> colour_of(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.size() != 6 || error != std::errc() || end != text.data() + text.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("\"{}\" is no colour: write six digits for red, green and blue, such as d8c8a0", text)};
  return cv::Vec3b(static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
                   static_cast<std::uint8_t>(value >> 16));
}

}  // namespace veneer::planner
