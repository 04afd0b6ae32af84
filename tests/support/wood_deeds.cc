#include "tests/support/wood_deeds.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/reconcile.h"

namespace veneer::workshop {
namespace {

using Outline = std::vector<cv::Point2d>;

constexpr Millimetres kBeside(0.3);        // what the borders of a difference may be off by
constexpr double kTold = 3, kFalse = 1.5;  // mm2
constexpr double kOffGlass = 0.03;         // mm by which a registration is off, one sigma an axis

struct Piece {
  Fate fate = Fate::kCutAsBooked;
  int strip = 0;
  Outline outline;
};

Region<PanelFrame> region_of(const Outline& outline) {
  Ring<PanelFrame> ring;
  for (const auto& p : outline) ring.push_back(point<PanelFrame>(p.x, p.y));
  return Region<PanelFrame>(ring);
}

// What of a region is wider than half a millimetre.
double wide_area(const Region<PanelFrame>& region) {
  const Region<PanelFrame> thinner = offset(region, Millimetres(-0.25));
  return thinner.empty() ? 0 : offset(thinner, Millimetres(0.25)).area().count();
}

bool is_whole_wood(const Panel& panel, const Outline& outline) {
  std::vector<cv::Point> corners;
  const double px = panel.truth_px_per_mm;
  for (const auto& p : outline)
    corners.emplace_back(static_cast<int>(p.x * px), static_cast<int>(panel.matter.rows - p.y * px));
  const cv::Rect box = cv::boundingRect(corners) & cv::Rect({}, panel.matter.size());
  cv::Mat inside = cv::Mat::zeros(box.size(), CV_8UC1);
  for (auto& corner : corners) corner -= box.tl();
  cv::fillPoly(inside, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
  return cv::countNonZero(inside & (panel.matter(box) != static_cast<int>(Matter::kWood))) == 0;
}

// One piece after the other up each strip, of any shape, somewhat apart.
std::vector<Piece> draw_pieces(const Panel& panel, cv::RNG& random) {
  std::vector<Piece> out;
  for (std::size_t i = 0; i < panel.strips.size(); ++i) {
    double left = 1e9, right = -1e9, low = 1e9, high = -1e9;
    for (const auto& p : panel.strips[i].outline)
      left = std::min(left, p.x), right = std::max(right, p.x), low = std::min(low, p.y), high = std::max(high, p.y);
    left += 2.5, right -= 2.5, high -= 4;
    for (double at = low + 4; at < high - 5;) {
      Piece piece;
      piece.fate = static_cast<Fate>(random.uniform(0, kFates)), piece.strip = static_cast<int>(i) + 1;
      const bool narrow = piece.fate == Fate::kNarrowUnbooked;
      const double tall = narrow ? random.uniform(6.0, 10.0) : random.uniform(3.5, 11.0);
      const double wide = narrow ? random.uniform(0.7, 1.2) : random.uniform(3.5, std::min(12.0, right - left));
      const double x = random.uniform(left, right - wide), a = random.uniform(0.0, 0.3 * wide),
                   b = random.uniform(0.0, 0.3 * wide);
      if (at + tall > high) break;
      piece.outline = {
          {x + (narrow ? 0 : a), at}, {x + wide, at}, {x + wide - (narrow ? 0 : b), at + tall}, {x, at + tall}};
      if (!narrow && random.uniform(0, 4) == 0) piece.outline.pop_back();
      at += tall + random.uniform(2.5, 5.0);
      if (is_whole_wood(panel, piece.outline)) out.push_back(std::move(piece));
    }
  }
  return out;
}

std::vector<Deed> deeds_of(const std::vector<Piece>& pieces) {
  std::vector<Deed> out;
  for (const Piece& piece : pieces) switch (piece.fate) {
      case Fate::kCutAsBooked:
      case Fate::kGoneUnbooked:
      case Fate::kNarrowUnbooked:
        out.push_back({DeedKind::kCut, piece.outline});
        break;
      case Fate::kBookedHanging:
        out.push_back({DeedKind::kHanging, piece.outline});
        break;
      case Fate::kTornUnbooked:
        out.push_back({DeedKind::kTorn, piece.outline});
        break;
      case Fate::kBookedUntouched:
      case Fate::kLeftAlone:
        break;
    }
  return out;
}

bool is_booked(Fate fate) {
  return fate == Fate::kCutAsBooked || fate == Fate::kBookedUntouched || fate == Fate::kBookedHanging;
}
bool hangs(Fate fate) { return fate == Fate::kBookedUntouched || fate == Fate::kBookedHanging; }
bool vanished(Fate fate) {
  return fate == Fate::kGoneUnbooked || fate == Fate::kNarrowUnbooked || fate == Fate::kTornUnbooked;
}

// The sheet's map as a registration that is off by a little makes it.
Raster<PanelFrame> map_of(const Panel& panel, cv::RNG& random) {
  const double px = panel.resolution.px_per_mm;
  const cv::Size size(static_cast<int>(panel.width * px), static_cast<int>(panel.height * px));
  const cv::Point2d off(random.gaussian(kOffGlass), random.gaussian(kOffGlass));
  // Map pixel (centres at whole numbers) to sheet mm to scan pixel.
  cv::Matx23d out;
  const cv::Matx23d& scan = panel.scan_from_sheet;
  const double top = size.height / px;
  for (int row = 0; row < 2; ++row) {
    out(row, 0) = scan(row, 0) / px, out(row, 1) = -scan(row, 1) / px;
    out(row, 2) = scan(row, 0) * (0.5 / px + off.x) + scan(row, 1) * (top - 0.5 / px + off.y) + scan(row, 2) - 0.5;
  }
  Raster<PanelFrame> map;
  map.resolution = panel.resolution;
  cv::warpAffine(panel.scan, map.pixels, out, size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return map;
}

// The wood as a mask gives it whose questions were answered: all but what lies beside edges and faults.
Raster<PanelFrame> wood_of(const Panel& panel, const Raster<PanelFrame>& map) {
  constexpr double kEdgeMargin = 0.5;  // mm
  cv::Mat away;
  cv::distanceTransform(panel.matter == static_cast<int>(Matter::kWood), away, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  Raster<PanelFrame> out = map;
  cv::resize(away > kEdgeMargin * panel.truth_px_per_mm, out.pixels, map.pixels.size(), 0, 0, cv::INTER_NEAREST);
  return out;
}

}  // namespace

const char* name_of(Fate fate) {
  constexpr const char* kNames[] = {"cut as booked",      "booked, untouched",    "booked, hanging", "gone, not booked",
                                    "narrow, not booked", "torn off, not booked", "left alone"};
  return kNames[static_cast<std::size_t>(fate)];
}

bool is_doubted(const PieceVerdict& piece) {
  constexpr double kCut = 0.9, kWhole = 0.05;             // as suspects are told (daemon/stock/scan_proposals.cc)
  if (piece.fate == Fate::kNarrowUnbooked) return false;  // it has no inside
  const bool gone = vanished(piece.fate) || piece.fate == Fate::kCutAsBooked;
  return gone ? piece.share_gone < kCut : piece.share_gone > kWhole;
}

FateVerdict judge_fates(std::uint64_t seed, int i, const std::filesystem::path& woods) {
  constexpr double kResolutions[] = {300, 200, 150, 240};
  Order order;
  order.seed = seed * 100'003 + static_cast<std::uint64_t>(i);
  order.board = i, order.lid = static_cast<Lid>(i % 3), order.dpi = kResolutions[i / 3 % 4];
  order.width = 130 + 10 * (i % 5), order.height = 100 + 5 * (i % 3);
  order.woods = woods;
  const Panel first = compose(order);
  cv::RNG random(order.seed * 49'979'687 + 11);
  const std::vector<Piece> pieces = draw_pieces(first, random);
  order.deeds = deeds_of(pieces), order.rescan = 1;
  const Panel second = compose(order);

  FateVerdict out;
  out.board = first.board, out.lid = order.lid;
  const auto before = map_of(first, random), now = map_of(second, random);
  out.before = before.pixels, out.now = now.pixels;
  std::vector<Region<PanelFrame>> booked;
  for (const Piece& piece : pieces)
    if (is_booked(piece.fate)) booked.push_back(region_of(piece.outline));
  const auto wood = wood_of(first, before);
  const auto began = std::chrono::steady_clock::now();
  const auto found = calib::reconcile(before, now, booked, first.fiducials, {}, &wood);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  if (!found) {
    out.refused = found.error().message;
    return out;
  }
  std::vector<Region<PanelFrame>> told_gone, told_there, truly_gone, truly_there;
  for (const auto& difference : found->differences)
    (difference.kind == calib::DifferenceKind::kGoneNotBooked ? told_gone : told_there)
        .push_back(offset(difference.shape, kBeside));
  const auto all_told_gone = unite(told_gone), all_told_there = unite(told_there);
  for (const Piece& piece : pieces) {
    PieceVerdict& verdict = out.pieces.emplace_back();
    const auto shape = region_of(piece.outline);
    verdict.fate = piece.fate, verdict.wood = first.strips[static_cast<std::size_t>(piece.strip - 1)].wood;
    verdict.place = shape.box().min, verdict.area = shape.area().count();
    verdict.share_gone = calib::share_gone(found->gone_mask, shape, Millimetres(0.5));
    if (vanished(piece.fate))
      truly_gone.push_back(offset(shape, kBeside)), verdict.found = wide_area(subtract(shape, all_told_gone)) <= kTold;
    if (hangs(piece.fate))
      truly_there.push_back(offset(shape, kBeside)),
          verdict.found = wide_area(subtract(offset(shape, -2 * kBeside), all_told_there)) <= kTold;
  }
  const auto all_gone = unite(truly_gone), all_there = unite(truly_there);
  for (const auto& difference : found->differences) {
    const bool gone = difference.kind == calib::DifferenceKind::kGoneNotBooked;
    const double wrong = wide_area(subtract(difference.shape, gone ? all_gone : all_there));
    if (wrong > kFalse)
      out.false_ones.push_back(fmt::format("{} at {:.1f}, {:.1f}: {:.1f} mm2", to_string(difference.kind),
                                           difference.place.x.count(), difference.place.y.count(), wrong));
  }
  return out;
}

void FateFigures::add(const FateVerdict& verdict) {
  ++cases, seconds += verdict.seconds;
  refused += verdict.refused.empty() ? 0 : 1;
  false_ones += static_cast<int>(verdict.false_ones.size());
  for (const PieceVerdict& piece : verdict.pieces) {
    const auto fate = static_cast<std::size_t>(piece.fate);
    ++pieces[fate], missed[fate] += piece.found ? 0 : 1, doubted[fate] += is_doubted(piece) ? 1 : 0;
  }
}

int FateFigures::all_missed() const {
  int all = 0;
  for (const int m : missed) all += m;
  return all;
}

std::string to_table(const FateFigures& f) {
  std::string out = fmt::format("{:<22} {:>7} {:>7} {:>20}\n", "fate", "pieces", "missed", "unclear as a suspect");
  for (std::size_t i = 0; i < kFates; ++i)
    out += fmt::format("{:<22} {:>7} {:>7} {:>20}\n", name_of(static_cast<Fate>(i)), f.pieces[i], f.missed[i],
                       f.doubted[i]);
  return out + fmt::format("{} cases, {} refused, {} differences told that are none, {:.2f} s a case\n", f.cases,
                           f.refused, f.false_ones, f.seconds / std::max(1, f.cases));
}

nlohmann::json to_json(const FateFigures& f) {
  nlohmann::json out = {{"cases", f.cases},
                        {"refused", f.refused},
                        {"false", f.false_ones},
                        {"missed", f.all_missed()},
                        {"seconds_per_case", f.seconds / std::max(1, f.cases)}};
  for (std::size_t i = 0; i < kFates; ++i)
    out["fates"][name_of(static_cast<Fate>(i))] = {
        {"pieces", f.pieces[i]}, {"missed", f.missed[i]}, {"unclear_as_a_suspect", f.doubted[i]}};
  return out;
}

}  // namespace veneer::workshop
