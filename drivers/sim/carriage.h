// Where the laser's carriage really goes: the axes' errors, what homing left, the belt's, and the play of a drive that
// turns round. Places are bed mm; MachineFrame of the cell is what was commanded.
//
// Not thread-safe; the World guards it.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/sim/cell_truth.h"
#include "drivers/sim/plane.h"

namespace veneer::sim {

class Carriage {
 public:
  Carriage() = default;
  Carriage(const Roughness& roughness, std::uint64_t seed);

  // The drive has homed for the nth time: all lies elsewhere.
  void homed(int number);
  // The motors went straight from one place to another (dark or burning). The way of the carriage: at least where it
  // begins and ends, and the places between at which an axis has taken up its play. `share` is how much of the motors'
  // way lies behind at each, `lost_mm` how much of it went into play since the place before.
  struct Place {
    Vec2 bed;
    double share = 0, lost_mm = 0;
  };
  std::vector<Place> follow(const MachineAxes& axes, Vec2 from, Vec2 to);

 private:
  Vec2 place(const MachineAxes& axes, Vec2 commanded) const;

  Roughness roughness_;
  std::uint64_t seed_ = 0;
  Vec2 belt_phase_;
  Vec2 scatter_;
  Vec2 lag_;  // of the carriage behind its motor, at most half the play either way, in commanded mm
};

}  // namespace veneer::sim
