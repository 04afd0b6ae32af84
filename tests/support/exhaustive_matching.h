// Exhaustive matching, as anybody would write it with OpenCV: every place of every panel and rotation by matchTemplate
// (TM_SQDIFF in the spectrum), one call a channel. What the matcher is measured against, for its answers and its time.
//
// Patches that do not fill their windows are matched with a mask. Candidates are the matcher's: lattice pixels
// (lattice.h). A place is looked at when the centres of all its pixels lie on pixels of the stock raster that are free;
// what may be taken is then decided by FreeWood, so that the answer follows the planner's own rule.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "planner/matching/matcher.h"

namespace veneer::planner::test {

class ExhaustiveMatching {
 public:
  // Makes the turned copies of the panels. `panels` must outlive this.
  ExhaustiveMatching(std::span<const MatchPanel> panels, const std::vector<Radians>& turns, int threads);

  struct Answer {
    std::optional<LatticeCandidate> best;
    // For the template matching and the search of the smallest value, on `threads` threads; without what could be
    // prepared (turned maps, eroded masks) and without the planner's own test of the place.
    double seconds = 0;
    double cpu_seconds = 0;  // the same in processor time of all threads
  };
  // The best place among all that may be taken; equal costs are decided as LatticeCandidate is ordered.
  Answer best(const MatchPatch& patch);

 private:
  struct Turned {
    int panel, rotation;
    Lattice lattice;
    std::vector<cv::Mat> channels;  // CV_32FC1
    cv::Mat free;                   // CV_8UC1: the centre of the lattice pixel lies on free wood
    cv::Mat allowed;                // the same eroded by windows of window_, one entry a place
    cv::Mat costs;                  // of the patch last asked for
  };
  void erode(cv::Size window);
  // `counts`: which pixels of the window count, CV_32FC1; empty: all of them.
  void match(Turned& turned, const std::vector<cv::Mat>& target, const cv::Mat& counts) const;
  void allow(const cv::Mat& counts);
  std::optional<LatticeCandidate> cheapest_that_may_be_taken(const MatchPatch& patch, double slack) const;

  std::span<const MatchPanel> panels_;
  int threads_;
  cv::Size window_;
  std::vector<Turned> turned_;
};

}  // namespace veneer::planner::test
