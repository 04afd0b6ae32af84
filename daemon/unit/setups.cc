#include "daemon/unit/setups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/polygon_ops.h"

namespace veneer::daemon {
namespace {

constexpr std::size_t kFewestFiducials = 3;
constexpr std::size_t kMostSetups = 8;
constexpr int kSteps = 1000;  // of the search, for each number of set-ups

using Indices = std::vector<std::size_t>;

// One way of laying the panel, and what is then within reach and in view.
struct Way {
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  int quarter_turns = 0;
  Indices pieces, fiducials;
};

Box<BedFrame> shrunk(const Box<BedFrame>& box, Millimetres by) {
  return {{box.min.x + by, box.min.y + by}, {box.max.x - by, box.max.y - by}};
}

bool inside(const Box<BedFrame>& box, const std::vector<Point<BedFrame>>& points) {
  return std::all_of(points.begin(), points.end(), [&](const auto& p) { return box.contains(p); });
}

Box<BedFrame> laid_box(const SetupInput& in, const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  const Millimetres zero;
  return bounds(bed_from_panel *
                Ring<PanelFrame>{{zero, zero}, {in.width, zero}, {in.width, in.height}, {zero, in.height}});
}

// Where the panel's low edge may lie along one axis: in the middle when it fits, else from one end of the bed to the
// other in steps that leave no piece out.
std::vector<double> places(double low, double high, double length, double slack) {
  const double room = high - low - 2 * slack;
  if (length <= room) return {(low + high - length) / 2};
  std::vector<double> out;
  const int steps = std::max(4, static_cast<int>(std::ceil(4 * (length - room) / std::max(room, 1.0))));
  for (int i = 0; i <= steps; ++i) out.push_back(low + slack - (length - room) * i / steps);
  return out;
}

std::vector<Way> all_ways(const SetupInput& in) {
  const Box<BedFrame> reach = shrunk(in.reach, in.slack), view = shrunk(in.view, in.slack);
  std::vector<Way> ways;
  for (int turns = 0; turns < 4; ++turns) {
    const Isometry2<BedFrame, PanelFrame> turned(Radians(turns * kPi / 2), {}, Handedness::kImproper);
    const Box<BedFrame> box = laid_box(in, turned);
    for (const double y :
         places(in.reach.min.y.count(), in.reach.max.y.count(), box.height().count(), in.slack.count()))
      for (const double x :
           places(in.reach.min.x.count(), in.reach.max.x.count(), box.width().count(), in.slack.count())) {
        Way way;
        way.quarter_turns = turns;
        way.bed_from_panel = {Radians(turns * kPi / 2), point<BedFrame>(x - box.min.x.count(), y - box.min.y.count()),
                              Handedness::kImproper};
        for (std::size_t i = 0; i < in.pieces.size(); ++i)
          if (inside(reach, way.bed_from_panel * in.pieces[i].outline)) way.pieces.push_back(i);
        for (std::size_t i = 0; i < in.fiducials.size(); ++i)
          if (inside(view, way.bed_from_panel * in.fiducials[i])) way.fiducials.push_back(i);
        if (!way.pieces.empty() && way.fiducials.size() >= kFewestFiducials) ways.push_back(std::move(way));
      }
  }
  return ways;
}

std::string how_to_lay(const SetupInput& in, const Way& way) {
  static constexpr const char* kTurns[] = {"", "turned a quarter counter-clockwise, ", "turned half round, ",
                                           "turned a quarter clockwise, "};
  const Box<BedFrame> box = laid_box(in, way.bed_from_panel);
  std::string out;
  const auto side = [&](Millimetres sticks_out, const char* where) {
    if (sticks_out > Millimetres(1))
      out += fmt::format("{}{:.0f} mm of it sticking out {}", out.empty() ? "" : " and ", sticks_out.count(), where);
  };
  side(in.reach.min.x - box.min.x, "on the left");
  side(box.max.x - in.reach.max.x, "on the right");
  side(in.reach.min.y - box.min.y, "at the front");
  side(box.max.y - in.reach.max.y, "at the back");
  return fmt::format("{}{}", kTurns[way.quarter_turns], out.empty() ? "in the middle of the bed" : out);
}

// With as few set-ups as it finds: one, two, ...; each time depth first, the ways that reach most pieces first.
class Search {
 public:
  explicit Search(const SetupInput& in) : in_(in), ways_(all_ways(in)) {
    for (const auto& fiducial : in.fiducials) {
      const Region<PanelFrame> area(fiducial);
      Indices& over = pieces_over_.emplace_back();
      for (std::size_t i = 0; i < in.pieces.size(); ++i)
        if (overlaps(area, Region<PanelFrame>(in.pieces[i].outline))) over.push_back(i);
    }
  }

