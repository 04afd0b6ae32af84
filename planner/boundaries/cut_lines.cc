#include "planner/boundaries/cut_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "planner/matching/clones.h"

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
  // What it costs to give a face the pixels at one place across, from `from` to `to` along.
  template <class Take>
  void costs(const FaceCost& face, int across, int from, int to, Take take) const {
    if (from >= to) return;
    const cv::Rect& window = face.window;
    const int begin = line_.upright ? window.y : window.x, end = begin + (line_.upright ? window.height : window.width);
    const int aside = across - (line_.upright ? window.x : window.y);
    const bool there = aside >= 0 && aside < (line_.upright ? window.width : window.height);
    const int first = there ? std::clamp(begin, from, to) : to, last = there ? std::clamp(end, first, to) : to;
    for (int along = from; along < first; ++along) take(along, kForbidden);
    for (int along = first; along < last; ++along)
      take(along,
           line_.upright ? face.cost.ptr<float>(along - begin)[aside] : face.cost.ptr<float>(aside)[along - begin]);
    for (int along = last; along < to; ++along) take(along, kForbidden);
  }

 private:
  const CutLines& lines_;
  const CutLine& line_;
  std::vector<std::size_t> before_, after_;
};

// A line that leans by kLean quanta in a part of kStride turns by 40 degrees from where the layout has it.
constexpr int kLean = 5, kStride = 6;
constexpr std::size_t kLeans = 2 * kLean + 1;
using LeanCosts = std::array<std::array<double, kLeans>, kLeans>;

// A number for each way that a part may lean and each place where it may end: those of one lean side by side.
struct StatesOfPart {
  static constexpr std::size_t kLanes = 8;
  StatesOfPart(int places, double number)
      : stride((static_cast<std::size_t>(places) + kLanes - 1) / kLanes * kLanes), numbers(kLeans * stride, number) {}
  double* of(std::size_t lean) { return numbers.data() + lean * stride; }
  const double* of(std::size_t lean) const { return numbers.data() + lean * stride; }
  std::size_t stride;  // a multiple of kLanes
  std::vector<double> numbers;
};

// For each lean and place, what a part that leans so from there can follow best: how the part before leans that costs
// least with the turn, and what that costs.
VENEER_CLONES void follow(const StatesOfPart& total, const LeanCosts& turns, StatesOfPart& least, StatesOfPart& was) {
  constexpr std::size_t kLanes = StatesOfPart::kLanes;
  const std::size_t stride = total.stride;
  const double* from = total.numbers.data();
  double *to = least.numbers.data(), *to_was = was.numbers.data();
  for (std::size_t first = 0; first < stride; first += kLanes)
    for (std::size_t lean = 0; lean < kLeans; ++lean) {
      double costs[kLanes], befores[kLanes];
      for (std::size_t i = 0; i < kLanes; ++i) costs[i] = std::numeric_limits<double>::infinity(), befores[i] = kLean;
      for (std::size_t before = 0; before < kLeans; ++before) {
        const double turn = turns[before][lean], number = static_cast<double>(before);
        const double* totals = from + before * stride + first;
        for (std::size_t i = 0; i < kLanes; ++i) {
          const double cost = totals[i] + turn;
          const bool less = cost < costs[i];
          costs[i] = less ? cost : costs[i], befores[i] = less ? number : befores[i];
        }
      }
      for (std::size_t i = 0; i < kLanes; ++i)
        to[lean * stride + first + i] = costs[i], to_was[lean * stride + first + i] = befores[i];
    }
}

// Adds, for each of `count` places, what lies by its share of the way from its pixel of the row to the next one.
VENEER_CLONES void add_between(const double* row, const std::uint32_t* pixels, const double* shares, std::size_t count,
                               double* sums) {
  for (std::size_t i = 0; i < count; ++i) {
    const double here = row[pixels[i]], next = row[pixels[i] + 1];
    sums[i] += here + shares[i] * (next - here);
  }
}

// First pixel whose middle is at or beyond `at`.
int first_middle_from(double at) { return static_cast<int>(std::ceil(at - 0.5)); }

