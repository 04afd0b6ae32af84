#include "calib/slit_profile.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calib/line_pixels.h"

namespace veneer::calib {
namespace {

// How much rougher a burnt slit's walls are than a sawn edge (mm, sigma), and how many independent readings a profile
// is worth: few, since grain and dust are no noise.
constexpr double kSlitRoughness = 0.02, kRoughest = 0.06, kIndependent = 3;

// What a channel's colours are made of: wood, slope of the light, browned rim, soot, slit. Blurred, at the places where
// the pixels are, and weighted.
enum Part { kWood, kSlope, kRim, kSoot, kSlit, kParts };
using Basis = Eigen::Matrix<double, SlitProfile::kBins, kParts>;
using Colours = Eigen::Matrix<double, SlitProfile::kBins, 3>;

struct Weighted {
  Colours colour;                                             // weighted
  Eigen::Matrix<double, SlitProfile::kBins, 1> root, places;  // root of the weight
  double total = 0;
  std::array<double, 3> lid{};
};

Weighted weighted(const SlitProfile& profile) {
  Weighted out;
  out.lid = profile.lid;
  for (int b = 0; b < SlitProfile::kBins; ++b) {
    const auto i = static_cast<std::size_t>(b);
    out.root[b] = std::sqrt(std::min(profile.weight[i], 60.0));
    out.places[b] = profile.place[i];
    out.total += out.root[b] * out.root[b];
    for (int k = 0; k < 3; ++k) out.colour(b, k) = out.root[b] * profile.colour[i][static_cast<std::size_t>(k)];
  }
  return out;
}

// A slit of even light between two rims that fade evenly into the wood, and soot that does so farther out: what of them
// reaches a place, in closed form. Without a part of its own soot would pass for the rim, whose steeper brown then
// passes for a narrower slit: by 0.03 to 0.04 mm, seen beside soot of 0.3 mm.
Basis basis_of(const Weighted& seen, double width, double middle, const SlitShape& shape) {
  // The pixels of a bin lie all over it.
  const double half = width / 2, roughness = std::hypot(shape.roughness, SlitProfile::kBin / std::sqrt(12.0));
  const auto below = [&](double x) { return shape.spread.below(x, roughness); };
  // The mean between where it begins and where it has faded.
  const auto fading = [&](double x, double reach) {
    return (shape.spread.sum_below(x, roughness) - shape.spread.sum_below(x - reach, roughness)) / reach;
  };
  Basis basis;
  for (int b = 0; b < SlitProfile::kBins; ++b) {
    const double place = seen.places[b], d = place - middle;
    const double right = below(d - half), left = below(-d - half);
    const auto beside = [&](double reach) { return right - fading(d - half, reach) + left - fading(-d - half, reach); };
    const double slit = 1 - right - left, soot = shape.soot > 0 ? beside(shape.soot) : 0;
    basis.row(b) << 1 - slit, place * (1 - slit), beside(shape.rim), soot, slit;
    basis.row(b) *= seen.root[b];
  }
  return basis;
}

// Levels of a slit: per channel wood, slope of the light, rim and soot; for all channels how bright the lid looks
// through it.
using OwnLevels = Eigen::Matrix<double, kSlit, 1>;
struct Levels {
  std::array<OwnLevels, 3> channel;
  double lid = 0;  // fraction of the lid beside the sheet
};

// Sum of weighted squares left over when the levels are best; the levels on demand.
double misfit(const Weighted& seen, double width, double middle, const SlitShape& shape, Levels* levels = nullptr) {
  // Levels and what is left over ask for sums of products of parts and colours, and for nothing else.
  Eigen::Matrix<double, SlitProfile::kBins, kParts + 3> columns;
  columns << basis_of(seen, width, middle, shape), seen.colour;
  const Eigen::Matrix<double, kParts + 3, kParts + 3> products = columns.transpose() * columns;
  Eigen::Matrix<double, kSlit, kSlit> normal = products.topLeftCorner<kSlit, kSlit>();
  normal.diagonal().array() += 1e-6 * seen.total;  // a rim too thin to be seen has no level
  const auto solver = normal.ldlt();
  // Each channel's own levels are linear in the lid's fraction: colour - lid * slit, projected.
  const OwnLevels own_slit = products.block<kSlit, 1>(0, kSlit);
  const OwnLevels slit_levels = solver.solve(own_slit);
  const double slit_rest = products(kSlit, kSlit) - slit_levels.dot(own_slit);
  double up = 0, down = 0;
  std::array<OwnLevels, 3> colour_levels;
  for (int k = 0; k < 3; ++k) {
    const OwnLevels own_colour = products.block<kSlit, 1>(0, kParts + k);
    const double lid = seen.lid[static_cast<std::size_t>(k)];
    colour_levels[static_cast<std::size_t>(k)] = solver.solve(own_colour);
    up += lid * (products(kSlit, kParts + k) - slit_levels.dot(own_colour)), down += lid * lid * slit_rest;
  }
  // Dimmer than beside the sheet, but not by half, and never brighter.
  const double fraction = std::clamp(down > 0 ? up / down : 1.0, 0.6, 1.02);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double lid = fraction * seen.lid[i];
    OwnLevels best = colour_levels[i] - lid * slit_levels;
    // Browned and sooty wood is darker than wood and lighter than nothing; the slope of the light is not asked again.
    const double darkest = -0.95 * std::max(0.0, best[kWood]);
    best[kSoot] = std::clamp(best[kSoot], darkest, 0.0);
    best[kRim] = std::clamp(best[kRim], std::min(0.0, darkest - best[kSoot]), 0.0);
    Eigen::Matrix<double, kParts + 3, 1> shares = Eigen::Matrix<double, kParts + 3, 1>::Zero();
    shares.head<kSlit>() = best, shares[kSlit] = lid, shares[kParts + k] = -1;
    sum += std::max(0.0, shares.dot(products * shares));
    if (levels != nullptr) levels->channel[i] = best;
  }
  if (levels != nullptr) levels->lid = fraction;
  return sum;
}

double best_width(const Weighted& seen, const SlitShape& shape, double middle) {
  double best = 0.05, least = misfit(seen, best, middle, shape);
  for (int step = 1; step <= 20; ++step) {
    const double width = 0.05 + 0.04 * step;
    const double m = misfit(seen, width, middle, shape);
    if (m < least) least = m, best = width;
  }
  return golden_section_minimum(std::max(0.02, best - 0.05), best + 0.05, 2e-4,
                                [&](double width) { return misfit(seen, width, middle, shape); });
}

// How the wood beside the line differs from its mean, along the line: grain that crosses the line.
class Grain {
 public:
  Grain(const cv::Mat& scan, ScanResolution resolution, const PixelLine& line, double begin, double end)
      : begin_(begin), end_(end) {
    constexpr double kWoodFrom = 0.45, kCellMm = 0.15;
    const double length = resolution.to_mm(Pixels(line.length)).count() * (end - begin);
    sums_.resize(static_cast<std::size_t>(std::max(2.0, length / kCellMm)));
    std::vector<int> counts(sums_.size());
    cv::Vec3d all;
    int pixels = 0;
    across(scan, resolution, line, begin, end, SlitProfile::kReach, [&](const cv::Vec3b& v, double d, double along) {
      if (std::abs(d) < kWoodFrom) return;
      const cv::Vec3d colour(v[0], v[1], v[2]);
      sums_[cell(along)] += colour, ++counts[cell(along)], all += colour, ++pixels;
    });
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      sums_[i] = counts[i] < 4 ? cv::Vec3d() : sums_[i] / counts[i] - all / std::max(1, pixels);
    }
  }
  const cv::Vec3d& at(double along) const { return sums_[cell(along)]; }

