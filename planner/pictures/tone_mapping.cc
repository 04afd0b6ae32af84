#include "planner/pictures/tone_mapping.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

constexpr double kCoarsePatch = 12;            // pixels of a patch in the raster in which detail is looked for
constexpr double kFine = 0.25, kSurround = 2;  // patches: standard deviations between which detail lies
constexpr double kEnds = 0.01;                 // share of a picture that is darker, or paler, than its range
constexpr double kWoodEnds = 0.03;             // the same of the wood: less than this is soon used up
constexpr double kPlain = 4.0 / 255;           // a range of tones that is none

struct ToneRange {
  double dark = 0, pale = 0;
};

ToneRange range_of(const GreyHistogram& histogram, double ends) {
  const double all = histogram.total();
  ToneRange out{0, 1};
  double below = 0;
  for (std::size_t i = 0; i < histogram.counts.size(); ++i) {
    const double value = static_cast<double>(i) / 255;
    if (below <= ends * all) out.dark = value;
    if (below < (1 - ends) * all) out.pale = value;
    below += histogram.counts[i];
  }
  return out;
}

}  // namespace

cv::Mat set_off(const cv::Mat& grey, Pixels patch, double w_detail) {
  if (w_detail <= 0) return grey;
  const double scale = std::min(1.0, kCoarsePatch / patch.count());
  const cv::Size size(std::max(1, cvRound(grey.cols * scale)), std::max(1, cvRound(grey.rows * scale)));
  const double coarse_patch = patch.count() * scale;
  cv::Mat coarse, fine, surround, detail;
  cv::resize(grey, coarse, size, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(coarse, fine, {}, std::max(0.3, kFine * coarse_patch));
  cv::GaussianBlur(coarse, surround, {}, std::max(0.6, kSurround * coarse_patch));
  cv::resize(fine - surround, detail, grey.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat out = grey + w_detail * detail;
  cv::min(out, 1.0, out), cv::max(out, 0.0, out);
  return out;
}

cv::Mat stretch_tones(const cv::Mat& grey, const GreyHistogram& wood, double w_range) {
  if (w_range <= 0 || wood.total() <= 0) return grey;
  GreyHistogram own;
  own.add(grey);
  const ToneRange from = range_of(own, kEnds), to = range_of(wood, kWoodEnds);
  if (from.pale - from.dark < kPlain || to.pale - to.dark < kPlain) return grey;
  const double gain = (to.pale - to.dark) / (from.pale - from.dark);
  cv::Mat laid = (grey - from.dark) * gain + to.dark;
  cv::min(laid, to.pale, laid), cv::max(laid, to.dark, laid);
  return (1 - w_range) * grey + w_range * laid;
}

}  // namespace veneer::planner
