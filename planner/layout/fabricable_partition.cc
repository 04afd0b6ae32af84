#include "planner/layout/fabricable_partition.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "planner/cancelled.h"
#include "planner/cutting/marks.h"
#include "planner/layout/label_partition.h"
#include "planner/layout/label_regions.h"
#include "planner/layout/piece_marks.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

// Straightening takes a little off what the raster had.
constexpr double kSpare = 1.05;
constexpr int kCleanings = 6;

bool is_sound(const Ring<ArtworkFrame>& outline, const FabricationLimits& limits) {
  return outline.size() >= 3 && signed_area(outline) > 0 && !fault_of(outline, limits);
}

// Calls f(label of a, label of b, pixels, first column, row) for each run of pixels that are alike in both.
template <class Run>
void for_each_run(const cv::Mat& a, const cv::Mat& b, const Run& run) {
  for (int r = 0; r < a.rows; ++r) {
    const auto *first = a.ptr<int>(r), *second = b.ptr<int>(r);
    for (int c = 0; c < a.cols;) {
      const int begin = c;
      while (c < a.cols && first[c] == first[begin] && second[c] == second[begin]) ++c;
      run(first[begin], second[begin], c - begin, begin, r);
    }
  }
}

// Both numbered from 0.
RegionFates fates_of(const cv::Mat& before, int regions, const cv::Mat& after, int faces, Millimetres width,
                     Millimetres height) {
  struct Seen {
    std::int64_t pixels = 0;
    double columns = 0, rows = 0;  // summed up
    cv::Point first;
    bool is_face = false;
  };
  std::vector<Seen> seen(static_cast<std::size_t>(regions));
  std::map<std::pair<int, int>, std::int64_t> shared;  // of a face with a region
  for_each_run(before, after, [&](int region, int face, int pixels, int column, int row) {
    Seen& it = seen[static_cast<std::size_t>(region)];
    if (it.pixels == 0) it.first = {column, row};
    it.pixels += pixels;
    it.columns += pixels * (column + (pixels - 1) / 2.0), it.rows += static_cast<double>(pixels) * row;
    shared[{face, region}] += pixels;
  });
  std::vector<std::pair<std::int64_t, int>> most(static_cast<std::size_t>(faces), {0, 0});
  for (const auto& [pair, pixels] : shared) {
    auto& it = most[static_cast<std::size_t>(pair.first)];
    if (pixels > it.first) it = {pixels, pair.second};
  }
  for (const auto& [pixels, region] : most) seen[static_cast<std::size_t>(region)].is_face = true;
  RegionFates out;
  out.regions = seen.size();
  const double columns = before.cols, rows = before.rows;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Seen& it = seen[i];
    if (it.is_face) continue;
    const double pixels = static_cast<double>(it.pixels);
    cv::Point at(static_cast<int>(std::lround(it.columns / pixels)), static_cast<int>(std::lround(it.rows / pixels)));
    if (before.at<int>(at) != static_cast<int>(i)) at = it.first;
    out.merged.push_back({{width * ((at.x + 0.5) / columns), height * (1 - (at.y + 0.5) / rows)},
                          width * height * (pixels / (columns * rows))});
  }
  std::stable_sort(out.merged.begin(), out.merged.end(),
                   [](const RegionFates::Merged& a, const RegionFates::Merged& b) { return a.area > b.area; });
  return out;
}

class Maker {
 public:
  Maker(cv::Mat labels, Millimetres width, Millimetres height, const FabricableOptions& options)
      : labels_(std::move(labels)), width_(width), height_(height), options_(options) {
    const double px_per_mm = std::min(labels_.cols / width.count(), labels_.rows / height.count());
    limits_ = {options.limits.width.count() * px_per_mm * kSpare,
               options.limits.area.count() * px_per_mm * px_per_mm * kSpare};
  }

  Result<Partition> run(const std::stop_token& stop, RegionFates* fates) {
    cv::Mat before;
    int regions = 0;
    if (fates != nullptr) before = labels_.clone(), regions = number_regions(before);
    clean_regions(labels_, limits_);
    for (int round = 0;; ++round) {
      const int count = number_regions(labels_);
      how_.assign(static_cast<std::size_t>(count), Straightening::kFree);
      std::vector<int> faulty;
      Partition out;
      for (const Straightening next : {Straightening::kClose, Straightening::kNone, Straightening::kNone}) {
        if (stop.stop_requested()) return cancelled();
        out = partition_of_labels(labels_, width_, height_, options_.smoothness, how_);
        Result<std::vector<int>> found = faulty_faces(out, stop);
        if (!found.ok()) return found.error();
        faulty = *std::move(found);
        for (const int f : faulty) how_[static_cast<std::size_t>(f)] = next;
        if (faulty.empty()) break;
      }
      if (faulty.empty() || count == 1) {
        if (fates != nullptr) *fates = fates_of(before, regions, labels_, count, width_, height_);
        return with_faces(out, reading_order(out));
      }
      absorb_regions(labels_, faulty);
      // Cleaning may part what was joined; without it regions become fewer each time, so there is an end.
      if (round < kCleanings)
        clean_regions(labels_, limits_);
      else
        fill_holes(labels_);
    }
  }

 private:
  Result<std::vector<int>> faulty_faces(const Partition& partition, const std::stop_token& stop) const {
    std::vector<char> wrong(partition.faces.size(), 0);
    const std::vector<std::size_t> order = reading_order(partition);
    std::vector<std::string> marks;
    if (options_.short_marks) marks = short_marks(order.size());
    for (std::size_t i = 0; i < order.size() && !options_.letter.empty(); ++i)
      marks.push_back(options_.letter + std::to_string(i + 1));
    const Status looked = run_parallel(wrong.size(), options_.threads, stop, [&](std::size_t i) {
      const Ring<ArtworkFrame> outline = outline_of(partition, order[i]);
      const bool sound =
          is_sound(outline, options_.limits) && (marks.empty() || has_spare_room_for_mark(marks[i], outline));
      wrong[order[i]] = sound ? 0 : 1;
    });
    if (!looked.ok()) return looked.error();
    std::vector<int> out;
    for (std::size_t f = 0; f < wrong.size(); ++f)
      if (wrong[f] != 0) out.push_back(static_cast<int>(f));
    return out;
  }

  std::vector<std::size_t> reading_order(const Partition& partition) const {
    using RowXFace = std::tuple<int, double, std::size_t>;
    std::vector<RowXFace> faces;
    for (std::size_t f = 0; f < partition.faces.size(); ++f) {
      const Box<ArtworkFrame> box = bounds(outline_of(partition, f));
      const double y = ((box.min.y + box.max.y) / 2).count(), x = ((box.min.x + box.max.x) / 2).count();
      faces.emplace_back(static_cast<int>(std::floor((height_.count() - y) / options_.row.count())), x, f);
    }
    std::sort(faces.begin(), faces.end());
    std::vector<std::size_t> order;
    order.reserve(faces.size());
    for (const RowXFace& face : faces) order.push_back(std::get<2>(face));
    return order;
  }

  cv::Mat labels_;
  Millimetres width_, height_;
  FabricableOptions options_;
  LabelLimits limits_;
  std::vector<Straightening> how_;
};

}  // namespace

Result<Partition> fabricable_partition(cv::Mat labels, Millimetres width, Millimetres height,
                                       const FabricableOptions& options, const std::stop_token& stop,
                                       RegionFates* fates) {
  return Maker(std::move(labels), width, height, options).run(stop, fates);
}

}  // namespace veneer::planner
