#include "calib/wood_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>
#include <vector>

#include "calib/work_map.h"

namespace veneer::calib {
namespace {

cv::Mat blurred(const cv::Mat& picture, double sigma_px) {
  cv::Mat out;
  cv::GaussianBlur(picture, out, {}, sigma_px);
  return out;
}

// Lightness and two colour differences, in which a scanner's and JPEG's noise is next to independent.
std::array<cv::Mat, 3> opponents(const cv::Mat& bgr) {
  cv::Mat rotated;
  const cv::Matx33f turn(0.57735F, 0.57735F, 0.57735F, -0.70711F, 0, 0.70711F, -0.40825F, 0.81650F, -0.40825F);
  cv::transform(bgr, rotated, turn);
  std::array<cv::Mat, 3> out;
  cv::split(rotated, out.data());
  return out;
}

// How far means over windows lie outside of what noise makes of them: about chi squared with three degrees of freedom.
class WindowScore {
  // Sigma of a pixel. Less: JPEG's coarse steps of colour are no noise that a median sees. More: what is learnt is the
  // loss of most of a wood.
  static constexpr float kLeast = 0.3F, kMost = 0.7F;
  // Of a level, one sigma: what is left of the light's change.
  static constexpr float kLight = 0.005F;

 public:
  WindowScore(const UnchangedLook& look, const cv::Mat& z, double sigma_px) : look_(look), sigma_px_(sigma_px) {
    const auto planes = opponents(z);
    for (std::size_t k = 0; k < 3; ++k) {
      scale_[k] = middles(cv::abs(blurred(planes[k], sigma_px)), look.kinds, look.touched);
      for (int i = 0; i < kKinds; ++i)
        scale_[k][i] = static_cast<float>(kSigmaOfMad) * std::clamp(scale_[k][i], kLeast, kMost);
    }
  }
  cv::Mat of(const cv::Mat& z) const {
    auto planes = opponents(z), lights = opponents(look_.expected / look_.noise);
    for (std::size_t k = 0; k < 3; ++k)
      planes[k] = blurred(planes[k], sigma_px_), lights[k] = blurred(lights[k], sigma_px_);
    cv::Mat out(z.size(), CV_32FC1);
    for (int r = 0; r < z.rows; ++r)
      for (int c = 0; c < z.cols; ++c) {
        cv::Vec3f u, light;
        for (std::size_t k = 0; k < 3; ++k) {
          const float scale = scale_[k][look_.kinds.at<std::uint8_t>(r, c)];
          u[static_cast<int>(k)] = planes[k].at<float>(r, c) / scale;
          light[static_cast<int>(k)] = kLight * lights[k].at<float>(r, c) / scale;
        }
        // Mahalanobis' distance with the light's covariance added to the noise's (Sherman and Morrison).
        const float along = u.dot(light);
        out.at<float>(r, c) = u.dot(u) - along * along / (1 + light.dot(light));
      }
    return out;
  }

 private:
  const UnchangedLook& look_;
  double sigma_px_;
  std::array<cv::Vec<float, kKinds>, 3> scale_{};
};

// What differs within windows, pixel by pixel, more than noise does: grain that has gone, or come. Chi squared with one
// degree of freedom, about.
class GrainScore {
 public:
  GrainScore(const UnchangedLook& look, const cv::Mat& z, double sigma_px) : look_(look), sigma_px_(sigma_px) {
    const cv::Mat energy = log_energy(z);
    constexpr float kMost = 2.5F;  // as above: noise alone makes a little more than log 3
    middle_ = middles(energy, look.kinds, look.touched);
    for (int i = 0; i < kKinds; ++i) middle_[i] = std::min(middle_[i], kMost);
    cv::Mat off(energy.size(), CV_32FC1);
    for (int r = 0; r < off.rows; ++r)
      for (int c = 0; c < off.cols; ++c)
        off.at<float>(r, c) = std::abs(energy.at<float>(r, c) - middle_[look.kinds.at<std::uint8_t>(r, c)]);
    spread_ = middles(off, look.kinds, look.touched);
  }
  cv::Mat of(const cv::Mat& z) const {
    constexpr float kLeast = 0.15F, kMost = 0.6F;
    cv::Mat energy = log_energy(z);
    for (int r = 0; r < z.rows; ++r)
      for (int c = 0; c < z.cols; ++c) {
        const int kind = look_.kinds.at<std::uint8_t>(r, c);
        float& e = energy.at<float>(r, c);
        const float u =
            (e - middle_[kind]) / (static_cast<float>(kSigmaOfMad) * std::clamp(spread_[kind], kLeast, kMost));
        e = u < 0 ? 0 : u * u;
      }
    return energy;
  }

