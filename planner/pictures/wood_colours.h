// Gamut mapping of colours, beside that of tones (histogram.h).
//
// Wood has few colours, and one tone of grey may be tan oak or red padauk. The wood's *tone line* says which colour
// stands for each tone: a smooth line through its colours, from dark to pale, that keeps to where most of the wood is.
// A picture has such a line too, the mean of its colours at each tone. What it looks for is the wood's line at the tone
// that it looks for, plus what the picture deviates from its own line, no farther than the wood does from its. So a
// face is made of one family of woods, and what is redder than the rest of the picture may be redder wood.
//
// Colours are a* and b* of CIELAB. Pure functions.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "planner/pictures/histogram.h"

namespace veneer::planner {

// CV_32FC2: a* and b* of a CV_8UC3 BGR picture.
cv::Mat chroma_of(const cv::Mat& bgr);

// How much there is of each tone and colour.
class ColourCounts {
 public:
  ColourCounts();
  // Counts some of the pixels of a CV_8UC3 BGR picture, each `weight` times, with its CV_32FC1 grey values in [0, 1];
  // with a CV_8UC1 mask only where it is non-zero. kCancelled: a stop was requested.
  Status add(const cv::Mat& bgr, const cv::Mat& grey, const cv::Mat& mask, double weight, const std::stop_token& stop);

  static constexpr int kTones = 64, kSide = 20;
  static int tone_of(float grey);
  static cv::Vec2f colour_of(int cell);  // the middle of a cell of colours
  static constexpr int kCells = kSide * kSide;
  double at(int tone, int cell) const { return counts_[static_cast<std::size_t>(tone * kCells + cell)]; }
  double total() const;

 private:
  std::vector<double> counts_;  // [tone][cell]
};

struct ToneLine {
  std::array<cv::Vec2f, ColourCounts::kTones> colours{};
  double spread = 0;  // root mean square of what colours deviate from it
  cv::Vec2f at(float grey) const;
};

// Without any pixel all is grey.
ToneLine tone_line(const ColourCounts& wood);
ToneLine mean_line(const ColourCounts& picture);

// The tones of wood, where what is far from the line in colour counts for less: by w_gamut, in [0, 1].
GreyHistogram tones_near(const ColourCounts& wood, const ToneLine& line, double w_gamut);

// What a picture looks for: CV_32FC2. `chroma` and `grey` are its own, `intensity` is its tones after their mapping;
// w_gamut in [0, 1] says how far colours are mapped.
cv::Mat match_colours(const cv::Mat& chroma, const cv::Mat& grey, const cv::Mat& intensity, const ToneLine& own,
                      const ToneLine& wood, double w_gamut);

}  // namespace veneer::planner
