// All patches choosing together against greedy, on ten pairs of picture and panel: how much the plan's cost falls and
// how much longer planning takes, with 5, 2 and 1.3 times as much wood as the picture has. The small panel, and four
// parts of the large one that are as large as it; "global_large" are four pictures on the whole of the large panel.
//
// Pictures come from the developer's data set beside the sources (VENEER_DATA names another folder); without it nothing
// is measured. Times are of the whole of make_plan, wall clock and processor, both plans one after the other on two
// threads. "mean" averages over the pairs, measuring those that have not been measured yet.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "planner/layout/grid.h"
#include "planner/pictures/pictures.h"
#include "planner/plan.h"
#include "planner/problem/priority.h"
#include "tests/bench/data_folder.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;

constexpr double kDpi = 300;
constexpr double kPatchPixels = 48;

struct Pair {
  std::string target, panel;
  cv::Rect2d part{0, 0, 1, 1};  // of the panel, in its sides
};
const std::vector<Pair> kPairs{{"astronaut_head.png", "small"},
                               {"chelsea.png", "small"},
                               {"coffee.png", "small"},
                               {"grace_hopper.jpg", "small"},
                               {"parrots.png", "small"},
                               {"statue.png", "small"},
                               {"astronaut.png", "large", {0, 0, 0.5, 0.5}},
                               {"raccoon.jpg", "large", {0.5, 0, 0.5, 0.5}},
                               {"parrots.png", "large", {0, 0.5, 0.5, 0.5}},
                               {"astronaut_head.png", "large", {0.5, 0.5, 0.5, 0.5}}};
const std::vector<Pair> kLargePairs{
    {"astronaut.png", "large"}, {"raccoon.jpg", "large"}, {"parrots.png", "large"}, {"astronaut_head.png", "large"}};

// How the wood is cut down to so many times the picture's area.
enum class Mask {
  kOwn,     // all usable wood of the panel: the picture's size follows, and at 1.3 not all patches can have wood
  kPacked,  // just around a packing of all patches, so that it is known that they fit
};
struct Wood {
  std::string name;
  double times;
  Mask mask;
};
const std::vector<Wood> kWoods{
    {"5x", 5, Mask::kOwn}, {"2x", 2, Mask::kOwn}, {"1.3x", 1.3, Mask::kOwn}, {"1.3x_packed", 1.3, Mask::kPacked}};

struct Spent {
  double wall = 0, processor = 0;
};

struct Measured {
  Artwork artwork;
  Plan greedy, global;
  Spent greedy_spent, global_spent;
  // Of the pieces that greedy could place.
  double cost_where_greedy_placed() const {
    double sum = 0;
    for (std::size_t i = 0; i < greedy.pieces.size(); ++i)
      if (greedy.pieces[i].placement) sum += global.pieces[i].cost;
    return sum;
  }
};

Plan timed(const Artwork& artwork, const StockPanel& panel, const PlanOptions& options, Spent& spent) {
  const auto wall = std::chrono::steady_clock::now();
  const std::clock_t processor = std::clock();
  const Result<Plan> plan = make_plan({&artwork, 1}, {&panel, 1}, options);
  spent.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count();
  spent.processor = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
  if (!plan.ok()) {
    fmt::print(stderr, "global_bench: {}\n", plan.error().message);
    std::exit(1);
  }
  return *plan;
}

void grow(cv::Mat& mask, int pixels) {
  cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1}));
}

