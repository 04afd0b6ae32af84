// The cuts that were burnt and verified in one pose: while the panel lies as it did, and machine and camera tell places
// as they did, they can be met again. Homing the laser anew changes neither, nor does a restart of this program: they
// are in the database, too, written with the booking of their pieces (db::KeptCut).
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
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
  // Keeps the cut strokes only: engraving is not repeated. After forget() none until the next run begins: what was cut
  // stands on a pose that is in doubt.
  void add(const PieceBurn& burn) {
    if (begun()) cuts_.push_back({burn.piece, burn.mark, cut_strokes(burn), burn.seconds});
  }
  void forget() { pose_.reset(), cuts_.clear(); }

  // As the booking of `burn` in `run` writes it, its places in whole micrometres, and what was written of the last run;
  // none where it cannot be met again.
  static db::KeptCut to_record(const PieceBurn& burn, db::RunId run, const std::string& laser);
  static Result<KeptCuts> read(Repositories& r);

  bool begun() const { return pose_.has_value(); }  // by a run, or read
  bool empty() const { return cuts_.empty(); }
  int count() const { return static_cast<int>(cuts_.size()); }
  const ProvenPose& pose() const { return *pose_; }  // not when empty(), nor the basis
  const Basis& basis() const { return basis_; }
  const PieceBurn* find(const std::string& mark) const {
    const auto cut = std::find_if(cuts_.begin(), cuts_.end(), [&](const auto& c) { return c.mark == mark; });
    return cut == cuts_.end() ? nullptr : &*cut;
  }

 private:
  static LaserJob cut_strokes(const PieceBurn& burn) {
    LaserJob cuts = burn.strokes;
    std::erase_if(cuts.strokes, [](const Stroke& stroke) { return stroke.role != StrokeRole::kCut; });
    return cuts;
  }

  std::optional<ProvenPose> pose_;
  Basis basis_;
  std::vector<PieceBurn> cuts_;
};

}  // namespace veneer::daemon
