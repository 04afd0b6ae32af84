// The cuts that were burnt and verified in one pose: while the panel lies as it did, and machine and camera tell places
// as they did, they can be met again. Homing the laser anew changes neither.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "daemon/unit/piece_burn.h"
#include "daemon/unit/proven_pose.h"

namespace veneer::daemon {

class KeptCuts {
 public:
  // On what a run stood.
  struct Basis {
    JobId job;
    std::vector<CertificateId> certificates;
    std::string laser;  // LaserLimits::identity
  };
  void begin(const ProvenPose& pose, Basis basis) { pose_ = pose, basis_ = std::move(basis), cuts_.clear(); }
  // Keeps the cut strokes only: engraving is not repeated.
  void add(const PieceBurn& burn) {
    PieceBurn& kept = cuts_.emplace_back(burn);
    std::erase_if(kept.strokes.strokes, [](const Stroke& stroke) { return stroke.role != StrokeRole::kCut; });
  }
  void forget() { pose_.reset(), cuts_.clear(); }

  bool empty() const { return cuts_.empty(); }
  int count() const { return static_cast<int>(cuts_.size()); }
  const ProvenPose& pose() const { return *pose_; }  // not when empty(), nor the basis
  const Basis& basis() const { return basis_; }
  const PieceBurn* find(const std::string& mark) const {
    const auto cut = std::find_if(cuts_.begin(), cuts_.end(), [&](const auto& c) { return c.mark == mark; });
    return cut == cuts_.end() ? nullptr : &*cut;
  }

 private:
  std::optional<ProvenPose> pose_;
  Basis basis_;
  std::vector<PieceBurn> cuts_;
};

}  // namespace veneer::daemon