// Blocks of patches side by side, each block turned by one of the rotations, until there is room for `wanted` patches;
// then all that grows until the mask has `area` pixels. A patch takes `side` pixels with its kerf.
cv::Mat packed_mask(const cv::Mat& free, std::size_t wanted, cv::Size2d side, int rotations, double area,
                    std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat mask(free.size(), CV_8UC1, cv::Scalar(0));
  for (std::size_t placed = 0, tried = 0; placed < wanted && tried < 2000000; ++tried) {
    // Large blocks first, single patches when nothing else fits any more.
    const int most = tried < 2000 ? 6 : tried < 20000 ? 3 : 1;
    const int columns = random.uniform(1, most + 1), rows = random.uniform(1, most + 1);
    const double angle = 2 * CV_PI * random.uniform(0, rotations) / rotations;
    const cv::Point2d centre{random.uniform(0.0, static_cast<double>(free.cols)),
                             random.uniform(0.0, static_cast<double>(free.rows))};
    std::vector<cv::Point> corners;
    bool inside = true;
    for (const auto& [u, v] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      const double x = u * (columns * side.width + 2) / 2, y = v * (rows * side.height + 2) / 2;
      corners.emplace_back(cvRound(centre.x + std::cos(angle) * x + std::sin(angle) * y),
                           cvRound(centre.y + std::cos(angle) * y - std::sin(angle) * x));
      inside = inside && cv::Rect({0, 0}, free.size()).contains(corners.back());
    }
    if (!inside) continue;
    const cv::Rect box = cv::boundingRect(corners);
    for (cv::Point& corner : corners) corner -= box.tl();
    cv::Mat block(box.size(), CV_8UC1, cv::Scalar(0));
    cv::fillConvexPoly(block, corners, cv::Scalar(255));
    if (cv::countNonZero(block & (~free(box) | mask(box))) > 0) continue;
    mask(box) |= block;
    placed += static_cast<std::size_t>(columns * rows);
  }
  while (cv::countNonZero(mask) < area) {
    const int before = cv::countNonZero(mask);
    grow(mask, 1);
    mask &= free;
    if (cv::countNonZero(mask) == before) break;
  }
  return mask;
}

std::optional<Measured> measure(const Pair& pair, const Wood& wood) {
  const fs::path data = bench::data_folder();
  const std::string name = (data / "wood" / ("panel_" + pair.panel)).string();
  const Result<cv::Mat> picture = load_picture(data / "targets" / pair.target);
  Result<cv::Mat> scan = load_picture(name + ".jpg"), mask = load_mask(name + "_mask.png");
  if (!picture.ok() || !scan.ok() || !mask.ok()) return std::nullopt;
  const cv::Rect part(cvRound(pair.part.x * scan->cols), cvRound(pair.part.y * scan->rows),
                      cvRound(pair.part.width * scan->cols), cvRound(pair.part.height * scan->rows));
  *scan = (*scan)(part).clone(), *mask = (*mask)(part).clone();

  StockPanel panel;
  panel.id = {pair.panel};
  panel.picture.pixels = *scan, panel.free.pixels = *mask;
  panel.picture.resolution = panel.free.resolution = ScanResolution::from_dpi(kDpi);
  PlanOptions options;
  options.patch = panel.picture.resolution.to_mm(Pixels(kPatchPixels)), options.dpi = kDpi, options.threads = 2;

  const double usable = cv::countNonZero(*mask);
  // Of packed wood, only so much that blocks still find a place on the panel.
  const double area = wood.mask == Mask::kOwn ? usable / wood.times : usable / 4;
  const double aspect = static_cast<double>(picture->cols) / picture->rows;
  const Millimetres shorter = panel.picture.resolution.to_mm(Pixels(std::sqrt(area * std::min(aspect, 1 / aspect))));
  const ArtworkSize size = artwork_size(*picture, shorter);
  const Artwork artwork{pair.target, "A", *picture, size.width, size.height};
  if (wood.mask == Mask::kPacked) {
    const GridSize grid = grid_size(size.width, size.height, options.patch);
    const Millimetres spacing = 2 * (options.kerf + Millimetres(0.01));
    const cv::Size2d side(panel.picture.resolution.to_px(size.width / grid.columns + spacing).count(),
                          panel.picture.resolution.to_px(size.height / grid.rows + spacing).count());
    panel.free.pixels = packed_mask(*mask, static_cast<std::size_t>(grid.rows * grid.columns), side, options.rotations,
                                    wood.times * area, 1);
  }

  Measured out{artwork, {}, {}, {}, {}};
  out.greedy = timed(artwork, panel, options, out.greedy_spent);
  options.optimize = Optimize::kGlobal;
  out.global = timed(artwork, panel, options, out.global_spent);
  return out;
}

