#include "calib/change_of_light.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::calib {
namespace {

using Terms = ChangeOfLight::Terms;
constexpr int kTerms = Terms::channels;

struct SheetPoint {
  double x, y;  // -1 to 1
};
SheetPoint point_on_sheet(int row, int column, const cv::Size& size) {
  return {2.0 * column / size.width - 1, 2.0 * row / size.height - 1};
}

// The light: earlier level times a surface, a black level, and what bends the tone curve.
Terms light_terms(double level, const SheetPoint& at) {
  return {level, level * at.x,       level * at.y, level * at.x * at.x, level * at.x * at.y, level * at.y * at.y,
          1,     level * level / 255};
}
bool is_of_surface(int term) { return term >= 1 && term <= 5; }

Terms no_change() {
  Terms light = Terms::all(0);
  light[0] = 1;
  return light;
}

struct Sample {
  SheetPoint at;
  cv::Vec3b was, is;
};

// Means over small cells, in which noise and what is left between the maps count for less.
std::vector<Sample> untouched_samples(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched,
                                      double px_per_mm) {
  constexpr double kCell = 0.33;  // mm: fits in a web between two cuts
  constexpr int kMost = 40'000;
  const int fold = std::max(1, cvRound(kCell * px_per_mm));
  const cv::Size cells(before.cols / fold, before.rows / fold);
  if (cells.empty()) return {};
  const auto gathered = [&](const cv::Mat& map) {
    cv::Mat out;
    cv::resize(map(cv::Rect(0, 0, cells.width * fold, cells.height * fold)), out, cells, 0, 0, cv::INTER_AREA);
    return out;
  };
  const cv::Mat was = gathered(before), is = gathered(now), left = gathered(touched != 0) == 0;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(cv::countNonZero(left)) / kMost)));
  std::vector<Sample> out;
  for (int r = step / 2; r < cells.height; r += step)
    for (int c = step / 2; c < cells.width; c += step)
      if (left.at<std::uint8_t>(r, c) != 0)
        out.push_back({point_on_sheet(r, c, cells), was.at<cv::Vec3b>(r, c), is.at<cv::Vec3b>(r, c)});
  return out;
}

// Nearly all ninths of the sheet have some: then a surface of second order is not extrapolated.
bool lie_all_over(const std::vector<Sample>& samples) {
  constexpr int kFew = 50, kMostNinths = 7;
  std::array<int, 9> ninths{};
  for (const Sample& sample : samples) {
    const auto third = [](double along) {
      return std::min<std::size_t>(2, static_cast<std::size_t>((along + 1) * 1.5));
    };
    ++ninths[3 * third(sample.at.y) + third(sample.at.x)];
  }
  return std::ranges::count_if(ninths, [](int count) { return count >= kFew; }) >= kMostNinths;
}

bool are_of_many_tones(const std::vector<Sample>& samples, int channel) {
  constexpr int kMany = 40;          // grey levels
  constexpr double kLeftOut = 0.05;  // at either end
  std::array<std::size_t, 256> histogram{};
  for (const Sample& sample : samples) ++histogram[sample.was[channel]];
  const auto level_below_which = [&](double share) {
    std::size_t below = 0;
    int level = 0;
    while (level < 255 && static_cast<double>(below += histogram[static_cast<std::size_t>(level)]) <
                              share * static_cast<double>(samples.size()))
      ++level;
    return level;
  };
  return level_below_which(1 - kLeftOut) - level_below_which(kLeftOut) >= kMany;
}

// Least absolute deviations by reweighting, which what was cut or torn off does not sway.
Terms fit_change(const std::vector<Sample>& samples, int channel, bool all_over) {
  constexpr int kRounds = 10;
  constexpr double kSharp = 1.5;  // grey levels below which a difference counts in full
  const bool tones = all_over && are_of_many_tones(samples, channel);
  const auto is_asked = [&](int term) { return term == 0 || (is_of_surface(term) ? all_over : tones); };
  Terms light = no_change();
  for (int round = 0; round < kRounds; ++round) {
    cv::Matx<double, kTerms, kTerms> normal = decltype(normal)::zeros();
    Terms right = Terms::all(0);
    for (const Sample& sample : samples) {
      const Terms terms = light_terms(sample.was[channel], sample.at);
      const double is = sample.is[channel], off = std::abs(is - light.dot(terms));
      const double weight = 1 / (kSharp + off + (round > 2 ? off * off / 8 : 0));
      for (int i = 0; i < kTerms; ++i) {
        right[i] += weight * terms[i] * is;
        for (int k = 0; k < kTerms; ++k) normal(i, k) += weight * terms[i] * terms[k];
      }
    }
    for (int i = 0; i < kTerms; ++i) {
      // Held to no change where the sheet says nothing.
      const double hold = 1e-6 * (normal(i, i) + 1);
      normal(i, i) += hold, right[i] += i == 0 ? hold : 0;
      if (is_asked(i)) continue;
      for (int k = 0; k < kTerms; ++k) normal(i, k) = normal(k, i) = 0;
      normal(i, i) = 1, right[i] = 0;
    }
    cv::Mat solved;
    if (!cv::solve(cv::Mat(normal), cv::Mat(right), solved, cv::DECOMP_CHOLESKY)) break;
    for (int i = 0; i < kTerms; ++i) light[i] = solved.at<double>(i);
  }
  return light;
}

double level_in(const Terms& light, double level, const SheetPoint& at) { return light.dot(light_terms(level, at)); }

// No lamp drifts so far between two scans: a fit that says so was made of what is gone.
bool is_of_a_lamp(const Terms& light) {
  constexpr double kMostDrift = 0.4, kBlack = 20;  // of a level; grey levels
  for (const double x : {-1.0, 0.0, 1.0})
    for (const double y : {-1.0, 0.0, 1.0})
      for (const double level : {60.0, 120.0, 180.0})
        if (std::abs(level_in(light, level, {x, y}) - level) > kMostDrift * level + kBlack) return false;
  return true;
}

}  // namespace

ChangeOfLight learn_change_of_light(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched,
                                    double px_per_mm) {
  constexpr std::size_t kFewest = 30;  // 3 mm2
  ChangeOfLight out;
  out.sheet = before.size();
  const auto samples = untouched_samples(before, now, touched, px_per_mm);
  out.known = samples.size() >= kFewest;
  const bool all_over = lie_all_over(samples);
  for (int k = 0; k < 3 && out.known; ++k) {
    Terms& light = out.channels[static_cast<std::size_t>(k)] = fit_change(samples, k, all_over);
    // The channels are of one lamp.
    out.known = is_of_a_lamp(light);
  }
  if (!out.known) out.channels.fill(no_change());
  return out;
}

cv::Mat in_later_light(const ChangeOfLight& light, const cv::Mat& before, const cv::Point& at) {
  cv::Mat out(before.size(), CV_32FC3);
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const SheetPoint place = point_on_sheet(at.y + r, at.x + c, light.sheet);
      const auto& level = before.at<cv::Vec3f>(r, c);
      for (int k = 0; k < 3; ++k) {
        const double seen = level_in(light.channels[static_cast<std::size_t>(k)], level[k], place);
        out.at<cv::Vec3f>(r, c)[k] = static_cast<float>(std::clamp(seen, 0.0, 255.0));
      }
    }
  return out;
}

}  // namespace veneer::calib
