// The cuts that were burnt and verified in one pose: while the panel lies as it did, they can be met again.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "daemon/unit/piece_burn.h"
#include "daemon/unit/proven_pose.h"

namespace veneer::daemon {

class KeptCuts {
 public:
  void begin(const ProvenPose& pose) { pose_ = pose, cuts_.clear(); }
  // Keeps the cut strokes only: engraving is not repeated.
  void add(const PieceBurn& burn) {
    PieceBurn& kept = cuts_.emplace_back(burn);
    std::erase_if(kept.strokes.strokes, [](const Stroke& stroke) { return stroke.role != StrokeRole::kCut; });
  }
  void forget() { pose_.reset(), cuts_.clear(); }

  bool empty() const { return cuts_.empty(); }
  int count() const { return static_cast<int>(cuts_.size()); }
  const ProvenPose& pose() const { return *pose_; }  // not when empty()
  const PieceBurn* find(const std::string& mark) const {
    const auto cut = std::find_if(cuts_.begin(), cuts_.end(), [&](const auto& c) { return c.mark == mark; });
    return cut == cuts_.end() ? nullptr : &*cut;
  }

 private:
  std::optional<ProvenPose> pose_;
  std::vector<PieceBurn> cuts_;
};

}  // namespace veneer::daemon