 private:
  std::size_t cell(double along) const {
    const double part = (along - begin_) / (end_ - begin_) * static_cast<double>(sums_.size());
    return static_cast<std::size_t>(std::clamp(part, 0.0, static_cast<double>(sums_.size()) - 1));
  }
  double begin_, end_;
  std::vector<cv::Vec3d> sums_;
};

// Where the slit's middle is in a part of the line: the centroid of what does not look like the wood beside it. Slit
// and rims are symmetric, so neither their colours nor their widths matter.
double middle_of(const cv::Mat& scan, ScanResolution resolution, const PixelLine& line, double begin, double end) {
  constexpr double kWoodFrom = 0.65, kWindow = 0.42, kIgnored = 10;  // mm, mm, grey levels
  std::vector<std::pair<double, cv::Vec3d>> pixels;
  std::array<std::vector<double>, 3> wood;
  across(scan, resolution, line, begin, end, SlitProfile::kReach, [&](const cv::Vec3b& v, double d, double) {
    pixels.emplace_back(d, cv::Vec3d(v[0], v[1], v[2]));
    if (std::abs(d) < kWoodFrom) return;
    for (int k = 0; k < 3; ++k) wood[static_cast<std::size_t>(k)].push_back(v[k]);
  });
  cv::Vec3d level;
  for (std::size_t k = 0; k < 3; ++k) {
    if (wood[k].empty()) return 0;
    std::nth_element(wood[k].begin(), wood[k].begin() + static_cast<std::ptrdiff_t>(wood[k].size() / 2), wood[k].end());
    level[static_cast<int>(k)] = wood[k][wood[k].size() / 2];
  }
  double middle = 0;
  for (int round = 0; round < 8; ++round) {
    double weight = 0, moment = 0;
    for (const auto& [d, v] : pixels) {
      // A soft rim of one pixel, so that the centroid moves smoothly.
      const double inside = std::clamp((kWindow - std::abs(d - middle)) / 0.09 + 0.5, 0.0, 1.0);
      const double w = inside * std::max(0.0, cv::norm(v - level) - kIgnored);
      weight += w, moment += w * d;
    }
    if (weight <= 0) return middle;
    middle = moment / weight;
  }
  return middle;
}

}  // namespace

