// Calibration and a look at the bed, played on what the twin's seed draws, but without pictures: corners and rings are
// where the twin's camera truly sees them, give or take its noise. A cell in some hundredths of a second instead of
// minutes, so that a figure can be told over hundreds of seeds.
#pragma once

#include <cstdint>
#include <optional>

#include "base/calibration_pattern.h"
#include "base/result.h"
#include "drivers/sim/roughness.h"

namespace veneer::tests {

// What somebody with a caliper, a hand on the board and a rule knows beforehand.
struct PlayedHands {
  double caliper_mm = 0.02;    // how far a reading may be off
  bool measures_board = true;  // otherwise boards are taken for 2.1 mm
};

struct SightFigures {
  double board_thickness_mm = 0, board_bow_x_mm = 0, board_bow_y_mm = 0;  // as they truly are
  double axes_rms_mm = 0;                                                 // as the certificate says
  double frame_rms_mm = 0;  // true places of the bed against what the cell says of them, over where panels lie
  double pose_rms_mm = 0;   // the worst of the panels laid, as the proof judges it
  double cut_rms_mm = 0;    // and where the laser then goes against where the wood lies
};

// kRefused and so on as the cell would say.
Result<SightFigures> play_sight(std::uint64_t seed, const sim::Roughness& rough, const PlayedHands& hands);

// Places that an error was predicted for, against what it truly is.
struct PredictedFigures {
  int places = 0, within = 0, by_residual = 0;  // within twice the prediction; within twice the fit's own residual
  double predicted_sum = 0, squares_sum = 0;

  void add(double miss_mm, double predicted_mm, double residual_mm) {
    ++places, within += miss_mm <= 2 * predicted_mm ? 1 : 0, by_residual += miss_mm <= 2 * residual_mm ? 1 : 0;
    predicted_sum += predicted_mm, squares_sum += miss_mm * miss_mm;
  }
  double share() const { return static_cast<double>(within) / places; }
  double share_by_residual() const { return static_cast<double>(by_residual) / places; }
  double predicted_mm() const { return predicted_sum / places; }  // mean
  double true_mm() const;                                         // rms
};

// What an axes certificate says of itself, against where the laser truly burns, over all places that it reaches. Its
// camera sees as exactly as it is known, so that nothing but the pattern counts.
struct AxesFigures {
  double said_mm = 0;  // the certificate's left_out_rms_mm
  double true_mm = 0;  // rms
  int places = 0, within_two_sigma = 0;
  PredictedFigures measured, beyond;  // by what it predicts place by place: near rings, and farther off
};
Result<AxesFigures> play_axes_certificate(std::uint64_t seed, const sim::Roughness& rough, RingSpacing spacing);

}  // namespace veneer::tests
