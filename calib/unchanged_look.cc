#include "calib/unchanged_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/units.h"

namespace veneer::calib {
namespace {

// Where most of a wood is gone, what is learnt of it is its loss: more than this is no noise, and is told.
constexpr double kMostNoise = 4;        // grey levels, where nothing is steep
constexpr Millimetres kMostShift(0.1);  // what is left between the maps, which a slope makes a difference of
constexpr float kMostOfAKind = 1.5;     // times the noise of all that is as steep
constexpr double kLeastNoise = 1;       // grey levels: rounding, JPEG; what is clipped has no noise of its own
constexpr int kLooks = 12, kCalm = 3;   // kinds: so many looks, times so many steps from calm to beside an edge

// What the surface leaves of the light's change: a lamp's stray light, or where two tiles of a stitched map meet.
// Smooth over a centimetre, bounded, and learnt from what is not touched and differs by little.
void add_local_light(const cv::Mat& now, const cv::Mat& touched, double px_per_mm, cv::Mat& expected) {
  constexpr double kCell = 3, kSmooth = 2, kMost = 0.05;  // mm, cells, of a level
  constexpr double kSharp = 5;                            // grey levels: what differs by more counts for little
  constexpr double kHold = 0.02;                          // of a cell's places, held to no change
  constexpr int kRounds = 5;
  const cv::Size cells(std::max(1, static_cast<int>(now.cols / (kCell * px_per_mm))),
                       std::max(1, static_cast<int>(now.rows / (kCell * px_per_mm))));
  std::array<cv::Mat, 3> was, is;
  cv::split(expected, was.data());
  cv::split(now, is.data());
  cv::Mat learnt;
  cv::Mat(touched == 0).convertTo(learnt, CV_32F, 1.0 / 255);
  const auto gathered = [&](const cv::Mat& product) {
    cv::Mat out;
    cv::resize(product, out, cells, 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(out, out, {}, kSmooth);
    return out;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    cv::Mat seen = was[k];
    for (int round = 0; round < kRounds; ++round) {
      cv::Mat off = is[k] - seen, weight, gain;
      weight = off.mul(off) * (1 / (kSharp * kSharp)) + 1;
      cv::divide(learnt, weight.mul(weight), weight);
      off = is[k] - was[k];
      const cv::Mat square = gathered(weight.mul(was[k]).mul(was[k]));
      cv::divide(gathered(weight.mul(was[k]).mul(off)), square + kHold * 100 * 100, gain);
      gain = cv::min(cv::max(gain, -kMost), kMost);
      cv::resize(gain, gain, now.size(), 0, 0, cv::INTER_LINEAR);
      seen = was[k] + was[k].mul(gain);
    }
    was[k] = seen;
  }
  cv::merge(was.data(), was.size(), expected);
}

cv::Mat grey_mean(const cv::Mat& bgr) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

double robust_scale(const cv::Mat& values, int step) {
  std::vector<float> sample;
  for (int r = 0; r < values.rows; r += step)
    for (int c = 0; c < values.cols; c += step) sample.push_back(std::abs(values.at<float>(r, c)));
  if (sample.empty()) return 0;
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return kSigmaOfMad * *middle;
}

// The flow that brings `expected` to `now`, pixels, smooth over a centimetre: Lucas and Kanade's, with what has changed
// weighted down.
void add_flow(const cv::Mat& expected, const cv::Mat& now, double px_per_mm, cv::Mat& flow_x, cv::Mat& flow_y) {
  constexpr double kCell = 4, kSmooth = 2, kMost = 0.15;  // mm, cells, mm a round
  const cv::Mat off = now - expected;
  const double scale = std::max(1.0, robust_scale(off, 3));
  cv::Mat dx, dy, weight;
  cv::Sobel(expected, dx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(expected, dy, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::Mat w = off.mul(off) * (1 / (4 * scale * scale)) + 1;
  cv::divide(1.0, w.mul(w), weight);
  const cv::Size cells(std::max(1, static_cast<int>(off.cols / (kCell * px_per_mm))),
                       std::max(1, static_cast<int>(off.rows / (kCell * px_per_mm))));
  const auto gathered = [&](const cv::Mat& product) {
    cv::Mat out;
    cv::resize(weight.mul(product), out, cells, 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(out, out, {}, kSmooth);
    return out;
  };
  const cv::Mat xx = gathered(dx.mul(dx)), xy = gathered(dx.mul(dy)), yy = gathered(dy.mul(dy)),
                xo = gathered(dx.mul(off)), yo = gathered(dy.mul(off));
  cv::Mat move_x(cells, CV_32FC1), move_y(cells, CV_32FC1);
  const double hold = 0.02 * scale * scale, most = kMost * px_per_mm;
  for (int r = 0; r < cells.height; ++r)
    for (int c = 0; c < cells.width; ++c) {
      const double a = xx.at<float>(r, c) + hold, b = xy.at<float>(r, c), d = yy.at<float>(r, c) + hold,
                   det = a * d - b * b, u = xo.at<float>(r, c), v = yo.at<float>(r, c);
      move_x.at<float>(r, c) = static_cast<float>(std::clamp((d * u - b * v) / det, -most, most));
      move_y.at<float>(r, c) = static_cast<float>(std::clamp((a * v - b * u) / det, -most, most));
    }
  cv::resize(move_x, move_x, off.size(), 0, 0, cv::INTER_LINEAR);
  cv::resize(move_y, move_y, off.size(), 0, 0, cv::INTER_LINEAR);
  flow_x += move_x, flow_y += move_y;
}

cv::Mat moved(const cv::Mat& picture, const cv::Mat& flow_x, const cv::Mat& flow_y) {
  cv::Mat from_x(picture.size(), CV_32FC1), from_y(picture.size(), CV_32FC1), out;
  for (int r = 0; r < picture.rows; ++r)
    for (int c = 0; c < picture.cols; ++c) {
      from_x.at<float>(r, c) = static_cast<float>(c) + flow_x.at<float>(r, c);
      from_y.at<float>(r, c) = static_cast<float>(r) + flow_y.at<float>(r, c);
    }
  cv::remap(picture, out, from_x, from_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return out;
}

float middle_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// By how much a pixel differs for its steepness: a slope makes a difference of every shift.
cv::Mat noise_of_slopes(const cv::Mat& expected, const cv::Mat& now, const cv::Mat& touched, double px_per_mm) {
  constexpr int kBins = 16;
  constexpr std::size_t kFew = 100;
  constexpr double kLeast = kLeastNoise;
  cv::Mat dx, dy, slope;
  const cv::Mat grey = grey_mean(expected);
  cv::Sobel(grey, dx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(grey, dy, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::magnitude(dx, dy, slope);
  cv::dilate(slope, slope, cv::Mat());
  const auto bin_of = [](float s) { return std::min(kBins - 1, static_cast<int>(3 * std::log2(1 + s))); };
  std::array<std::array<std::vector<float>, 3>, kBins> off;
  for (int r = 0; r < now.rows; r += 3)
    for (int c = r / 3 % 3; c < now.cols; c += 3) {
      if (touched.at<std::uint8_t>(r, c) != 0) continue;
      auto& bin = off[static_cast<std::size_t>(bin_of(slope.at<float>(r, c)))];
      const cv::Vec3f d = now.at<cv::Vec3f>(r, c) - expected.at<cv::Vec3f>(r, c);
      for (int k = 0; k < 3; ++k) bin[static_cast<std::size_t>(k)].push_back(std::abs(d[k]));
    }
  std::array<cv::Vec3f, kBins> sigma;
  // Of a part that is all touched nothing is known: what differs by little is no difference there.
  const bool none = std::ranges::all_of(off, [](const auto& bin) { return bin[0].size() < kFew; });
  for (std::size_t b = 0; b < kBins; ++b)
    for (std::size_t k = 0; k < 3; ++k) {
      auto& values = off[b][k];
      const float gentler = b == 0 ? static_cast<float>(none ? kMostNoise : kLeast) : sigma[b - 1][static_cast<int>(k)];
      float& here = sigma[b][static_cast<int>(k)] = gentler;
      if (values.size() >= kFew) here = std::max(gentler, static_cast<float>(kSigmaOfMad) * middle_of(values));
    }
  cv::Mat noise(now.size(), CV_32FC3);
  const auto shift_px = static_cast<float>(kMostShift.count() * px_per_mm);
  for (int r = 0; r < now.rows; ++r)
    for (int c = 0; c < now.cols; ++c) {
      const float steep = slope.at<float>(r, c), most = static_cast<float>(kMostNoise) + shift_px * steep;
      const cv::Vec3f& here = sigma[static_cast<std::size_t>(bin_of(steep))];
      noise.at<cv::Vec3f>(r, c) = {std::min(here[0], most), std::min(here[1], most), std::min(here[2], most)};
    }
  return noise;
}

// Beside an edge optics and JPEG make a difference of a share of its contrast, to either side and a little elsewhere in
// each map; that share is learnt.
void add_noise_of_edges(const cv::Mat& expected, const cv::Mat& now, const cv::Mat& touched, double px_per_mm,
                        cv::Mat& noise) {
  constexpr double kReach = 0.7;        // mm
  constexpr float kLeastContrast = 40;  // grey levels: of an edge, not of grain
  constexpr double kShare = 0.9, kSigmas = 1.645;
  const int half = std::max(1, static_cast<int>(kReach * px_per_mm));
  const cv::Mat around = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * half + 1, 2 * half + 1});
  cv::Mat smooth, highest, lowest;
  cv::medianBlur(expected, smooth, 3);
  cv::dilate(smooth, highest, around);
  cv::erode(smooth, lowest, around);
  const cv::Mat contrast = highest - lowest;
  for (int k = 0; k < 3; ++k) {
    std::vector<float> shares;
    for (int r = 0; r < now.rows; r += 3)
      for (int c = r / 3 % 3; c < now.cols; c += 3) {
        const float edge = contrast.at<cv::Vec3f>(r, c)[k];
        if (edge < kLeastContrast || touched.at<std::uint8_t>(r, c) != 0) continue;
        shares.push_back(std::abs(now.at<cv::Vec3f>(r, c)[k] - expected.at<cv::Vec3f>(r, c)[k]) / edge);
      }
    if (shares.size() < 100) continue;
    const auto at = shares.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(shares.size()));
    std::nth_element(shares.begin(), at, shares.end());
    const float share = std::min(0.1F, *at / static_cast<float>(kSigmas));
    for (int r = 0; r < now.rows; ++r)
      for (int c = 0; c < now.cols; ++c) {
        const float edge = contrast.at<cv::Vec3f>(r, c)[k];
        float& sigma = noise.at<cv::Vec3f>(r, c)[k];
        if (edge >= kLeastContrast) sigma = std::hypot(sigma, share * edge);
      }
  }
}

// 0 where it is calm, up to kCalm - 1 beside edges of any colour: what a shift, the optics and JPEG's coarse colours
// make of an edge reaches around it.
cv::Mat steps_to_edges(const cv::Mat& expected, double px_per_mm) {
  constexpr double kReach = 0.8;                // mm
  constexpr float kSteps[kCalm - 1] = {8, 25};  // grey levels a pixel
  std::array<cv::Mat, 3> planes;
  cv::split(expected, planes.data());
  cv::Mat steepest = cv::Mat::zeros(expected.size(), CV_32FC1), dx, dy, slope;
  for (const cv::Mat& plane : planes) {
    cv::Sobel(plane, dx, CV_32F, 1, 0, 3, 1.0 / 8);
    cv::Sobel(plane, dy, CV_32F, 0, 1, 3, 1.0 / 8);
    cv::magnitude(dx, dy, slope);
    steepest = cv::max(steepest, slope);
  }
  const int half = std::max(1, static_cast<int>(kReach * px_per_mm));
  cv::dilate(steepest, steepest, cv::Mat::ones(2 * half + 1, 2 * half + 1, CV_8UC1));
  cv::Mat out = cv::Mat::zeros(expected.size(), CV_8UC1);
  for (const float step : kSteps) out += (steepest > step) / 255;
  return out;
}

// Places that looked alike before, by colour and by how lively they are: each wood, and the board, on its own.
cv::Mat sort_alike(const cv::Mat& expected, double px_per_mm) {
  constexpr double kCell = 1, kSmooth = 1.2, kLively = 3;  // mm, cells, weight
  constexpr int kSamples = 4000, kRounds = 12;
  const cv::Size cells(std::max(1, static_cast<int>(expected.cols / (kCell * px_per_mm))),
                       std::max(1, static_cast<int>(expected.rows / (kCell * px_per_mm))));
  cv::Mat mean, square, grey = grey_mean(expected), level;
  cv::resize(expected, mean, cells, 0, 0, cv::INTER_AREA);
  cv::resize(grey.mul(grey), square, cells, 0, 0, cv::INTER_AREA);
  cv::resize(grey, level, cells, 0, 0, cv::INTER_AREA);
  cv::Mat lively = cv::max(square - level.mul(level), 0);
  cv::medianBlur(mean, mean, 3);
  cv::GaussianBlur(lively, lively, {}, kSmooth);
  const int all = static_cast<int>(cells.area()), step = std::max(1, all / kSamples);
  const auto features = [&](int i) {
    const auto& colour = mean.at<cv::Vec3f>(i / cells.width, i % cells.width);
    const float texture = std::sqrt(lively.at<float>(i / cells.width, i % cells.width));
    return cv::Vec4f(colour[0], colour[1], colour[2], static_cast<float>(kLively) * texture);
  };
  cv::Mat samples((all + step - 1) / step, 4, CV_32FC1), labels, centres;
  for (int i = 0; i < samples.rows; ++i)
    for (int k = 0; k < 4; ++k) samples.at<float>(i, k) = features(i * step)[k];
  cv::RNG& random = cv::theRNG();
  const auto state = random.state;
  random.state = 1;  // equal maps give equal answers
  cv::kmeans(samples, std::min(kLooks, samples.rows), labels, {cv::TermCriteria::COUNT, kRounds, 0}, 1,
             cv::KMEANS_PP_CENTERS, centres);
  random.state = state;
  cv::Mat sorted(cells, CV_8UC1), out;
  for (int i = 0; i < all; ++i) {
    int best = 0;
    double least = 1e30;
    for (int k = 0; k < centres.rows; ++k) {
      const double away = cv::norm(features(i) - centres.at<cv::Vec4f>(k, 0), cv::NORM_L2SQR);
      if (away < least) least = away, best = k;
    }
    sorted.at<std::uint8_t>(i / cells.width, i % cells.width) = static_cast<std::uint8_t>(best);
  }
  cv::resize(sorted, out, expected.size(), 0, 0, cv::INTER_NEAREST);
  return out * kCalm + steps_to_edges(expected, px_per_mm);
}

}  // namespace

cv::Vec<float, kKinds> middles(const cv::Mat& values, const cv::Mat& kinds, const cv::Mat& touched) {
  constexpr int kStep = 3;
  constexpr std::size_t kFew = 150;
  std::array<std::vector<float>, kKinds> of_kind;
  std::array<std::vector<float>, kCalm> of_step;
  for (int r = 0; r < values.rows; r += kStep)
    for (int c = r / kStep % kStep; c < values.cols; c += kStep) {
      if (touched.at<std::uint8_t>(r, c) != 0) continue;
      const std::size_t kind = kinds.at<std::uint8_t>(r, c);
      of_kind[kind].push_back(values.at<float>(r, c));
      of_step[kind % kCalm].push_back(values.at<float>(r, c));
    }
  cv::Vec<float, kKinds> out;
  for (std::size_t k = 0; k < kKinds; ++k) {
    auto& sample = of_kind[k].size() < kFew ? of_step[k % kCalm] : of_kind[k];
    out[static_cast<int>(k)] = sample.empty() ? 0 : middle_of(sample);
  }
  return out;
}

UnchangedLook look_unchanged(const cv::Mat& before, const cv::Mat& now, const cv::Mat& touched, double px_per_mm,
                             const ChangeOfLight& light, const cv::Point& at) {
  constexpr int kRounds = 3;
  constexpr float kMostDrift = 5;  // grey levels: a pigment's, beside the light's
  cv::Mat was, is;
  before.convertTo(was, CV_32F);
  now.convertTo(is, CV_32F);
  UnchangedLook out;
  out.touched = touched;
  out.expected = in_later_light(light, was, at);
  cv::Mat flow_x = cv::Mat::zeros(now.size(), CV_32FC1), flow_y = flow_x.clone();
  const cv::Mat grey = grey_mean(out.expected), grey_now = grey_mean(is);
  for (int round = 0; round < kRounds; ++round)
    add_flow(round == 0 ? grey : moved(grey, flow_x, flow_y), grey_now, px_per_mm, flow_x, flow_y);
  out.expected = in_later_light(light, moved(was, flow_x, flow_y), at);
  add_local_light(is, touched, px_per_mm, out.expected);
  out.kinds = sort_alike(out.expected, px_per_mm);
  std::array<cv::Mat, 3> off;
  cv::split(is - out.expected, off.data());
  for (std::size_t k = 0; k < 3; ++k) {
    const auto drift = middles(off[k], out.kinds, touched);
    for (int r = 0; r < is.rows; ++r)
      for (int c = 0; c < is.cols; ++c)
        out.expected.at<cv::Vec3f>(r, c)[static_cast<int>(k)] +=
            std::clamp(drift[out.kinds.at<std::uint8_t>(r, c)], -kMostDrift, kMostDrift);
  }
  out.noise = noise_of_slopes(out.expected, is, touched, px_per_mm);
  cv::split(cv::abs(is - out.expected) / out.noise, off.data());
  for (std::size_t k = 0; k < 3; ++k) {
    const auto spread = middles(off[k], out.kinds, touched);
    for (int r = 0; r < is.rows; ++r)
      for (int c = 0; c < is.cols; ++c)
        out.noise.at<cv::Vec3f>(r, c)[static_cast<int>(k)] *=
            std::clamp(static_cast<float>(kSigmaOfMad) * spread[out.kinds.at<std::uint8_t>(r, c)], 0.7F, kMostOfAKind);
  }
  add_noise_of_edges(out.expected, is, touched, px_per_mm, out.noise);
  return out;
}

}  // namespace veneer::calib
