#include "daemon/orders/kept_wood.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <span>

#include "base/hash.h"
#include "daemon/orders/shapes_json.h"
#include "planner/matching/index_cache.h"
#include "planner/pictures/resample.h"
#include "planner/suggest/picture_sketch.h"

namespace veneer::daemon {
namespace {

// Entries of a panel beside those of its indexes, whose classes of windows are few.
enum KeptEntry : std::size_t { kKeptMap = 9001, kKeptFree = 9002 };
enum KeptPart { kKeptSize, kKeptPixels };

// What a picture's entry is asked for with.
struct Wanted {
  std::string panel;
  KeptEntry entry;
  std::string key;
  int type;
};

using PictureSize = std::array<std::int32_t, 2>;  // columns, rows

std::span<std::byte> bytes_of(PictureSize& size) { return std::as_writable_bytes(std::span<std::int32_t>(size)); }

std::span<std::byte> pixels_of(cv::Mat& picture) {
  return {reinterpret_cast<std::byte*>(picture.data), picture.total() * picture.elemSize()};
}

std::string name_of(const Wanted& wanted, KeptPart part) {
  return planner::IndexCache::entry_name(wanted.panel, wanted.entry, part);
}

std::optional<cv::Mat> load(const planner::IndexCache& cache, const Wanted& wanted) {
  constexpr int kMostSide = 1 << 15;
  PictureSize size{};
  const auto found = cache.load(name_of(wanted, kKeptSize), wanted.key, {bytes_of(size)});
  if (!found || !*found || size[0] < 1 || size[1] < 1 || size[0] > kMostSide || size[1] > kMostSide)
    return std::nullopt;
  cv::Mat picture(size[1], size[0], wanted.type);
  const auto whole = cache.load(name_of(wanted, kKeptPixels), wanted.key, {pixels_of(picture)});
  if (!whole || !*whole) return std::nullopt;
  return picture;
}

// What cannot be written is made again.
void keep(const planner::IndexCache& cache, const Wanted& wanted, cv::Mat& picture) {
  PictureSize size{picture.cols, picture.rows};
  if (cache.store(name_of(wanted, kKeptPixels), wanted.key, {pixels_of(picture)}))
    static_cast<void>(cache.store(name_of(wanted, kKeptSize), wanted.key, {bytes_of(size)}).ok());
}

ScanResolution sketch_resolution() { return ScanResolution::from_dpi(planner::kSketchDpi); }

Raster<PanelFrame> coarse_free(const Raster<PanelFrame>& free) {
  // In pixels of its own: those of a copy are the original's.
  Raster<PanelFrame> out{free.pixels > 0, free.resolution, free.origin};
  out = planner::at_resolution(out, sketch_resolution());
  out.pixels = out.pixels == 255;  // a mean that is less has something in it that is not free
  return out;
}

// `make`: the picture itself, at the sketches' resolution.
template <class Make>
Result<Raster<PanelFrame>> kept_or_made(const std::string& index_dir, const Wanted& wanted, Make make) {
  const auto cache = planner::IndexCache::open(index_dir);
  if (!cache) return cache.error();
  if (auto kept = load(*cache, wanted)) return Raster<PanelFrame>{std::move(*kept), sketch_resolution(), {}};
  Result<Raster<PanelFrame>> made = make();
  if (!made) return made.error();
  if (!made->pixels.isContinuous()) made->pixels = made->pixels.clone();
  keep(*cache, wanted, made->pixels);
  return made;
}

// Files are named by what they hold.
std::string name_in(const std::string& file) { return std::filesystem::path(file).filename().string(); }

std::string key_of_free(const HeldPanel& panel, Millimetres margin) {
  const std::string live = nlohmann::json(panel.live).dump();
  return fmt::format("free {} {} {} {}", name_in(panel.mask), margin.count(), planner::kSketchDpi,
                     sha256_hex(std::as_bytes(std::span(live))));
}

}  // namespace

WoodPictures kept_wood(const std::string& index_dir, const WoodPictures& from) {
  return {[index_dir, from](const HeldPanel& panel) {
            const Wanted wanted{panel.id.value, kKeptMap,
                                fmt::format("map {} {}", name_in(panel.map), planner::kSketchDpi), CV_8UC3};
            return kept_or_made(index_dir, wanted, [&]() -> Result<Raster<PanelFrame>> {
              auto map = from.map(panel);
              if (!map) return map.error();
              return planner::at_resolution(*map, sketch_resolution());
            });
          },
          [index_dir, from](const HeldPanel& panel, Millimetres margin) {
            const Wanted wanted{panel.id.value, kKeptFree, key_of_free(panel, margin), CV_8UC1};
            return kept_or_made(index_dir, wanted, [&]() -> Result<Raster<PanelFrame>> {
              const auto free = from.free(panel, margin);
              if (!free) return free.error();
              return coarse_free(*free);
            });
          }};
}

}  // namespace veneer::daemon