FoundLine centred_line(const cv::Mat& scan, ScanResolution resolution, const FoundLine& line) {
  const PixelLine px = in_pixels(line, resolution);
  constexpr int kParts = 12;
  std::vector<double> at, off;
  for (int part = 0; part < kParts; ++part) {
    const double begin = 0.06 + 0.88 * part / kParts, end = 0.06 + 0.88 * (part + 1) / kParts;
    at.push_back((begin + end) / 2);
    off.push_back(middle_of(scan, resolution, px, begin, end));
  }
  return straightened(line, resolution, at, off);
}

SlitProfile sample_profile(const cv::Mat& scan, ScanResolution resolution, const FoundLine& line, double begin,
                           double end, const std::array<double, 3>& lid) {
  const PixelLine px = in_pixels(line, resolution);
  const Grain grain(scan, resolution, px, begin, end);
  std::array<std::vector<cv::Vec3d>, SlitProfile::kBins> bins;
  std::array<double, SlitProfile::kBins> places{};
  across(scan, resolution, px, begin, end, SlitProfile::kReach, [&](const cv::Vec3b& v, double d, double along) {
    const auto bin = static_cast<std::size_t>(
        std::clamp(static_cast<int>((d + SlitProfile::kReach) / SlitProfile::kBin), 0, SlitProfile::kBins - 1));
    // Grain shows on wood only.
    const double wood = std::clamp((std::abs(d) - 0.10) / 0.06, 0.0, 1.0);
    bins[bin].push_back(cv::Vec3d(v[0], v[1], v[2]) - wood * grain.at(along)), places[bin] += d;
  });
  SlitProfile profile;
  profile.lid = lid;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    auto& pixels = bins[b];
    profile.place[b] = (static_cast<double>(b) + 0.5) * SlitProfile::kBin - SlitProfile::kReach;
    if (pixels.empty()) continue;
    profile.place[b] = places[b] / static_cast<double>(pixels.size());
    profile.weight[b] = static_cast<double>(pixels.size());
    for (int k = 0; k < 3; ++k) {
      // Without the outer fifths: dust does not count.
      std::sort(pixels.begin(), pixels.end(), [k](const auto& p, const auto& q) { return p[k] < q[k]; });
      const std::size_t cut = pixels.size() / 5;
      double sum = 0;
      for (std::size_t i = cut; i < pixels.size() - cut; ++i) sum += pixels[i][k];
      profile.colour[b][static_cast<std::size_t>(k)] = sum / static_cast<double>(pixels.size() - 2 * cut);
    }
  }
  return profile;
}

SlitFit fit_width(const SlitProfile& profile, const SlitShape& shape) {
  const Weighted seen = weighted(profile);
  SlitFit fit;
  for (int round = 0; round < 2; ++round) {
    fit.width = best_width(seen, shape, fit.middle);
    fit.middle = golden_section_minimum(-0.06, 0.06, 5e-4,
                                        [&](double middle) { return misfit(seen, fit.width, middle, shape); });
  }
  Levels levels;
  fit.residual = std::sqrt(misfit(seen, fit.width, fit.middle, shape, &levels) / std::max(1.0, 3 * seen.total));
  fit.lid = levels.lid;
  for (std::size_t k = 0; k < 3; ++k) {
    const double wood = levels.channel[k][kWood], rim = wood + levels.channel[k][kRim] + levels.channel[k][kSoot],
                 slit = levels.lid * profile.lid[k];
    fit.contrast = std::max({fit.contrast, std::abs(slit - rim), std::abs(slit - wood)});
  }
  return fit;
}

namespace {

// Finds the shape common to all profiles; each has a width of its own.
class ShapeFit {
 public:
  ShapeFit(const std::vector<SlitProfile>& profiles, const ScanBlur& blur) : profiles_(profiles), blur_(blur) {
    look(with(kSlitRoughness, 0.1));
  }

