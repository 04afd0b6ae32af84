#include "planner/boundaries/cut_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

namespace veneer::planner {
namespace {

constexpr double kSame = 1e-6;  // pixels: borders that are one line

struct Run {
  double at, begin, end;
};

// Runs that continue each other, as one.
std::vector<Run> merged(std::vector<Run> runs) {
  std::sort(runs.begin(), runs.end(),
            [](const Run& a, const Run& b) { return std::abs(a.at - b.at) > kSame ? a.at < b.at : a.begin < b.begin; });
  std::vector<Run> out;
  for (const Run& run : runs) {
    if (!out.empty() && std::abs(out.back().at - run.at) <= kSame && run.begin <= out.back().end + kSame)
      out.back().end = std::max(out.back().end, run.end);
    else
      out.push_back(run);
  }
  return out;
}

void add_lines(bool upright, const std::vector<Run>& runs, int size_along, double reach, CutLines& out) {
  for (const Run& run : merged(runs)) {
    CutLine line{upright, run.at, run.begin, run.end, 0, {}};
    line.first = std::max(0, static_cast<int>(std::floor(run.begin - reach)));
    const int last = std::min(size_along, static_cast<int>(std::ceil(run.end + reach)));
    line.at.assign(static_cast<std::size_t>(std::max(1, last - line.first)), run.at);
    out.lines.push_back(std::move(line));
  }
}

int line_at(const CutLines& lines, bool upright, double at, double begin, double end) {
  for (std::size_t i = 0; i < lines.lines.size(); ++i) {
    const CutLine& line = lines.lines[i];
    if (line.upright == upright && std::abs(line.straight - at) <= kSame && line.begin <= begin + kSame &&
        line.end >= end - kSame)
      return static_cast<int>(i);
  }
  return FaceLines::kBorder;
}

// Sees an upright and a level line alike: `along` it and `across` it, faces `before` it (left, above) and after.
class LineView {
 public:
  LineView(const CutLines& lines, std::size_t number) : lines_(lines), line_(lines.lines[number]) {
    for (std::size_t f = 0; f < lines.faces.size(); ++f) {
      const FaceLines& face = lines.faces[f];
      if ((line_.upright ? face.right : face.bottom) == static_cast<int>(number)) before_.push_back(f);
      if ((line_.upright ? face.left : face.top) == static_cast<int>(number)) after_.push_back(f);
    }
  }
  const std::vector<std::size_t>& before() const { return before_; }
  const std::vector<std::size_t>& after() const { return after_; }
  int across_size() const { return line_.upright ? lines_.columns : lines_.rows; }
  int along_size() const { return line_.upright ? lines_.rows : lines_.columns; }
  // Where a face begins and ends along the line, at this place across it.
  double begin(std::size_t face, double across) const {
    return line_.upright ? lines_.top(face, across) : lines_.left(face, across);
  }
  double end(std::size_t face, double across) const {
    return line_.upright ? lines_.bottom(face, across) : lines_.right(face, across);
  }
  // The border of a face on the far side of the line.
  double far_before(std::size_t face, double along) const {
    return line_.upright ? lines_.left(face, along) : lines_.top(face, along);
  }
  double far_after(std::size_t face, double along) const {
    return line_.upright ? lines_.right(face, along) : lines_.bottom(face, along);
  }
  // The lines that meet this one.
  std::vector<int> meeting() const {
    std::vector<int> out;
    for (const auto* faces : {&before_, &after_})
      for (const std::size_t f : *faces)
        for (const int line : {line_.upright ? lines_.faces[f].top : lines_.faces[f].left,
                               line_.upright ? lines_.faces[f].bottom : lines_.faces[f].right})
          out.push_back(line);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }
  // Where the lines meet if this one lies there, and how the other leans, across its own direction.
  std::pair<double, double> meets(int other, double across) const {
    const CutLine& line = lines_.lines[static_cast<std::size_t>(other)];
    constexpr double kStep = 4;
    return {line(across), (line(across + kStep) - line(across - kStep)) / (2 * kStep)};
  }
  float cost(const FaceCost& face, int along, int across) const {
    const int row = (line_.upright ? along : across) - face.window.y;
    const int column = (line_.upright ? across : along) - face.window.x;
    if (row < 0 || column < 0 || row >= face.window.height || column >= face.window.width) return kForbidden;
    return face.cost.at<float>(row, column);
  }

