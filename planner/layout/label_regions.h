// A raster of labels made fit to be cut: every label one simply connected region, none too small, none too thin.
//
// Labels are CV_32SC1, from 0; pixels that share a side are neighbours. Lengths are pixels. Every rule is fixed: what
// must go goes to the neighbour with which it shares the longest border, of several to the one with the lowest number.
// Pure functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace veneer::planner {

struct LabelLimits {
  double width = 0;  // no part of a region is thinner
  double area = 0;   // no region is smaller
};

// Gives each part of equal labels that hangs together a number of its own, from above and from the left. Returns how
// many there are.
int number_regions(cv::Mat& labels);

// The same where nothing hangs together over pixels of `barrier` (CV_8UC1, not 0), which then belong to the nearest
// region beside them. Numbers may be left out.
void part_regions(cv::Mat& labels, const cv::Mat& barrier);

// Parts that do not hang together with the largest part of their label go to their neighbours. Over pixels of `barrier`
// (CV_8UC1, not 0; may be empty) nothing hangs together; they go to whatever lies beside them, and over the barrier
// only where nothing else does.
void absorb_stray_parts(cv::Mat& labels, const cv::Mat& barrier);

// Regions that `drop` names, by number, go to their neighbours, but for those that took in another one of them on the
// way: they may be large enough now. The first that has a neighbour goes. `labels` as number_regions() leaves them.
void absorb_regions(cv::Mat& labels, const std::vector<int>& drop);

// What a region encloses becomes its own, so that all regions are simply connected.
void fill_holes(cv::Mat& labels);

// Regions numbered from 0 that keep to the limits, as far as a raster can tell, and are simply connected, without
// exception. Necks are cut through, thin parts go to neighbours, so do regions that are too small; what surrounds
// another region is cut in two. Returns how many there are.
int clean_regions(cv::Mat& labels, const LabelLimits& limits);

}  // namespace veneer::planner
