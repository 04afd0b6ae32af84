#include "planner/global/packing.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "planner/cancelled.h"
#include "planner/global/shelves.h"
#include "planner/parallel.h"
#include "planner/poses/arrangement.h"

namespace veneer::planner {
namespace {

constexpr int kMostPackingRounds = 4;
constexpr std::uint64_t kExchanges = 400;                // tried for each pose
constexpr double kPackingHot = 0.4, kPackingCold = 0.1;  // in poses

Ring<ArtworkFrame> rectangle(Millimetres width, Millimetres height) {
  const Millimetres x = width / 2, y = height / 2;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

// What is left of the free wood: at first without the position margin, then without what has been taken.
Result<Raster<PanelFrame>> leftover(const FreeWood& wood, const std::vector<Ring<PanelFrame>>& taken,
                                    const std::stop_token& stop) {
  constexpr int kBand = 256;  // rows between looks at `stop`
  const cv::Mat& all = wood.raster().pixels;
  Raster<PanelFrame> free = wood.raster();
  const Millimetres margin = wood.border() - wood.kerf() - FreeWood::kSlack;
  const int reach = std::max(0, static_cast<int>(std::ceil(free.resolution.to_px(margin).count() - 1e-6)));
  const cv::Mat near = cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1});
  free.pixels = cv::Mat(all.size(), CV_8UC1);
  for (int top = 0; top < all.rows; top += kBand) {
    if (stop.stop_requested()) return cancelled();
    const cv::Range band(top, std::min(all.rows, top + kBand));
    cv::Mat part = free.pixels.rowRange(band);
    cv::erode(all.rowRange(band), part, near, {-1, -1}, 1, cv::BORDER_CONSTANT, 0);  // looks beyond the band
  }
  for (const Ring<PanelFrame>& ring : taken) {
    if (stop.stop_requested()) return cancelled();
    std::vector<cv::Point> corners;
    for (const auto& p : ring) {
      double column = 0, row = 0;
      free.to_pixels(p, column, row);
      corners.emplace_back(cvFloor(column), cvFloor(row));
    }
    cv::fillConvexPoly(free.pixels, corners, cv::Scalar(0));
  }
  return free;
}

// Poses that exclude each other where they overlap, and which of them are taken.
class Slots {
 public:
  // Takes poses in their order.
  static Result<Slots> make(const std::vector<MatchPanel>& panels, const Footprint& footprint, std::vector<Pose> poses,
                            const std::stop_token& stop) {
    Slots slots(std::move(poses));
    const std::vector<Footprint> footprints(slots.poses_.size(), footprint);
    Arrangement all(footprints, panels);
    for (std::size_t i = 0; i < slots.poses_.size(); ++i) {
      if (stop.stop_requested()) return cancelled();
      all.in_the_way(i, slots.poses_[i], slots.overlaps_[i]);
      for (const std::size_t other : slots.overlaps_[i]) slots.overlaps_[other].push_back(i);
      all.put(i, slots.poses_[i]);
    }
    for (std::size_t i = 0; i < slots.poses_.size(); ++i)
      if (slots.in_the_way_[i] == 0) slots.take(i);
    return slots;
  }

  std::size_t count() const { return count_; }

  // Simulated annealing: a pose at random pushes out what it overlaps, and what is free then is taken. The best found
  // counts.
  Status improve(std::size_t enough, std::uint64_t exchanges, const std::stop_token& stop) {
    std::mt19937_64 random(1);
    std::vector<bool> best = taken_;
    std::size_t most = count_;
    for (std::uint64_t k = 0; k < exchanges && most < enough; ++k) {
      if (stop.stop_requested()) return cancelled();
      const std::size_t i = random() % poses_.size();
      const double chance = static_cast<double>(random() >> 11) * 0x1p-53;
      if (taken_[i]) continue;
      const double temperature =
          kPackingHot * std::pow(kPackingCold / kPackingHot, static_cast<double>(k) / static_cast<double>(exchanges));
      if (in_the_way_[i] > 1 && std::log(chance) * temperature > 1 - in_the_way_[i]) continue;
      std::vector<std::size_t> out;
      for (const std::size_t other : overlaps_[i])
        if (taken_[other]) out.push_back(other);
      for (const std::size_t other : out) drop(other);
      take(i);
      for (const std::size_t gone : out)
        for (const std::size_t other : overlaps_[gone])
          if (in_the_way_[other] == 0 && !taken_[other]) take(other);
      if (count_ > most) most = count_, best = taken_;
    }
    taken_ = best, count_ = most;
    return Ok();
  }