  bool solve() {
    std::size_t most = 0;
    for (const Way& way : ways_) most = std::max(most, way.pieces.size());
    for (allowed_ = 1; allowed_ <= kMostSetups && most > 0; ++allowed_) {
      steps_left_ = kSteps;
      if (allowed_ * most >= in_.pieces.size() && go_on(std::vector<bool>(in_.pieces.size(), false), in_.pieces.size()))
        return true;
    }
    return false;
  }

  std::vector<PanelSetup> result() const {
    std::vector<PanelSetup> out;
    for (const auto& [way, pieces] : chosen_) {
      PanelSetup& setup = out.emplace_back();
      for (const std::size_t i : pieces) setup.pieces.push_back(in_.pieces[i].piece);
      setup.bed_from_panel = way->bed_from_panel;
      setup.how = how_to_lay(in_, *way);
    }
    return out;
  }

 private:
  bool go_on(const std::vector<bool>& cut, std::size_t left) {
    if (left == 0) return true;
    if (chosen_.size() == allowed_ || --steps_left_ < 0) return false;
    struct Step {
      const Way* way;
      Indices pieces;
    };
    std::vector<Step> steps;
    for (const Way& way : ways_) {
      const auto whole = [&](std::size_t f) {
        return std::none_of(pieces_over_[f].begin(), pieces_over_[f].end(), [&](std::size_t i) { return cut[i]; });
      };
      if (static_cast<std::size_t>(std::count_if(way.fiducials.begin(), way.fiducials.end(), whole)) < kFewestFiducials)
        continue;
      Indices now;
      for (const std::size_t i : way.pieces)
        if (!cut[i]) now.push_back(i);
      if (!now.empty()) steps.push_back({&way, std::move(now)});
    }
    std::stable_sort(steps.begin(), steps.end(),
                     [](const Step& a, const Step& b) { return a.pieces.size() > b.pieces.size(); });
    for (const Step& step : steps) {
      if (step.pieces.size() * (allowed_ - chosen_.size()) < left) break;  // nor does any that follows suffice
      std::vector<bool> then = cut;
      for (const std::size_t i : step.pieces) then[i] = true;
      chosen_.emplace_back(step.way, step.pieces);
      if (go_on(then, left - step.pieces.size())) return true;
      chosen_.pop_back();
    }
    return false;
  }

  const SetupInput& in_;
  std::vector<Way> ways_;
  std::vector<Indices> pieces_over_;  // by fiducial: the pieces that would take it along
  std::vector<std::pair<const Way*, Indices>> chosen_;
  std::size_t allowed_ = 0;
  int steps_left_ = 0;
};

}  // namespace

Result<std::vector<PanelSetup>> plan_setups(const SetupInput& in) {
  const auto fits = [&](Millimetres along_x, Millimetres along_y) {
    return along_x <= in.reach.width() && along_y <= in.reach.height();
  };
  if (fits(in.width, in.height) || fits(in.height, in.width)) {
    PanelSetup all;
    for (const auto& piece : in.pieces) all.pieces.push_back(piece.piece);
    const bool straight = fits(in.width, in.height);
    const Isometry2<BedFrame, PanelFrame> turned(Radians(straight ? 0 : kPi / 2), {}, Handedness::kImproper);
    const Box<BedFrame> box = laid_box(in, turned);
    all.bed_from_panel = {turned.angle(),
                          {(in.reach.min.x + in.reach.max.x - box.min.x - box.max.x) / 2,
                           (in.reach.min.y + in.reach.max.y - box.min.y - box.max.y) / 2},
                          Handedness::kImproper};
    return std::vector{std::move(all)};
  }
  Search search(in);
  if (search.solve()) return search.result();
  return Error{
      ErrorCode::kRefused,
      fmt::format("panel {} is larger than the bed, and no way of laying it brings all its pieces within reach "
                  "with three uncut fiducials in view: glue more tags on its back and scan the back again",
                  in.panel.value)};
}

}  // namespace veneer::daemon
