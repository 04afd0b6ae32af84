#include "calib/veneer_mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "calib/board_model.h"
#include "calib/glass_dust.h"
#include "calib/strip_finder.h"
#include "calib/wood_faults.h"
#include "calib/work_map.h"

namespace veneer::calib {
namespace {

// Keeps `margin_px` from whatever is not wood; the map's own border counts as such.
cv::Mat keep_away(const cv::Mat& wood, double margin_px) {
  cv::Mat framed, distance;
  cv::copyMakeBorder(wood, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::distanceTransform(framed, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat kept = distance > margin_px + 0.5;
  return kept(cv::Rect(1, 1, wood.cols, wood.rows)).clone();
}

// Connected parts, each with its strip's number (or its own, where `strips` is empty); the small ones are dropped.
// What is `hidden` belongs to no zone, but parts nothing: the wood goes on beneath. Zones are numbered from left to
// right.
std::vector<Zone> label_zones(const cv::Mat& usable, const cv::Mat& hidden, const cv::Mat& strips, cv::Mat& zones,
                              const WorkMap& work, const Raster<PanelFrame>& map, const MaskOptions& options) {
  cv::Mat labels, stats, centres;
  const int count = cv::connectedComponentsWithStats(usable, labels, stats, centres, 4);
  const double px2 = work.px_per_mm * work.px_per_mm;
  struct Island {
    int label = 0;
    cv::Rect box;
    double area = 0, middle = 0;
  };
  std::map<int, std::vector<Island>> by_strip;
  for (int i = 1; i < count; ++i) {
    const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                       stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    const double area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (area < options.smallest_zone.count() * px2) continue;
    int strip = -i;
    if (!strips.empty()) {
      double low = 0, high = 0;
      cv::minMaxLoc(strips(box), &low, &high, nullptr, nullptr, labels(box) == i);
      strip = static_cast<int>(high);
    }
    by_strip[strip].push_back({i, box, area, centres.at<double>(i, 0)});
  }
  std::vector<std::pair<double, int>> order;
  for (const auto& [strip, parts] : by_strip) {
    double sum = 0, area = 0;
    for (const Island& part : parts) sum += part.middle * part.area, area += part.area;
    order.emplace_back(sum / area, strip);
  }
  std::sort(order.begin(), order.end());
  if (order.size() > 255) order.resize(255);
  std::vector<std::uint8_t> number(static_cast<std::size_t>(count), 0);
  std::vector<Zone> list;
  for (const auto& [middle, strip] : order) {
    Zone zone;
    zone.label = static_cast<int>(list.size()) + 1;
    for (const Island& part : by_strip.at(strip)) {
      number[static_cast<std::size_t>(part.label)] = static_cast<std::uint8_t>(zone.label);
      zone.box.add(map.from_pixels(part.box.x * work.fold, part.box.y * work.fold));
      zone.box.add(map.from_pixels(part.box.br().x * work.fold, part.box.br().y * work.fold));
    }
    list.push_back(zone);
  }
  cv::Mat grey;
  cv::cvtColor(work.bgr, grey, cv::COLOR_BGR2GRAY);
  std::vector<double> sums(list.size(), 0), counts(list.size(), 0);
  zones = cv::Mat::zeros(usable.size(), CV_8UC1);
  for (int r = 0; r < usable.rows; ++r)
    for (int c = 0; c < usable.cols; ++c) {
      if (!hidden.empty() && hidden.at<std::uint8_t>(r, c) != 0) continue;
      const std::uint8_t label = number[static_cast<std::size_t>(labels.at<int>(r, c))];
      zones.at<std::uint8_t>(r, c) = label;
      if (label != 0) sums[label - 1U] += grey.at<std::uint8_t>(r, c), counts[label - 1U] += 1;
    }
  for (std::size_t i = 0; i < list.size(); ++i)
    list[i].area = SquareMillimetres(counts[i] / px2), list[i].lightness = sums[i] / std::max(1.0, counts[i]);
  return list;
}

// 255 where all map pixels of a work pixel are set.
cv::Mat all_set(const cv::Mat& mask, const WorkMap& work) {
  cv::Mat lowest, padded;
  cv::copyMakeBorder(mask, padded, 0, work.bgr.rows * work.fold - mask.rows, 0, work.bgr.cols * work.fold - mask.cols,
                     cv::BORDER_REPLICATE);
  cv::resize(padded, lowest, work.bgr.size(), 0, 0, cv::INTER_AREA);
  return lowest == 255;
}

Raster<PanelFrame> grow(const cv::Mat& small, int fold, const Raster<PanelFrame>& map) {
  cv::Mat grown;
  cv::resize(small, grown, {}, fold, fold, cv::INTER_NEAREST);
  return {grown(cv::Rect(0, 0, map.pixels.cols, map.pixels.rows)).clone(), map.resolution, map.origin};
}

constexpr double kNamedFaults = 0.12;    // share of a strip that is left out, beyond which the operator is told
constexpr double kDoubtedFaults = 0.03;  // the same of what is no clear crack: it may be the wood's own figure

// The share of a strip that its faults take which are neither round nor clear cracks: lines well within the strip.
double doubtful_share(const WoodFaults& faults, const cv::Mat& place, double px) {
  constexpr double kAroundRound = 0.6;      // mm of a round's surroundings that show it
  constexpr double kThin = 2.2, kLong = 4;  // mm across a crack; times as long as it is wide
  constexpr double kWithin = 1.5;           // mm from the strip's sides, whose shade looks like a crack
  cv::Mat deep;
  std::vector<std::vector<cv::Point>> outlines;
  cv::Mat others = faults.mask & place;
  for (const ScrewSpot& spot : faults.round)
    cv::circle(others, spot.centre, static_cast<int>(spot.diameter / 2 + kAroundRound * px), cv::Scalar(0), cv::FILLED);
  cv::findContours(others, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::distanceTransform(place, deep, cv::DIST_L2, 3);
  double doubtful = 0;
  for (const auto& outline : outlines) {
    const cv::RotatedRect box = cv::minAreaRect(outline);
    const double area = std::max(1.0, cv::contourArea(outline)), length = std::max(box.size.width, box.size.height);
    double within = 0;
    for (const cv::Point& p : outline) within += deep.at<float>(p) / static_cast<double>(outline.size());
    const bool crack = area < kThin * px * length && length > kLong * area / length && within > kWithin * px;
    if (!crack) doubtful += area;
  }
  return doubtful / std::max(1, cv::countNonZero(place));
}

// What is doubtful about a strip: `sure` from 0 to 1, and a sentence for the least sure of all.
struct Doubt {
  double sure = 1;
  std::string reason;

  void consider(double how_sure, const char* why) {
    if (how_sure >= sure) return;
    sure = std::max(0.0, how_sure), reason = why;
  }
};

// Whether it is no larger than a tag of a panel with its quiet zone: one that is too dirty to be read looks like wood,
// dark or light, with straight sides.
bool may_be_a_tag(const FoundStrip& strip, double px_per_mm) {
  constexpr double kLargest = 20;  // mm
  const auto corners = corners_of(strip);
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i) longest = std::max(longest, cv::norm(corners[(i + 1) % 4] - corners[i]));
  return longest <= kLargest * px_per_mm;
}

Doubt doubts_of(const FoundStrip& strip, const BoardView& view, double fault_share) {
  constexpr double kClearSide = 6;     // spreads of the board: a side whose step is half of it is doubtful
  constexpr double kClearlyOther = 8;  // the same for places that are unlike the board
  constexpr double kBoardBand = 0.6;   // mm; a side's own shade and blur are narrower
  constexpr double kManyFaults = 0.4;  // a strip of which half as much is not its own wood is doubtful
  Doubt doubt;
  if (may_be_a_tag(strip, view.px_per_mm))
    doubt.consider(0, "it is no larger than a tag, and may be one that is too dirty to be read");
  doubt.consider(view.rim_share, "the board is not the same all around the sheet");
  const double clearest = std::min({strip.left.seen, strip.right.seen, strip.top.seen, strip.bottom.seen});
  doubt.consider(clearest / kClearSide, "one of its sides cannot be seen");
  doubt.consider(strip.unlike / kClearlyOther, "it looks like the board");
  if (strip.board_band > kBoardBand) doubt.consider(0, "a band of it from end to end looks like the board");
  doubt.consider(1 - fault_share / kManyFaults, "much of it does not look like its wood");
  return doubt;
}

class Masker {
 public:
  Masker(const WorkMap& work, const cv::Mat& marked, const Raster<PanelFrame>& map, const MaskOptions& options)
      : work_(work), marked_(marked), map_(map), options_(options) {}

  // The strips of a panel that is seen for the first time.
  void find(VeneerMask& out) {
    const BoardView view = view_board(work_, marked_);
    wood_ = cv::Mat::zeros(work_.bgr.size(), CV_8UC1), strips_ = wood_.clone();
    int number = 0;
    for (const FoundStrip& strip : find_strips(view, marked_)) {
      const cv::Mat place = draw_strip(strip, work_.bgr.size());
      const WoodFaults faults = find_faults(view, place);
      const double fault_share =
          cv::countNonZero(faults.mask) / std::max(1.0, static_cast<double>(cv::countNonZero(place)));
      const Doubt doubt = doubts_of(strip, view, fault_share);
      if (doubt.sure < options_.least_confidence) {
        AskedStrip& asked = ask(out, strip, {{}, doubt.sure, false, doubt.reason, {}});
        for (const ScrewSpot& spot : faults.round) asked.round.push_back(hole_of(spot));
        continue;
      }
      if (number == 255) break;
      const double doubtful = doubtful_share(faults, place, work_.px_per_mm);
      if (fault_share > kNamedFaults || doubtful > kDoubtedFaults)
        ask(out, strip,
            {{}, doubt.sure, true, fmt::format("{:.0f} % of it does not look like the rest", 100 * fault_share), {}});
      confidence_.push_back(doubt.sure);
      wood_.setTo(255, place & ~faults.mask), strips_.setTo(++number, place);
      for (const ScrewSpot& spot : faults.round) take_out(spot, out);
    }
    wood_.setTo(0, marked_);
    find_hairs(view, out);
  }

  // Of what was usable, what looks as it did.
  void compare(const EarlierLook& earlier) {
    const WorkMap before = shrink(earlier.map);
    const cv::Mat changed = changes(view_board(before, marked_), view_board(work_, marked_));
    kept_ = all_set(earlier.usable.pixels, work_);
    // Its margins were kept already: only what is new needs one.
    wood_ = ~(changed | marked_);
  }

  Status finish(VeneerMask& out) {
    cv::Mat usable = keep_away(wood_, options_.edge_margin.count() * work_.px_per_mm), zones;
    if (!kept_.empty()) cv::bitwise_and(usable, kept_, usable);
    // No margin is kept from a hair, as it is no edge of the wood.
    out.list = label_zones(usable, hidden_, strips_, zones, work_, map_, options_);
    if (out.list.empty())
      return Error{ErrorCode::kRefused,
                   out.asked.empty() ? "no veneer is seen on the map: check that the show face was scanned"
                                     : "no strip of veneer is seen clearly on the map: " + out.asked.front().reason};
    out.zones = grow(zones, work_.fold, map_);
    for (Zone& zone : out.list) {
      if (strips_.empty()) continue;
      double low = 0, high = 0;
      cv::minMaxLoc(strips_, &low, &high, nullptr, nullptr, zones == zone.label);
      zone.confidence = confidence_[static_cast<std::size_t>(high) - 1];
    }
    // A picture of its own: assigned to a copy that shares its pixels, the comparison would overwrite the labels.
    out.usable = {out.zones.pixels > 0, out.zones.resolution, out.zones.origin};
    return Ok();
  }

 private:
  // What hairs hide is withheld without a margin, even where it was taken for a crack.
  void find_hairs(const BoardView& view, VeneerMask& out) {
    constexpr double kThin = 0.4;  // mm, half the width of a fault that may be a hair
    cv::Mat thick;
    cv::morphologyEx(~wood_ & (strips_ > 0), thick, cv::MORPH_OPEN, round_kernel(kThin * work_.px_per_mm));
    thick |= marked_;
    const GlassDust dust = find_glass_dust(view, strips_, thick);
    for (const GlassHair& hair : dust.hairs)
      out.hairs.push_back({on_panel(hair.middle), Millimetres(hair.length / work_.px_per_mm)});
    hidden_ = dust.mask;
    wood_.setTo(255, hidden_ & (strips_ > 0) & ~thick);
  }

  AskedStrip& ask(VeneerMask& out, const FoundStrip& strip, AskedStrip asked) const {
    const auto corners = corners_of(strip);
    for (std::size_t i = 0; i < 4; ++i) asked.outline[i] = on_panel(corners[i]);
    return out.asked.emplace_back(std::move(asked));
  }

  Point<PanelFrame> on_panel(const cv::Point2d& p) const {
    return map_.from_pixels(p.x * work_.fold, p.y * work_.fold);
  }

  ScrewHole hole_of(const ScrewSpot& screw) const {
    return {on_panel(screw.centre), Millimetres(screw.diameter / work_.px_per_mm)};
  }

  void take_out(const ScrewSpot& screw, VeneerMask& out) {
    // Its edge gets the edge's margin beside; that may be the wider one.
    const double radius =
        std::max(0.0, screw.diameter / 2 + (options_.screw_margin - options_.edge_margin).count() * work_.px_per_mm);
    cv::circle(wood_, cv::Point2d(screw.centre.x - 0.5, screw.centre.y - 0.5), static_cast<int>(std::ceil(radius)),
               cv::Scalar(0), cv::FILLED);
    const ScrewHole hole = hole_of(screw);
    const bool known = std::any_of(out.screws.begin(), out.screws.end(), [&](const ScrewHole& other) {
      return distance(other.centre, hole.centre) < other.diameter / 2;
    });
    if (!known) out.screws.push_back(hole);
  }

  // Where colour or lightness, each in its board's own light, has changed by more than dust and grain do.
  cv::Mat changes(const BoardView& before, const BoardView& now) const {
    constexpr double kChanged = 0.25, kWide = 0.25;  // logarithm; mm
    cv::Mat changed = cv::Mat::zeros(now.planes[0].size(), CV_8UC1);
    for (std::size_t k = 0; k < 3; ++k) {
      cv::Mat was, is;
      cv::GaussianBlur(before.planes[k], was, {}, kWide * work_.px_per_mm);
      cv::GaussianBlur(now.planes[k], is, {}, kWide * work_.px_per_mm);
      changed |= cv::abs(is - was) > kChanged;
    }
    cv::morphologyEx(changed, changed, cv::MORPH_OPEN, round_kernel(kWide * work_.px_per_mm));
    return changed;
  }

  const WorkMap& work_;
  const cv::Mat& marked_;
  const Raster<PanelFrame>& map_;
  const MaskOptions& options_;
  cv::Mat wood_, strips_, kept_;    // CV_8UC1, on the work map; strips_ holds numbers from 1
  cv::Mat hidden_;                  // CV_8UC1, 255 under hairs on the glass
  std::vector<double> confidence_;  // of each strip
};

}  // namespace

Result<VeneerMask> mask_veneer(const Raster<PanelFrame>& map, const PanelFiducials& fiducials,
                               const MaskOptions& options, const EarlierLook* earlier) {
  if (map.pixels.type() != CV_8UC3 || map.pixels.empty())
    return Error{ErrorCode::kInvalidArgument,
                 "the veneer map to mask is empty or not an 8 bit colour picture: scan the panel again"};
  if (earlier != nullptr &&
      (earlier->usable.pixels.type() != CV_8UC1 || earlier->usable.pixels.size() != map.pixels.size() ||
       earlier->map.pixels.type() != CV_8UC3 || earlier->map.pixels.size() != map.pixels.size()))
    return Error{ErrorCode::kInvalidArgument,
                 "the earlier map or mask is not as large as the veneer map: scan the panel again"};
  const WorkMap work = shrink(map);
  const cv::Mat marked = mark_fiducials(map, fiducials, work, options.fiducial_margin);
  VeneerMask out;
  Masker masker(work, marked, map, options);
  if (earlier != nullptr) {
    masker.compare(*earlier);
  } else {
    masker.find(out);
  }
  if (const Status finished = masker.finish(out); !finished) return finished.error();
  return out;
}

}  // namespace veneer::calib
