// How much of the pictures a wood may take (PlanOptions::material_limits): which limits wood falls under, and how much
// of each is used. Immutable but for MaterialUse; thread-safe.
//
// Zones of a panel may reach into each other. Nobody knows whose the wood is that lies in several (stock.h), so it
// counts for all of them, and no limit is exceeded whosever it is.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "planner/plan.h"

namespace veneer::planner {

// Some of the limits, by their numbers.
class LimitSet {
 public:
  static constexpr std::size_t kMost = 64;  // limits of a plan

  bool empty() const { return bits_ == 0; }
  bool has(std::size_t number) const { return (bits_ >> number & 1) != 0; }
  std::size_t first() const { return static_cast<std::size_t>(std::countr_zero(bits_)); }  // of one that is not empty
  bool meets(LimitSet other) const { return (bits_ & other.bits_) != 0; }
  void add(std::size_t number) { bits_ |= std::uint64_t{1} << number; }
  friend LimitSet operator|(LimitSet a, LimitSet b) { return LimitSet(a.bits_ | b.bits_); }
  friend bool operator==(LimitSet, LimitSet) = default;

  LimitSet() = default;

 private:
  explicit LimitSet(std::uint64_t bits) : bits_(bits) {}
  std::uint64_t bits_ = 0;
};

class MaterialLimits {
 public:
  MaterialLimits() = default;
  MaterialLimits(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                 const std::vector<MaterialLimit>& limits);

  bool empty() const { return limits_.empty(); }
  std::size_t size() const { return limits_.size(); }
  const MaterialLimit& limit(std::size_t number) const { return limits_[number]; }
  SquareMillimetres whole() const { return whole_; }  // of all pictures
  SquareMillimetres most(std::size_t number) const { return whole_ * limits_[number].share; }

  // The limits for a piece whose middle lies here.
  LimitSet at(int panel, const Point<PanelFrame>& middle) const;
  // The limits for a piece of this outline that lies there.
  LimitSet of(const Ring<ArtworkFrame>& outline, int panel,
              const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork) const;

  // All wood under a limit.
  struct Wood {
    int panel = 0;
    Ring<PanelFrame> outline;
  };
  std::vector<Wood> wood_under(std::size_t number) const;
  // Whether there may be wood under no limit: of several zones that is not known for sure.
  bool has_other_wood() const;
  // Groups of wood that each patch should have places of, as many in each (at least one): what is under no limit, and
  // what is under each; of zones that reach into each other, under the first of them.
  std::size_t groups() const { return limits_.size() + 1; }
  std::size_t group_at(int panel, const Point<PanelFrame>& middle) const {
    const LimitSet under = at(panel, middle);
    return under.empty() ? 0 : under.first() + 1;
  }

 private:
  struct Zone {
    std::size_t number;
    Ring<PanelFrame> outline;
    Region<PanelFrame> region;
  };
  struct Panel {
    LimitSet whole;  // of all of it
    Ring<PanelFrame> outline;
    std::vector<Zone> zones;
  };
  std::optional<std::size_t> number_of(const std::string& material) const;

  std::vector<MaterialLimit> limits_;
  SquareMillimetres whole_{};
  std::vector<Panel> panels_;
};

// What pieces take of each limited wood.
class MaterialUse {
 public:
  MaterialUse() = default;  // of no limits
  explicit MaterialUse(const MaterialLimits& limits) : limits_(&limits), used_(limits.size()) {}

  void add(LimitSet under, SquareMillimetres area) {
    for (std::size_t i = 0; i < used_.size(); ++i)
      if (under.has(i)) used_[i] += area;
  }
  void remove(LimitSet under, SquareMillimetres area) { add(under, SquareMillimetres(0) - area); }
  SquareMillimetres used(std::size_t number) const { return used_[number]; }
  // Of the limits that such wood is under, those that a piece of this area would exceed.
  LimitSet refused(LimitSet under, SquareMillimetres area) const {
    LimitSet out;
    if (under.empty()) return out;
    for (std::size_t i = 0; i < used_.size(); ++i)
      if (under.has(i) && used_[i] + area > limits_->most(i) + kRounding) out.add(i);
    return out;
  }
  bool has_room(LimitSet under, SquareMillimetres area) const { return refused(under, area).empty(); }
  // Whether more is used than may be: by pieces that are kept.
  bool is_exceeded(std::size_t number) const { return used_[number] > limits_->most(number) + kRounding; }

 private:
  static constexpr SquareMillimetres kRounding{1e-6};
  const MaterialLimits* limits_ = nullptr;
  std::vector<SquareMillimetres> used_;
};

// Of an outline, whichever way it runs.
SquareMillimetres area_of(const Ring<ArtworkFrame>& outline);
// The middle of an outline's bounds.
Point<ArtworkFrame> middle_of(const Ring<ArtworkFrame>& outline);

}  // namespace veneer::planner