  // Soot counts where most lines fit clearly better with it than with any rim: it also explains a little of clean
  // slits, and what it takes for itself there is missing elsewhere. Soot that reaches hardly farther than the rim is
  // told from it no more.
  void look_for_soot() {
    constexpr double kClearly = 0.6;  // of the squares left over on a usual line
    const auto shape_with = [&](double soot) {
      soot_ = soot;
      return with(kSlitRoughness, best_rim(kSlitRoughness));
    };
    double least = kClearly * usual_misfit(shape_with(0)), best = 0;
    for (const double soot : {0.2, 0.3, 0.45, 0.65, 0.9})
      if (const double m = usual_misfit(shape_with(soot)); m < least) least = m, best = soot;
    // The usual line only decides whether there is any; what is fitted is fitted to all, as the rest of the shape is.
    const auto of_all = [&](double soot) { return cost(shape_with(soot)); };
    soot_ = best > 0 ? golden_section_minimum(best * 0.7, best * 1.4, 1e-2, of_all) : 0;
    look(with(kSlitRoughness, soot_ > 0 ? best_rim(kSlitRoughness) : 0.1));
  }

  SlitShape best() {
    const double best = golden_section_minimum(0, kRoughest, 1e-3, [&](double roughness) {
      const double off = (roughness - kSlitRoughness) / blur_.trust;
      return cost_of_rim(roughness, best_rim(roughness)) + off * off;
    });
    return with(best, best_rim(best));
  }

 private:
  struct Seen {
    Weighted profile;
    double middle = 0, width = 0;  // width: the last found, near which the next is looked for
    double noise = 1;              // what no shape explains: grain and dust, squared
  };

  SlitShape with(double roughness, double rim) const { return {blur_.spread, roughness, rim, soot_}; }

  void look(const SlitShape& shape) {
    constexpr double kLeastNoise = 0.2;  // grey levels; no profile is known better, nor trusted more
    seen_.clear();
    for (const auto& profile : profiles_) {
      const SlitFit fit = fit_width(profile, shape);
      Seen one{weighted(profile), fit.middle, fit.width};
      // Grain that runs along a slit is no noise that many pixels average out: that line says little of the shape.
      const double left = std::max(kLeastNoise, fit.residual);
      one.noise = left * left * 3 * one.profile.total / kIndependent;
      seen_.push_back(one);
    }
  }

  double cost(const SlitShape& shape) {
    double sum = 0;
    for (auto& s : seen_) {
      const auto of_width = [&](double width) { return misfit(s.profile, width, s.middle, shape); };
      s.width = golden_section_minimum(std::max(0.02, s.width - 0.04), s.width + 0.04, 1e-3, of_width);
      sum += of_width(s.width) / s.noise;
    }
    return sum;
  }

  // The geometric mean over the lines: one that dust lies on says no more than another.
  double usual_misfit(const SlitShape& shape) {
    cost(shape);  // finds each line's width
    double logs = 0;
    for (const auto& s : seen_) logs += std::log(std::max(1e-9, misfit(s.profile, s.width, s.middle, shape)));
    return std::exp(logs / static_cast<double>(std::max<std::size_t>(1, seen_.size())));
  }

  // Beside soot a narrow rim fits nearly as well as a usual one, with a slit that is wider by 0.03 mm: where the lines
  // hardly tell the two apart the usual one is more likely.
  double cost_of_rim(double roughness, double rim) {
    constexpr double kUsualRim = 0.1, kUsualFactor = 1.6;  // mm, one sigma
    const double off = std::log(rim / kUsualRim) / std::log(kUsualFactor);
    return cost(with(roughness, rim)) + off * off;
  }

  // Roughness and rim trade against each other along a narrow valley, so the rim is found anew for every roughness.
  double best_rim(double roughness) {
    double best = 0.05, least = cost_of_rim(roughness, best);
    for (const double rim : {0.08, 0.12, 0.18}) {
      const double c = cost_of_rim(roughness, rim);
      if (c < least) least = c, best = rim;
    }
    return golden_section_minimum(best * 0.6, best * 1.6, 2e-3,
                                  [&](double rim) { return cost_of_rim(roughness, rim); });
  }

  const std::vector<SlitProfile>& profiles_;
  const ScanBlur& blur_;
  std::vector<Seen> seen_;
  double soot_ = 0;
};

}  // namespace

SlitShape fit_shape(const std::vector<SlitProfile>& profiles, const ScanBlur& blur) {
  ShapeFit fit(profiles, blur);
  fit.look_for_soot();
  return fit.best();
}

}  // namespace veneer::calib