class Reroute {
 public:
  Reroute(const CutLines& lines, std::size_t number, std::span<const FaceCost> costs, const CutOptions& options)
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
  // cubic B-spline with these corners for controls. Dynamic programming over where a part ends and how it leans; for
  // each way to lean, all places at once.
  std::vector<double> smoothest(double stride, double bend) {
    if (high_ <= low_) return line_.at;
    measure();
    add_up();
    bound();
    const double quantum = stride / kStride;
    const int places = static_cast<int>(std::floor((high_ - low_) / quantum)) + 1;
    const int parts = std::max(1, static_cast<int>(std::lround(static_cast<double>(count_) / stride)));
    const double length = static_cast<double>(count_) / parts;
    part_costs_.resize(static_cast<std::size_t>(places));
    std::map<std::size_t, Way> ways;  // by pixels along: parts have one or two lengths
    const std::vector<LeanLimits> limits = lean_limits(parts, length, places, quantum);
    constexpr double kNever = std::numeric_limits<double>::infinity();
    StatesOfPart total(places, kNever), least(places, kNever), was(places, kLean);
    for (std::size_t lean = 0; lean < kLeans; ++lean) std::fill_n(total.of(lean), places, 0.0);
    std::vector<signed char> leans(static_cast<std::size_t>(parts) * static_cast<std::size_t>(places) * kLeans);
    const LeanCosts turns = costs_of_turns(bend), none = costs_of_turns(0);
    for (int part = 0; part < parts; ++part) {
      const auto from = static_cast<std::size_t>(std::lround(part * length));
      const auto to = static_cast<std::size_t>(std::lround((part + 1) * length));
      const auto [way, fresh] = ways.try_emplace(to - from);
      if (fresh) way->second = way_of(to - from, places, quantum);
      follow(total, part > 0 ? turns : none, least, was);
      std::fill(total.numbers.begin(), total.numbers.end(), kNever);
      for (int lean = -kLean; lean <= kLean; ++lean) {
        // Places where such a part may begin.
        const int first = std::max(0, -lean), last = std::min(places, places - lean);
        if (first >= last) continue;
        const auto row = static_cast<std::size_t>(lean + kLean);
        add_cost_of_parts(way->second, from, to, lean, first, last, places);
        for (int before = first; before < last; ++before) {
          const int place = before + lean;
          total.of(row)[place] = least.of(row)[before] + part_costs_[static_cast<std::size_t>(before)];
          leans[state(part, place, places, row)] = static_cast<signed char>(was.of(row)[before] - kLean);
        }
      }
      for (int place = 0; place < places; ++place) {
        const LeanLimits& limit = limits[static_cast<std::size_t>(part * places + place)];
        if (limit.least == -kLean && limit.most == kLean) continue;
        for (int lean = -kLean; lean <= kLean; ++lean)
          total.of(static_cast<std::size_t>(lean + kLean))[place] +=
              std::max({0, limit.least - lean, lean - limit.most}) * static_cast<double>(kForbidden);
      }
    }
    int place = 0;
    std::size_t row = 0;
    for (int other = 0; other < places; ++other)
      for (std::size_t lean = 0; lean < kLeans; ++lean)
        if (total.of(lean)[other] < total.of(row)[place]) place = other, row = lean;
    std::vector<double> corners(static_cast<std::size_t>(parts) + 1);
    for (int part = parts; part-- > 0;) {
      const int lean = static_cast<int>(row) - kLean;
      corners[static_cast<std::size_t>(part) + 1] = low_ + place * quantum;
      corners[static_cast<std::size_t>(part)] = low_ + (place - lean) * quantum;
      row = static_cast<std::size_t>(leans[state(part, place, places, row)] + kLean);
      place -= lean;
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
          view_.costs(costs_[f], across, from, to, [&](int along, float cost) {
            into[static_cast<std::size_t>(along - line_.first) * width_ + k] = cost;
          });
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

  // Where the gap to the lines on the far sides is kept, for each pixel along.
  std::vector<Corridor> between_far_sides() const {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    std::vector<Corridor> out(count_, {-kFar, kFar});
    const auto narrow = [&](const std::vector<std::size_t>& faces, const auto& narrowed) {
      for (const std::size_t f : faces) {
        double begin = view_.begin(f, line_.straight), end = view_.end(f, line_.straight);
        for (std::size_t i = 0; i < count_; ++i) {
          const double along = line_.first + static_cast<int>(i) + 0.5;
          if (!line_.curved.empty()) begin = view_.begin(f, line_.home(i)), end = view_.end(f, line_.home(i));
          if (along >= begin - options_.reach / 2 && along <= end + options_.reach / 2) narrowed(out[i], f, along);
        }
      }
    };
    narrow(view_.before(), [&](Corridor& it, std::size_t f, double along) {
      it.low = std::max(it.low, view_.far_before(f, along) + options_.gap);
    });
    narrow(view_.after(), [&](Corridor& it, std::size_t f, double along) {
      it.high = std::min(it.high, view_.far_after(f, along) - options_.gap);
    });
    return out;
  }

  static std::size_t state(int part, int place, int places, std::size_t row) {
    return (static_cast<std::size_t>(part) * static_cast<std::size_t>(places) + static_cast<std::size_t>(place)) *
               kLeans +
           row;
  }
  // By how the part before leans, then the part itself.
  static LeanCosts costs_of_turns(double bend) {
    LeanCosts out{};
    for (std::size_t was = 0; was < kLeans; ++was)
      for (std::size_t lean = 0; lean < kLeans; ++lean) {
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

  // Where straight parts of so many pixels along pass each of them: between which pixels of its row, for each lean and
  // each place where the part begins.
  struct Way {
    std::vector<std::uint32_t> pixel;
    std::vector<double> share;  // of the way to the next one
  };
  Way way_of(std::size_t length, int places, double quantum) const {
    Way out;
    out.pixel.resize(length * kLeans * static_cast<std::size_t>(places)), out.share.resize(out.pixel.size());
    std::size_t to = 0;
    for (std::size_t i = 0; i < length; ++i)
      for (int lean = -kLean; lean <= kLean; ++lean)
        for (int place = 0; place < places; ++place, ++to) {
          if (place + lean < 0 || place + lean >= places) continue;
          const double begin = place * quantum, end = (place + lean) * quantum;
          const double at = begin + (static_cast<double>(i) + 0.5) * ((end - begin) / static_cast<double>(length));
          out.pixel[to] = static_cast<std::uint32_t>(std::min(static_cast<std::size_t>(at), width_ - 2));
          out.share[to] = at - out.pixel[to];
        }
    return out;
  }

  // part_costs_: of straight parts that lean alike between pixels `from` and `to` along, which begin at the places from
  // `first` up to `last`.
  void add_cost_of_parts(const Way& way, std::size_t from, std::size_t to, int lean, int first, int last, int places) {
    const auto begin = static_cast<std::size_t>(first), count = static_cast<std::size_t>(last - first);
    std::fill_n(part_costs_.data() + begin, count, 0.0);
    for (std::size_t i = from; i < to; ++i) {
      const std::size_t at =
          ((i - from) * kLeans + static_cast<std::size_t>(lean + kLean)) * static_cast<std::size_t>(places) + begin;
      add_between(totals_.data() + i * width_, way.pixel.data() + at, way.share.data() + at, count,
                  part_costs_.data() + begin);
    }
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
    const std::vector<Corridor> corridors = between_far_sides();
    for (std::size_t i = 0; i < count_; ++i) {
      auto [least, most] = corridors[i];
      if (!line_.curved.empty()) {
        least = std::max(least, line_.home(i) - options_.reach);
        most = std::min(most, line_.home(i) + options_.reach);
      }
      for (const auto& [along, across] : line_.through)
        if (std::abs(line_.first + static_cast<double>(i) + 0.5 - along) <= 1)
          least = std::max(least, across - 1), most = std::min(most, across + 1);
      if (low_ >= least && high_ <= most) continue;
      for (std::size_t k = 0; k < width_; ++k) {
        const double at = low_ + static_cast<int>(k);
        const double beyond = std::max({0.0, least - at, at - most});
        if (beyond > 0) total(i, k) += static_cast<double>(kForbidden) * beyond;
      }
    }
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
  std::vector<double> part_costs_;
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

void reroute(CutLines& lines, std::size_t number, std::span<const FaceCost> costs, const CutOptions& options) {
  lines.lines[number].at = Reroute(lines, number, costs, options).run();
}

void reroute_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (const bool upright : {true, false})
      for (std::size_t i = 0; i < lines.lines.size(); ++i)
        if (lines.lines[i].upright == upright) reroute(lines, i, costs, options);
}

void smooth_all(CutLines& lines, std::span<const FaceCost> costs, const CutOptions& options, double stride, double bend,
                int rounds) {
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < lines.lines.size(); ++i)
      lines.lines[i].at = Reroute(lines, i, costs, options).smoothest(stride, bend);
}

}  // namespace veneer::planner