// Where the patches without wood lie among all, from the most salient (0) to the least (100), on the mean.
double holes_at_percent(const Artwork& artwork, const Plan& plan) {
  std::vector<Patch> patches;
  for (const Piece& piece : plan.pieces) patches.push_back({piece.row, piece.column, piece.artwork_outline});
  SaliencyMaps maps;
  const std::vector<std::size_t> order = by_urgency(urgencies(artwork, patches, Priority::kSaliency, maps));
  double sum = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (!plan.pieces[order[k]].placement) sum += static_cast<double>(k) + 0.5;
  return 100 * sum / static_cast<double>(order.size() * std::max<std::size_t>(1, unfilled(plan)));
}

std::string name_of(const Pair& pair) {
  const char* part = pair.part.width < 1 ? "_part" : "";
  return fs::path(pair.target).stem().string() + "_" + pair.panel + part;
}

using Figures = std::map<std::string, double>;

std::optional<Figures> figures(const Pair& pair, const Wood& wood) {
  static std::map<std::string, std::optional<Figures>> known;
  auto [entry, fresh] = known.try_emplace(name_of(pair) + wood.name);
  if (!fresh) return entry->second;
  const std::optional<Measured> measured = measure(pair, wood);
  if (!measured) return std::nullopt;
  const double greedy = cost_total(measured->greedy);
  entry->second = Figures{
      {"pieces", static_cast<double>(measured->greedy.pieces.size())},
      {"greedy_unfilled", static_cast<double>(unfilled(measured->greedy))},
      {"unfilled", static_cast<double>(unfilled(measured->global))},
      {"holes_at_percent", holes_at_percent(measured->artwork, measured->global)},
      {"greedy_cost", greedy},
      {"cost", cost_total(measured->global)},
      {"gain_percent", 100 * (1 - measured->cost_where_greedy_placed() / greedy)},
      {"greedy_s", measured->greedy_spent.wall},
      {"greedy_processor_s", measured->greedy_spent.processor},
      {"x_wall", measured->global_spent.wall / measured->greedy_spent.wall},
      {"x_processor", measured->global_spent.processor / measured->greedy_spent.processor},
  };
  return entry->second;
}

void show(benchmark::State& state, const std::vector<Pair>& pairs, const Wood& wood) {
  Figures sums;
  for (auto _ : state) {
    for (const Pair& pair : pairs) {
      const std::optional<Figures> of_pair = figures(pair, wood);
      if (!of_pair) return state.SkipWithError("the developer's pictures are not there");
      for (const auto& [name, value] : *of_pair) sums[name] += value;
    }
  }
  for (const auto& [name, value] : sums) state.counters[name] = value / static_cast<double>(pairs.size());
}

const int kRegistered = [] {
  const auto add = [](const std::string& name, const std::vector<Pair>& pairs, const Wood& wood) {
    benchmark::RegisterBenchmark(
        (name.substr(0, name.find('/')) + "/" + wood.name + name.substr(name.find('/'))).c_str(),
        [pairs, wood](benchmark::State& state) { show(state, pairs, wood); })
        ->Iterations(1)
        ->Unit(benchmark::kSecond);
  };
  for (const Wood& wood : kWoods) {
    for (const Pair& pair : kPairs) add("global/" + name_of(pair), {pair}, wood);
    add("global/mean", kPairs, wood);
    for (const Pair& pair : kLargePairs) add("global_large/" + name_of(pair), {pair}, wood);
  }
  return 0;
}();

}  // namespace
}  // namespace veneer::planner