  std::vector<Pose> taken() const {
    std::vector<Pose> out;
    for (std::size_t i = 0; i < poses_.size(); ++i)
      if (taken_[i]) out.push_back(poses_[i]);
    return out;
  }

 private:
  explicit Slots(std::vector<Pose> poses)
      : poses_(std::move(poses)), overlaps_(poses_.size()), in_the_way_(poses_.size()), taken_(poses_.size()) {}

  void take(std::size_t i) {
    taken_[i] = true, ++count_;
    for (const std::size_t other : overlaps_[i]) ++in_the_way_[other];
  }
  void drop(std::size_t i) {
    taken_[i] = false, --count_;
    for (const std::size_t other : overlaps_[i]) --in_the_way_[other];
  }

  std::vector<Pose> poses_;
  std::vector<std::vector<std::size_t>> overlaps_;
  std::vector<int> in_the_way_;  // taken poses that overlap this
  std::vector<bool> taken_;
  std::size_t count_ = 0;
};

class Packer {
 public:
  Packer(const Matcher& matcher, Millimetres width, Millimetres height, int threads, const std::stop_token& stop)
      : matcher_(matcher),
        panels_(matcher.panels()),
        width_(width),
        height_(height),
        outline_(rectangle(width, height)),
        growth_(panels_.front().wood.kerf() + FreeWood::kSlack),
        footprint_(outline_, growth_),
        threads_(threads),
        stop_(stop) {}

  Result<std::vector<Pose>> run(std::size_t enough) const {
    std::vector<Pose> poses, packed;
    for (int round = 0; round < kMostPackingRounds; ++round) {
      const Result<std::vector<Raster<PanelFrame>>> free = leftovers(packed);
      if (!free.ok()) return free.error();
      const Result<std::vector<Pose>> more = shelves_on(*free);
      if (!more.ok()) return more.error();
      if (more->empty()) break;
      poses.insert(poses.end(), more->begin(), more->end());
      Result<Slots> slots = Slots::make(panels_, footprint_, poses, stop_);
      if (!slots.ok()) return slots.error();
      const Status improved = slots->improve(enough, kExchanges * poses.size(), stop_);
      if (!improved.ok()) return improved.error();
      packed = slots->taken();
    }
    return packed;
  }

 private:
  Ring<PanelFrame> outline_at(const Pose& pose) const { return footprint_.panel_from_artwork(pose) * outline_; }

  Result<std::vector<Raster<PanelFrame>>> leftovers(const std::vector<Pose>& packed) const {
    std::vector<Raster<PanelFrame>> out(panels_.size());
    const Status done = run_parallel(out.size(), threads_, stop_, [&](std::size_t p) -> Status {
      std::vector<Ring<PanelFrame>> taken;
      for (const Pose& pose : packed)
        if (pose.panel == static_cast<int>(p)) taken.push_back(grown(outline_at(pose), panels_[p].wood.kerf()));
      Result<Raster<PanelFrame>> free = leftover(panels_[p].wood, taken, stop_);
      if (!free.ok()) return free.error();
      out[p] = *std::move(free);
      return Ok();
    });
    if (!done.ok()) return done.error();
    return out;
  }

