// How much of the pictures a wood may take (PlanOptions::material_limits): which limit wood falls under, and how much
// of each is used. Immutable but for MaterialUse; thread-safe.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "planner/plan.h"

namespace veneer::planner {

class MaterialLimits {
 public:
  static constexpr int kNone = -1;

  MaterialLimits() = default;
  MaterialLimits(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                 const std::vector<MaterialLimit>& limits);

  bool empty() const { return limits_.empty(); }
  std::size_t size() const { return limits_.size(); }
  const MaterialLimit& limit(std::size_t number) const { return limits_[number]; }
  SquareMillimetres whole() const { return whole_; }  // of all pictures
  SquareMillimetres most(std::size_t number) const { return whole_ * limits_[number].share; }

  // The number of the limit for a piece whose middle lies here; kNone.
  int at(int panel, const Point<PanelFrame>& middle) const;

  // All wood under a limit.
  struct Wood {
    int panel = 0;
    Ring<PanelFrame> outline;
  };
  std::vector<Wood> wood_under(int number) const;

 private:
  struct Zone {
    int number = kNone;
    Ring<PanelFrame> outline;
    Region<PanelFrame> region;
  };
  struct Panel {
    int number = kNone;  // of all of it
    Ring<PanelFrame> outline;
    std::vector<Zone> zones;
  };
  int number_of(const std::string& material) const;

  std::vector<MaterialLimit> limits_;
  SquareMillimetres whole_{};
  std::vector<Panel> panels_;
};

// What pieces take of each limited wood.
class MaterialUse {
 public:
  explicit MaterialUse(const MaterialLimits& limits) : limits_(&limits), used_(limits.size()) {}

  // kNone counts nowhere.
  void add(int number, SquareMillimetres area) {
    if (number != MaterialLimits::kNone) used_[static_cast<std::size_t>(number)] += area;
  }
  void remove(int number, SquareMillimetres area) { add(number, SquareMillimetres(0) - area); }
  SquareMillimetres used(std::size_t number) const { return used_[number]; }
  // Whether a piece of this area may take such wood too.
  bool has_room(int number, SquareMillimetres area) const {
    constexpr SquareMillimetres kRounding(1e-6);
    return number == MaterialLimits::kNone || used_[static_cast<std::size_t>(number)] + area <=
                                                  limits_->most(static_cast<std::size_t>(number)) + kRounding;
  }

 private:
  const MaterialLimits* limits_;
  std::vector<SquareMillimetres> used_;
};

// Of an outline, whichever way it runs.
SquareMillimetres area_of(const Ring<ArtworkFrame>& outline);
// The middle of an outline's bounds.
Point<ArtworkFrame> middle_of(const Ring<ArtworkFrame>& outline);

}  // namespace veneer::planner
