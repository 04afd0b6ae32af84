// Rough costs: what a patch would cost on a candidate, from the means of a few dozen blocks instead of every pixel.
//
// With t and s the block means of target and wood, n the pixels of a block and e, r what each deviates from its block
// means (squared, summed; taken as uncorrelated), equation 4 is close to  n |t - s|^2 + e + r.  Any position and angle
// can be asked; a thousandth of a millisecond each. Exact costs decide (patch_pixels.h): this only says where to look.
// Arithmetic is in single precision in a fixed order, the same on every machine. Immutable; thread-safe.
#pragma once

#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/matching/matcher.h"

namespace veneer::planner {

// How the windows of some patches are cut into blocks, in working pixels.
struct RoughBlocks {
  explicit RoughBlocks(const PatchPixels& window);
  int columns, rows;
  double width, height;  // of a block
  std::size_t count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
};

// One panel, averaged over blocks.
class RoughPanel {
 public:
  // kCancelled: within a band of rows after a stop was requested.
  static Result<RoughPanel> make(const cv::Mat& features, const RoughBlocks& blocks, const std::stop_token& stop);

  // Numbers that describe one candidate: channels * blocks means, written `stride` apart. Returns |s|^2 + r / n.
  // (column, row) is where the window's centre lies, in panel pixels; cos and sin are those of its turn.
  std::size_t numbers() const { return static_cast<std::size_t>(channels_) * blocks_.count(); }
  float describe(double column, double row, double cos, double sin, float* to, std::size_t stride) const;

 private:
  RoughPanel(int channels, const RoughBlocks& blocks);

  RoughBlocks blocks_;
  int channels_, step_;  // panel pixels per pixel of the map
  cv::Mat map_;          // CV_32FC(channels + 1): means, and what deviates from them
};

struct RoughPatch {
  RoughPatch(const MatchPatch& patch, const RoughBlocks& blocks);
  std::vector<float> weights;  // -2 t
  double pixels = 0;           // n
  double fixed = 0;            // n |t|^2 + e
  // `score` is |s|^2 + r / n - 2 t.s
  double cost(double score) const { return fixed + pixels * score; }
};

// Scores of `count` candidates, described side by side (number k of candidate i at numbers[k * stride + i]; `stride` is
// a multiple of kCandidatesAtOnce, at least `count`, and everything up to it readable). squares[i]: what describe()
// returned.
inline constexpr std::size_t kCandidatesAtOnce = 64;
void score_candidates(const RoughPatch& patch, const float* numbers, const float* squares, std::size_t stride,
                      std::size_t count, float* scores);

}  // namespace veneer::planner