  // What fills the regions of all panels and rotations, the largest region first.
  Result<std::vector<Pose>> shelves_on(const std::vector<Raster<PanelFrame>>& free) const {
    const auto rotations = static_cast<std::size_t>(matcher_.rotations());
    std::vector<std::vector<std::vector<Pose>>> found(free.size() * rotations);
    const Status done = run_parallel(found.size(), threads_, stop_, [&](std::size_t i) -> Status {
      const int panel = static_cast<int>(i / rotations), rotation = static_cast<int>(i % rotations);
      const Radians turn = matcher_.lattice(panel, rotation).turn();
      for (const bool columns : {false, true}) {
        Result<std::vector<std::vector<Pose>>> regions = rows_on(free[i / rotations], panel, turn, columns);
        if (!regions.ok()) return regions.error();
        std::move(regions->begin(), regions->end(), std::back_inserter(found[i]));
      }
      for (std::vector<Pose>& region : found[i])
        if (Status settled = settle(region); !settled.ok()) return settled;
      return Ok();
    });
    if (!done.ok()) return done.error();
    std::vector<std::vector<Pose>> regions;
    for (auto& of_rotation : found) std::move(of_rotation.begin(), of_rotation.end(), std::back_inserter(regions));
    std::stable_sort(regions.begin(), regions.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
    std::vector<Pose> poses;
    for (const std::vector<Pose>& region : regions) poses.insert(poses.end(), region.begin(), region.end());
    return poses;
  }

  // Rows of rectangles at one rotation, or columns: rows of the same rectangles, seen from the side.
  Result<std::vector<std::vector<Pose>>> rows_on(const Raster<PanelFrame>& wood, int panel, Radians turn,
                                                 bool columns) const {
    const Millimetres spacing = 2 * growth_ + Millimetres(1e-6);
    Spacing each{wood.resolution.to_px(width_ + spacing).count(), wood.resolution.to_px(height_ + spacing).count()};
    if (!columns) return Shelves(wood, panel, turn, each).filled(stop_);
    std::swap(each.width, each.height);
    auto regions = Shelves(wood, panel, turn + Radians(std::numbers::pi / 2), each).filled(stop_);
    if (!regions.ok()) return regions.error();
    for (std::vector<Pose>& region : *regions)
      for (Pose& pose : region) pose = pose_at(panel, pose.x, pose.y, turn.count());
    return regions;
  }

  // Shifts a region's poses, all alike and by up to a pixel, so that as many as possible keep to the rule of
  // free_wood.h, for which the points of the shelves are a little coarse; the others are dropped.
  Status settle(std::vector<Pose>& region) const {
    constexpr double kShifts[] = {0, 0.5, -0.5, 1, -1};  // pixels
    std::vector<Pose> most;
    for (const double down : kShifts) {
      for (const double right : kShifts) {
        if (most.size() == region.size()) break;
        std::vector<Pose> settled;
        for (Pose pose : region) {
          if (stop_.stop_requested()) return cancelled();
          const FreeWood& wood = panels_[static_cast<std::size_t>(pose.panel)].wood;
          const Millimetres pixel = wood.raster().resolution.to_mm(Pixels(1));
          pose.x += right * pixel.count(), pose.y -= down * pixel.count();
          if (wood.on_free_wood(outline_at(pose))) settled.push_back(pose);
        }
        if (settled.size() > most.size()) most = std::move(settled);
      }
    }
    region = std::move(most);
    return Ok();
  }

  const Matcher& matcher_;
  const std::vector<MatchPanel>& panels_;
  Millimetres width_, height_;
  Ring<ArtworkFrame> outline_;
  Millimetres growth_;
  Footprint footprint_;
  int threads_;
  const std::stop_token& stop_;
};

}  // namespace

Result<std::vector<Pose>> pack_rectangles(const Matcher& matcher, Millimetres width, Millimetres height,
                                          std::size_t enough, int threads, const std::stop_token& stop) {
  return Packer(matcher, width, height, threads, stop).run(enough);
}

}  // namespace veneer::planner