 private:
  const CutLines& lines_;
  const CutLine& line_;
  std::vector<std::size_t> before_, after_;
};

// First pixel whose middle is at or beyond `at`.
int first_middle_from(double at) { return static_cast<int>(std::ceil(at - 0.5)); }

class Recut {
 public:
  Recut(const CutLines& lines, std::size_t number, std::span<const FaceCost> costs, const CutOptions& options)
      : line_(lines.lines[number]), view_(lines, number), costs_(costs), options_(options) {
    double least = line_.straight, most = line_.straight;
    if (!line_.curved.empty()) {
      const auto [low, high] = std::minmax_element(line_.curved.begin(), line_.curved.end());
      least = *low, most = *high;
    }
    low_ = std::max(1, static_cast<int>(std::floor(least - options.reach)));
    high_ = std::min(view_.across_size() - 1, static_cast<int>(std::ceil(most + options.reach)));
    width_ = static_cast<std::size_t>(std::max(0, high_ - low_) + 1);
    count_ = line_.at.size();
  }

  // The cheapest cut before pixel `across`, for each pixel along.
  std::vector<double> run() {
    if (high_ <= low_) return line_.at;
    measure();
    add_up();
    bound();
    return cheapest();
  }

  // The cheapest of all lines with corners every kStride quanta along, where a turn costs its square times `bend`, as a
  // cubic B-spline with these corners for controls. Dynamic programming over where a part ends and how it leans.
  std::vector<double> smoothest(double stride, double bend) {
    if (high_ <= low_) return line_.at;
    measure();
    add_up();
    bound();
    const double quantum = stride / kStride;
    const int places = static_cast<int>(std::floor((high_ - low_) / quantum)) + 1;
    const int parts = std::max(1, static_cast<int>(std::lround(static_cast<double>(count_) / stride)));
    const double length = static_cast<double>(count_) / parts;
    const std::size_t states = static_cast<std::size_t>(places) * kLeans;
    const std::vector<LeanLimits> limits = lean_limits(parts, length, places, quantum);
    std::vector<double> total(states, 0), next(states);
    std::vector<std::int16_t> leans(static_cast<std::size_t>(parts) * states, 0);
    const std::array<LeanRow, kLeans> turns = costs_of_turns(bend), none = costs_of_turns(0);
    for (int part = 0; part < parts; ++part) {
      const auto from = static_cast<std::size_t>(std::lround(part * length));
      const auto to = static_cast<std::size_t>(std::lround((part + 1) * length));
      const std::array<LeanRow, kLeans>& turn_costs = part > 0 ? turns : none;
      std::fill(next.begin(), next.end(), std::numeric_limits<double>::infinity());
      for (int before = 0; before < places; ++before) {
        // The best that a part which begins here can follow, by how it leans itself.
        LeanRow least, was;
        least.fill(std::numeric_limits<double>::infinity()), was.fill(kLean);
        const double* totals = total.data() + static_cast<std::size_t>(before) * kLeans;
        // Whatever it is, it costs no more than after the cheapest.
        const auto cheapest = static_cast<std::size_t>(std::min_element(totals, totals + kLeans) - totals);
        const double enough =
            totals[cheapest] + std::max(turn_costs[cheapest].front(), turn_costs[cheapest][kLeans - 1]);
        for (std::size_t k = 0; k < kLeans; ++k) {
          const double so_far = totals[k], number = static_cast<double>(k);
          if (so_far > enough) continue;
          for (std::size_t lean = 0; lean < kLeanRow; ++lean) {
            const double cost = so_far + turn_costs[k][lean];
            const bool less = cost < least[lean];
            least[lean] = less ? cost : least[lean], was[lean] = less ? number : was[lean];
          }
        }
        for (int lean = -kLean; lean <= kLean; ++lean) {
          const int place = before + lean;
          if (place < 0 || place >= places) continue;
          const auto row = static_cast<std::size_t>(lean + kLean);
          const std::size_t state = static_cast<std::size_t>(place) * kLeans + row;
          leans[static_cast<std::size_t>(part) * states + state] = static_cast<std::int16_t>(was[row] - kLean);
          const LeanLimits& limit = limits[static_cast<std::size_t>(part * places + place)];
          const double beyond = std::max({0, limit.least - lean, lean - limit.most});
          next[state] = least[row] + cost_of_part(from, to, before * quantum, place * quantum) +
                        beyond * static_cast<double>(kForbidden);
        }
      }
      std::swap(total, next);
    }
    std::size_t state = static_cast<std::size_t>(std::min_element(total.begin(), total.end()) - total.begin());
    std::vector<double> corners(static_cast<std::size_t>(parts) + 1);
    for (int part = parts; part-- > 0;) {
      const int place = static_cast<int>(state / kLeans), lean = static_cast<int>(state % kLeans) - kLean;
      corners[static_cast<std::size_t>(part) + 1] = low_ + place * quantum;
      corners[static_cast<std::size_t>(part)] = low_ + (place - lean) * quantum;
      const int was = leans[static_cast<std::size_t>(part) * states + state];
      state = static_cast<std::size_t>(place - lean) * kLeans + static_cast<std::size_t>(was + kLean);
    }
    return spline(corners, length);
  }