 private:
  cv::Mat log_energy(const cv::Mat& z) const {
    cv::Mat energy, out;
    cv::transform(z.mul(z), energy, cv::Matx13f(1, 1, 1));
    cv::log(blurred(cv::min(energy, 100), sigma_px_) + 1e-3, out);
    return out;
  }
  const UnchangedLook& look_;
  double sigma_px_;
  cv::Vec<float, kKinds> middle_, spread_;
};

// Of the parts of `low`, those that have a place of `high`.
cv::Mat parts_with(const cv::Mat& low, const cv::Mat& high) {
  cv::Mat labels, out = cv::Mat::zeros(low.size(), CV_8UC1);
  const int count = cv::connectedComponents(low, labels, 8);
  std::vector<std::uint8_t> has(static_cast<std::size_t>(count), 0);
  for (int r = 0; r < low.rows; ++r)
    for (int c = 0; c < low.cols; ++c)
      if (high.at<std::uint8_t>(r, c) != 0) has[static_cast<std::size_t>(labels.at<int>(r, c))] = 255;
  has[0] = 0;
  for (int r = 0; r < low.rows; ++r)
    for (int c = 0; c < low.cols; ++c) out.at<std::uint8_t>(r, c) = has[static_cast<std::size_t>(labels.at<int>(r, c))];
  return out;
}

// The parts that lie in `where` for the greater part: specks of dust make no opening of the noise around them.
cv::Mat mostly(const cv::Mat& parts, const cv::Mat& where) {
  constexpr double kMost = 0.5;
  cv::Mat labels, out = cv::Mat::zeros(parts.size(), CV_8UC1);
  const auto count = static_cast<std::size_t>(cv::connectedComponents(parts, labels, 8));
  std::vector<int> all(count, 0), in(count, 0);
  for (int r = 0; r < parts.rows; ++r)
    for (int c = 0; c < parts.cols; ++c) {
      const auto i = static_cast<std::size_t>(labels.at<int>(r, c));
      ++all[i], in[i] += where.at<std::uint8_t>(r, c) != 0 ? 1 : 0;
    }
  for (int r = 0; r < parts.rows; ++r)
    for (int c = 0; c < parts.cols; ++c) {
      const auto i = static_cast<std::size_t>(labels.at<int>(r, c));
      if (i > 0 && in[i] > kMost * all[i]) out.at<std::uint8_t>(r, c) = 255;
    }
  return out;
}

cv::Mat summed(const cv::Mat& m) {
  cv::Mat s;
  cv::transform(m, s, cv::Matx13f(1, 1, 1));
  return s;
}

// What is seen as the wood darkened by one factor, as smoke and char do.
cv::Mat smoked(const UnchangedLook& look, const cv::Mat& is, double px_per_mm) {
  constexpr double kWindow = 0.15, kBlackest = 0.45;  // mm
  cv::Mat both, square, gain;
  const cv::Mat noise2 = look.noise.mul(look.noise);
  cv::divide(is.mul(look.expected), noise2, both);
  cv::divide(look.expected.mul(look.expected), noise2, square);
  cv::divide(blurred(summed(both), kWindow * px_per_mm), blurred(summed(square), kWindow * px_per_mm) + 1e-3, gain);
  gain = cv::min(cv::max(gain, kBlackest), 1.0);
  cv::merge(std::vector<cv::Mat>{gain, gain, gain}, gain);
  return look.expected.mul(gain);
}

// Means of `picture` over what lies in `where` nearby.
cv::Mat local_mean(const cv::Mat& picture, const cv::Mat& where, double sigma_px, cv::Mat& weight) {
  cv::Mat w, w3, sum, out;
  where.convertTo(w, CV_32F, 1.0 / 255);
  cv::merge(std::vector<cv::Mat>{w, w, w}, w3);
  sum = blurred(picture.mul(w3), sigma_px);
  weight = blurred(w, sigma_px);
  cv::merge(std::vector<cv::Mat>{weight, weight, weight}, w3);
  cv::divide(sum, w3 + 1e-6, out);
  return out;
}

// The border where it costs least: each place of a part is one that is gone or one that is not, neighbours that look
// alike together. `cost` > 0 speaks for gone.
void cut_border(const cv::Mat& cost, const cv::Mat& is, const cv::Mat& labels, int label, const cv::Rect& box,
                int places, cv::Mat& gone) {
  constexpr double kTogether = 1.2, kEdge = 25;  // grey levels
  const auto in = [&](int r, int c) {
    return r >= 0 && c >= 0 && r < box.height && c < box.width && labels.at<int>(box.y + r, box.x + c) == label;
  };
  cv::detail::GCGraph<double> graph(places, 8 * places);
  cv::Mat node(box.size(), CV_32SC1, cv::Scalar(-1));
  for (int r = 0; r < box.height; ++r)
    for (int c = 0; c < box.width; ++c)
      if (in(r, c)) {
        const int v = node.at<int>(r, c) = graph.addVtx();
        double gain = cost.at<float>(box.y + r, box.x + c);
        // What lies beside the part is not gone.
        const bool rim = !in(r - 1, c) || !in(r + 1, c) || !in(r, c - 1) || !in(r, c + 1);
        if (rim) gain -= kTogether;
        graph.addTermWeights(v, std::max(0.0, gain), std::max(0.0, -gain));
      }
  const auto tie = [&](int r, int c, int r2, int c2, double share) {
    if (!in(r, c) || !in(r2, c2)) return;
    const cv::Vec3f d = is.at<cv::Vec3f>(box.y + r, box.x + c) - is.at<cv::Vec3f>(box.y + r2, box.x + c2);
    const double w = share * kTogether * (0.1 + 0.9 * std::exp(-d.dot(d) / (2 * kEdge * kEdge)));
    graph.addEdges(node.at<int>(r, c), node.at<int>(r2, c2), w, w);
  };
  for (int r = 0; r < box.height; ++r)
    for (int c = 0; c < box.width; ++c) {
      tie(r, c, r, c + 1, 0.6), tie(r, c, r + 1, c, 0.6);
      tie(r, c, r + 1, c + 1, 0.4), tie(r, c + 1, r + 1, c, 0.4);
    }
  graph.maxFlow();
  for (int r = 0; r < box.height; ++r)
    for (int c = 0; c < box.width; ++c)
      if (node.at<int>(r, c) >= 0 && graph.inSourceSegment(node.at<int>(r, c)))
        gone.at<std::uint8_t>(box.y + r, box.x + c) = 255;
}

}  // namespace

WoodChange find_changes(const UnchangedLook& look, const cv::Mat& now, const cv::Mat& booked, const cv::Mat& marked,
                        double px_per_mm) {
  constexpr double kLow = 16, kHigh = 40;
  constexpr double kSmoke = 1.2;  // mm
  constexpr double kSmokeRare = 4;
  constexpr double kItself = 16, kInside = 0.7, kFull = 0.7;       // chi squared of a pixel; mm; share
  constexpr float kDependent = 0.3F;                               // neighbours' noise is
  constexpr float kDecided = 40, kUnseen = 16;                     // chi squared of a pixel
  constexpr float kFar = 30, kMixed = 0.15F, kBorder = 1.7F;       // grey levels; shares of the distance to the opening
  constexpr double kCandidate = 0.35, kCore = 0.2, kNearby = 0.8;  // mm
  constexpr double kNarrow = 0.6, kFlank = 0.4;                    // mm, half a slot's width; share
  cv::Mat is;
  now.convertTo(is, CV_32F);
  const cv::Mat z = (is - look.expected) / look.noise;
  const WindowScore fine(look, z, 0.18 * px_per_mm), wide(look, z, 0.5 * px_per_mm);
  const GrainScore grainy(look, z, 0.3 * px_per_mm);
  const cv::Mat fine_score = fine.of(z), wide_score = wide.of(z), grain = grainy.of(z);
  const cv::Mat zs = (is - smoked(look, is, px_per_mm)) / look.noise;
  const cv::Mat smoke_score = cv::max(fine.of(zs), grainy.of(zs));

  const cv::Mat most = cv::max(cv::max(fine_score, wide_score), grain);
  cv::Mat unlike = parts_with(fine_score > kLow, most > kHigh);
  unlike |= parts_with(cv::max(wide_score, grain) > kLow, most > kHigh) & (fine_score > kLow / 4);
  unlike.setTo(0, marked);
  // Smoke darkens wood beside an opening, no farther than it gets: what is deeper in is no smoke, nor what has none
  // near.
  cv::Mat depth, away, candidate, core, weight, labels, stats, centres;
  cv::distanceTransform(unlike, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat deep = depth > kSmoke * px_per_mm, same = summed(z.mul(z));
  cv::erode(unlike & (most > kHigh) & (deep | (smoke_score > kLow)), core, round_kernel(kCore * px_per_mm));
  cv::distanceTransform(~(core | booked), away, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat may_be_smoke = ~deep & (away < kSmoke * px_per_mm);
  // What is seen where it is gone: the look of the inside nearby. A window reaches beyond what it sees and a border is
  // a mixture, so places count that differ by themselves, and about as much as any nearby. A part too narrow to have an
  // inside is its own.
  cv::Mat by, most_by;
  cv::sqrt(summed((is - look.expected).mul(is - look.expected)), by);
  cv::GaussianBlur(by, by, {}, 0.5);
  cv::dilate(by, most_by, round_kernel(kCandidate * px_per_mm));
  const cv::Mat itself = ((same > kItself) | (depth > kInside * px_per_mm)) & (by > kFull * most_by);
  core &= itself;
  core |= unlike & itself & ~parts_with(unlike, core);
  core |= unlike & ~parts_with(unlike, core);
  cv::dilate(unlike, candidate, round_kernel(kCandidate * px_per_mm));
  const cv::Mat opening = local_mean(is, core, kNearby * px_per_mm, weight);
  cv::Mat spread = local_mean(is.mul(is), core, kNearby * px_per_mm, weight) - opening.mul(opening);
  spread = cv::max(spread, 0) + look.noise.mul(look.noise);
  const cv::Mat off = is - opening;
  cv::Mat zo, wider;
  cv::divide(off.mul(off), spread, zo);
  cv::divide(spread, look.noise.mul(look.noise), wider);
  cv::log(wider, wider);
  const cv::Mat smoke = summed(zs.mul(zs)) + kSmokeRare, other = summed(zo) + summed(wider);
  cv::Mat cost(now.size(), CV_32FC1);
  for (int r = 0; r < cost.rows; ++r)
    for (int c = 0; c < cost.cols; ++c) {
      float here = same.at<float>(r, c);
      const float there = other.at<float>(r, c);
      if (may_be_smoke.at<std::uint8_t>(r, c) != 0) here = std::min(here, smoke.at<float>(r, c));
      // What is like neither is gone, but for a border's mixture of both: where they are far apart, by the share that
      // is seen of the opening. A shaded lid is no such mixture where the wood has a colour.
      const cv::Vec3f &e = look.expected.at<cv::Vec3f>(r, c), step = opening.at<cv::Vec3f>(r, c) - e,
                      seen = is.at<cv::Vec3f>(r, c) - e;
      float speaks = std::clamp(here - std::min(there, kUnseen), -kDecided, kDecided);
      if (const float apart = step.dot(step); apart > kFar * kFar && weight.at<float>(r, c) > 0.01F) {
        const float share = seen.dot(step) / apart, beside = seen.dot(seen) - share * share * apart;
        if (beside < kMixed * kMixed * apart) speaks = std::min(speaks, kDecided * (4 * share - kBorder));
      }
      cost.at<float>(r, c) = kDependent * std::clamp(speaks, -kDecided, kDecided);
    }
  cv::Mat gone = cv::Mat::zeros(now.size(), CV_8UC1);
  const int count = cv::connectedComponentsWithStats(candidate, labels, stats, centres, 8);
  for (int i = 1; i < count; ++i) {
    const cv::Rect box(stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP),
                       stats.at<int>(i, cv::CC_STAT_WIDTH), stats.at<int>(i, cv::CC_STAT_HEIGHT));
    cut_border(cost, is, labels, i, box, stats.at<int>(i, cv::CC_STAT_AREA), gone);
  }
  gone = mostly(gone, most > kHigh);
  // Windows and the scanner's blur widen what is narrow, and a hair on the glass would pass for a slot: its border is
  // where the difference falls to a part of what it is at its middle.
  cv::Mat broad, at_the_middle;
  cv::morphologyEx(gone, broad, cv::MORPH_OPEN, round_kernel(kNarrow * px_per_mm));
  cv::dilate(by, at_the_middle, round_kernel(kNarrow * px_per_mm));
  gone &= broad | (by > kFlank * at_the_middle);
  WoodChange out{gone, {}};
  same.convertTo(out.unlikeness, CV_8U);
  return out;
}

cv::Mat find_earlier_openings(const cv::Mat& before, const cv::Mat& alike, const cv::Mat& beside, double px_per_mm) {
  constexpr double kBeside = 0.6, kWindow = 0.3, kMost = 0.75;  // mm; share of the border
  constexpr float kStep = 15;                                   // grey levels
  cv::Mat was, group, inner, outer, wide, rim, weight_in, weight_out, labels, stats, centres;
  before.convertTo(was, CV_32F);
  // The tolerance and the border's blur lie between what is alike and what lay around it.
  cv::morphologyEx(alike, group, cv::MORPH_CLOSE, round_kernel(kBeside * px_per_mm));
  cv::dilate(group, wide, round_kernel(kBeside * px_per_mm));
  cv::dilate(group, rim, cv::Mat());
  rim -= group;
  const cv::Mat in = local_mean(was, group, kWindow * px_per_mm, weight_in),
                out_of = local_mean(was, beside & ~wide, 2 * kWindow * px_per_mm, weight_out);
  cv::Mat out = cv::Mat::zeros(alike.size(), CV_8UC1);
  const int count = cv::connectedComponentsWithStats(group | rim, labels, stats, centres, 8);
  std::vector<int> asked(static_cast<std::size_t>(count), 0), unlike = asked;
  for (int r = 0; r < rim.rows; ++r)
    for (int c = 0; c < rim.cols; ++c) {
      if (rim.at<std::uint8_t>(r, c) == 0 || weight_out.at<float>(r, c) < 0.02F) continue;
      const cv::Vec3f d = in.at<cv::Vec3f>(r, c) - out_of.at<cv::Vec3f>(r, c);
      const auto i = static_cast<std::size_t>(labels.at<int>(r, c));
      ++asked[i];
      unlike[i] += std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])}) > kStep ? 1 : 0;
    }
  for (int r = 0; r < out.rows; ++r)
    for (int c = 0; c < out.cols; ++c) {
      const auto i = static_cast<std::size_t>(labels.at<int>(r, c));
      if (i > 0 && asked[i] > 0 && unlike[i] > kMost * asked[i]) out.at<std::uint8_t>(r, c) = 255;
    }
  return out;
}

}  // namespace veneer::calib