 private:
  struct Corridor {
    double low, high;
  };

  double& total(std::size_t i, std::size_t k) { return totals_[i * width_ + k]; }

  // before_, after_: what each pixel costs on either side of the line.
  void measure() {
    before_.assign(count_ * width_, 0), after_.assign(count_ * width_, 0);
    const auto fill = [&](const std::vector<std::size_t>& faces, std::vector<float>& into) {
      for (const std::size_t f : faces)
        for (std::size_t k = 0; k < width_; ++k) {
          const int across = low_ + static_cast<int>(k);
          const int from = std::max(line_.first, first_middle_from(view_.begin(f, across + 0.5)));
          const int to =
              std::min(line_.first + static_cast<int>(count_), first_middle_from(view_.end(f, across + 0.5)));
          for (int along = from; along < to; ++along)
            into[static_cast<std::size_t>(along - line_.first) * width_ + k] = view_.cost(costs_[f], along, across);
        }
    };
    fill(view_.before(), before_), fill(view_.after(), after_);
  }

  // totals_: what all pixels of a row cost when it is cut before pixel low_ + k.
  void add_up() {
    totals_.assign(count_ * width_, 0);
    for (std::size_t i = 0; i < count_; ++i) {
      double sum = 0;
      for (std::size_t k = 0; k + 1 < width_; ++k) sum += static_cast<double>(after_[i * width_ + k]);
      total(i, 0) = sum;
      for (std::size_t k = 1; k < width_; ++k) {
        sum += static_cast<double>(before_[i * width_ + k - 1]) - static_cast<double>(after_[i * width_ + k - 1]);
        total(i, k) = sum;
      }
    }
  }

  // Where the gap to the lines on the far sides is kept.
  Corridor between_far_sides(std::size_t i) const {
    const double along = line_.first + static_cast<int>(i) + 0.5;
    Corridor out{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (const std::size_t f : view_.before())
      if (covers(f, i)) out.low = std::max(out.low, view_.far_before(f, along) + options_.gap);
    for (const std::size_t f : view_.after())
      if (covers(f, i)) out.high = std::min(out.high, view_.far_after(f, along) - options_.gap);
    return out;
  }

  // A line that leans by kLean quanta in a part of kStride turns by 40 degrees from where the layout has it.
  static constexpr int kLean = 5, kStride = 6;
  static constexpr std::size_t kLeans = 2 * kLean + 1, kLeanRow = 12;
  // A number for each lean, and one more, so that they fill registers.
  using LeanRow = std::array<double, kLeanRow>;
  // By how the part before leans, then the part itself.
  static std::array<LeanRow, kLeans> costs_of_turns(double bend) {
    std::array<LeanRow, kLeans> out{};
    for (std::size_t was = 0; was < kLeans; ++was)
      for (std::size_t lean = 0; lean < kLeanRow; ++lean) {
        const int turn = static_cast<int>(lean) - static_cast<int>(was);
        out[was][lean] = bend * turn * turn;
      }
    return out;
  }

  // How a part that ends there may lean: where lines meet, at angles of 45 to 135 degrees.
  struct LeanLimits {
    int least = -kLean, most = kLean;
  };
  std::vector<LeanLimits> lean_limits(int parts, double length, int places, double quantum) const {
    const double kSteepest = 0.75;  // of the two lines' slopes, added up
    std::vector<LeanLimits> out(static_cast<std::size_t>(parts * places));
    for (const int other : view_.meeting())
      for (int place = 0; place < places; ++place) {
        double along = view_.along_size(), slope = 0;
        const auto limit = [&](double at, double leans) {
          for (int part = std::max(0, static_cast<int>((at - line_.first - options_.corner) / length));
               part < parts && part * length + line_.first < at + options_.corner; ++part) {
            LeanLimits& it = out[static_cast<std::size_t>(part * places + place)];
            it.least = std::max(it.least, static_cast<int>(std::ceil((-kSteepest - leans) * kStride)));
            it.most = std::min(it.most, static_cast<int>(std::floor((kSteepest - leans) * kStride)));
          }
        };
        if (other == FaceLines::kBorder) {
          limit(0, 0), limit(along, 0);
          continue;
        }
        std::tie(along, slope) = view_.meets(other, low_ + place * quantum);
        limit(along, slope);
      }
    return out;
  }

  // Of a straight part, at places above low_, between pixels `from` and `to` along.
  double cost_of_part(std::size_t from, std::size_t to, double begin, double end) const {
    double sum = 0;
    const double step = (end - begin) / static_cast<double>(to - from);
    for (std::size_t i = from; i < to; ++i) {
      const double place = begin + (static_cast<double>(i - from) + 0.5) * step;
      const auto k = std::min(static_cast<std::size_t>(place), width_ - 2);
      const double* row = totals_.data() + i * width_;
      sum += row[k] + (place - static_cast<double>(k)) * (row[k + 1] - row[k]);
    }
    return sum;
  }

  std::vector<double> spline(const std::vector<double>& corners, double length) const {
    const auto corner = [&](std::ptrdiff_t k) {
      const auto last = static_cast<std::ptrdiff_t>(corners.size()) - 1;
      if (k < 0) return 2 * corners.front() - corners[1];
      return k > last ? 2 * corners.back() - corners[static_cast<std::size_t>(last - 1)]
                      : corners[static_cast<std::size_t>(k)];
    };
    std::vector<double> out(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const double place = (static_cast<double>(i) + 0.5) / length;
      const auto k = static_cast<std::ptrdiff_t>(place);
      const double t = place - static_cast<double>(k), s = 1 - t;
      out[i] = (s * s * s * corner(k - 1) + (3 * t * t * t - 6 * t * t + 4) * corner(k) +
                (3 * s * s * s - 6 * s * s + 4) * corner(k + 1) + t * t * t * corner(k + 2)) /
               6;
    }
    return out;
  }

  void bound() {
    for (std::size_t i = 0; i < count_; ++i) {
      auto [least, most] = between_far_sides(i);
      if (!line_.curved.empty()) {
        least = std::max(least, line_.home(i) - options_.reach);
        most = std::min(most, line_.home(i) + options_.reach);
      }
      for (const auto& [along, across] : line_.through)
        if (std::abs(line_.first + static_cast<double>(i) + 0.5 - along) <= 1)
          least = std::max(least, across - 1), most = std::min(most, across + 1);
      for (std::size_t k = 0; k < width_; ++k) {
        const double at = low_ + static_cast<int>(k);
        const double beyond = std::max({0.0, least - at, at - most});
        if (beyond > 0) total(i, k) += static_cast<double>(kForbidden) * beyond;
      }
    }
  }

  bool covers(std::size_t face, std::size_t i) const {
    const double along = line_.first + static_cast<int>(i) + 0.5, across = line_.home(i);
    return along >= view_.begin(face, across) - options_.reach / 2 &&
           along <= view_.end(face, across) + options_.reach / 2;
  }

  std::vector<double> cheapest() {
    std::vector<signed char> steps(count_ * width_);
    for (std::size_t i = 1; i < count_; ++i)
      for (std::size_t k = 0; k < width_; ++k) {
        double best = total(i - 1, k);
        signed char step = 0;
        if (k > 0 && total(i - 1, k - 1) + options_.bend < best) best = total(i - 1, k - 1) + options_.bend, step = -1;
        if (k + 1 < width_ && total(i - 1, k + 1) + options_.bend < best)
          best = total(i - 1, k + 1) + options_.bend, step = 1;
        total(i, k) += best;
        steps[i * width_ + k] = step;
      }
    std::size_t k = 0;
    for (std::size_t other = 1; other < width_; ++other)
      if (total(count_ - 1, other) < total(count_ - 1, k)) k = other;
    std::vector<double> out(count_);
    for (std::size_t i = count_; i-- > 0;) {
      out[i] = low_ + static_cast<int>(k);
      k = static_cast<std::size_t>(static_cast<int>(k) + steps[i * width_ + k]);
    }
    return out;
  }

  const CutLine& line_;
  LineView view_;
  std::span<const FaceCost> costs_;
  const CutOptions& options_;
  int low_ = 0, high_ = 0;
  std::size_t width_ = 0, count_ = 0;
  std::vector<float> before_, after_;
  std::vector<double> totals_;
};

}  // namespace

double CutLine::operator()(double along) const {
  const double place = std::clamp(along - first - 0.5, 0.0, static_cast<double>(at.size() - 1));
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, at.size() - 1);
  return at[low] + (place - static_cast<double>(low)) * (at[high] - at[low]);
}

CutLines cut_lines(std::span<const PixelRectangle> rectangles, double width, double height, cv::Size picture,
                   double reach) {
  CutLines out{picture.width, picture.height, width, height, {}, {}};
  std::vector<Run> upright, level;
  for (const PixelRectangle& it : rectangles) {
    if (it.left > 0.5) upright.push_back({it.left, it.top, it.bottom});
    if (it.top > 0.5) level.push_back({it.top, it.left, it.right});
  }
  add_lines(true, upright, picture.height, reach, out);
  add_lines(false, level, picture.width, reach, out);
  for (const PixelRectangle& it : rectangles)
    out.faces.push_back(
        {line_at(out, true, it.left, it.top, it.bottom), line_at(out, true, it.right, it.top, it.bottom),
         line_at(out, false, it.top, it.left, it.right), line_at(out, false, it.bottom, it.left, it.right)});
  return out;
}

void recut(CutLines& lines, std::size_t number, std::span<const FaceCost> costs, const CutOptions& options) {
  lines.lines[number].at = Recut(lines, number, costs, options).run();
}

void recut_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (const bool upright : {true, false})
      for (std::size_t i = 0; i < lines.lines.size(); ++i)
        if (lines.lines[i].upright == upright) recut(lines, i, costs, options);
}

void smooth_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, double stride, double bend,
                int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < lines.lines.size(); ++i)
      lines.lines[i].at = Recut(lines, i, costs, options).smoothest(stride, bend);
}

}  // namespace veneer::planner
