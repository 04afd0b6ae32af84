#include "daemon/stock/panel_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "daemon/orders/panel_wood.h"
#include "planner/matching/index_cache.h"
#include "planner/pictures/png_codec.h"
#include "planner/pictures/tile_pyramid.h"

namespace veneer::daemon {
namespace {

// Of small pictures, all together: some 40 MB, the stock of a workshop as its page shows it.
constexpr std::size_t kKeptPixels = 12'000'000;

// Kept on the disk: what the console and veneerctl ask for.
constexpr std::array kUsualWidths = {640, 1600};

constexpr const char* kBits = "bits";  // of a mask
constexpr const char* kTilesEnd = "-tiles.tif";

// Removes files of `folder` whose names end so, the ones used longest ago first, until they have `most_bytes` all
// together; never `newest`.
void forget_oldest(const std::filesystem::path& folder, std::string_view ending, std::uintmax_t most_bytes,
                   const std::filesystem::path& newest) {
  struct Kept {
    std::filesystem::file_time_type used;
    std::filesystem::path file;
    std::uintmax_t bytes = 0;
  };
  std::vector<Kept> all;
  std::uintmax_t sum = 0;
  std::error_code failed;
  for (std::filesystem::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (!at->path().filename().string().ends_with(ending)) continue;
    std::error_code gone;
    Kept one{at->last_write_time(gone), at->path(), 0};
    if (const auto bytes = at->file_size(gone); !gone) one.bytes = bytes;
    sum += one.bytes;
    if (one.file != newest) all.push_back(std::move(one));
  }
  std::ranges::sort(all, {}, &Kept::used);
  for (auto one = all.begin(); one != all.end() && sum > most_bytes; ++one)
    if (std::filesystem::remove(one->file, failed)) sum -= one->bytes;
}

// The width of a PNG, told by its head alone.
std::optional<int> width_of(const std::filesystem::path& file) {
  std::array<unsigned char, 20> head{};
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(head.data()), head.size()) || head[1] != 'P' || head[0] != 0x89) return {};
  return (head[16] << 24) | (head[17] << 16) | (head[18] << 8) | head[19];
}

cv::Mat narrowed(const cv::Mat& whole, int width_px, double scale) {
  cv::Mat out;
  cv::resize(whole, out, {width_px, std::max(1, cvRound(whole.rows * scale))}, 0, 0, cv::INTER_AREA);
  return out;
}

// What a worker process has made will be decoded by this one. It may have been taken over by a hostile picture: only a
// PNG of the kind the cell stores, of a size that can be, is taken.
Status require_plain_png(const std::filesystem::path& made, std::int64_t most_pixels) {
  constexpr std::array<unsigned char, 16> kHead{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                                0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  std::array<unsigned char, 26> head{};
  std::error_code failed;
  const bool plain = std::filesystem::symlink_status(made, failed).type() == std::filesystem::file_type::regular;
  std::ifstream in(made, std::ios::binary);
  in.read(reinterpret_cast<char*>(head.data()), head.size());
  const auto number = [&](std::size_t at) {
    return (std::int64_t{head[at]} << 24) + (head[at + 1] << 16) + (head[at + 2] << 8) + head[at + 3];
  };
  const bool eight_bit = head[24] == 8 && (head[25] == 0 || head[25] == 2);  // grey or colour
  if (!plain || !in || !std::equal(kHead.begin(), kHead.end(), head.begin()) || !eight_bit)
    return Error{ErrorCode::kInternal,
                 "a picture that was made of this cannot be used: try again, and report it when it "
                 "comes back"};
  const std::int64_t width = number(16), height = number(20);
  if (width <= most_pixels && height <= most_pixels && width * height <= most_pixels) return Ok();
  return Error{
      ErrorCode::kRefused,
      fmt::format("a picture of {} x {} pixels was made of this, and the cell keeps at most {} million (a panel "
                  "of 1500 x 1000 mm at 300 dpi has 209): take less wood, or a smaller artwork, at once",
                  width, height, most_pixels / 1'000'000)};
}

}  // namespace

Result<PanelLibrary::Stored> PanelLibrary::store_picture(const cv::Mat& picture, const std::string& folder,
                                                         const std::string& prefix) const {
  const auto png = planner::encode_png(picture);
  if (!png) return Error{ErrorCode::kInternal, "a picture could not be encoded as PNG"};
  const auto bytes = std::as_bytes(std::span(*png));
  const std::string hash = sha256_hex(bytes);
  const std::string file = fmt::format("{}/{}-{}.png", folder, prefix, hash.substr(0, 16));
  if (const Status written = write_whole(data_dir_ / file, bytes); !written) return written.error();
  return Stored{file, hash};
}

Result<PanelLibrary::Stored> PanelLibrary::adopt(const std::filesystem::path& made, const std::string& folder,
                                                 const std::string& prefix, std::int64_t most_pixels) const {
  if (const Status good = require_plain_png(made, most_pixels); !good) return good.error();
  const auto hash = sha256_hex_of_file(made);
  if (!hash) return hash.error();
  const std::string file = fmt::format("{}/{}-{}.png", folder, prefix, hash->substr(0, 16));
  if (const Status moved = move_whole(made, data_dir_ / file); !moved) return moved.error();
  return Stored{file, *hash};
}

Result<PanelLibrary::Stored> PanelLibrary::store_bytes(std::string_view bytes, const std::string& folder,
                                                       const std::string& name) const {
  const auto data = std::as_bytes(std::span(bytes));
  const std::string file = folder + "/" + name;
  if (const Status written = write_whole(data_dir_ / file, data); !written) return written.error();
  return Stored{file, sha256_hex(data)};
}

Result<cv::Mat> PanelLibrary::load_picture(const std::string& file) const { return read_stored_picture(path_of(file)); }

Result<std::string> PanelLibrary::load_bytes(const std::string& file) const {
  if (auto bytes = read_whole(data_dir_ / file)) return *std::move(bytes);
  return Error{ErrorCode::kStorage,
               fmt::format("cannot read {}: restore it from a backup", (data_dir_ / file).string())};
}

// Of all files that begin so.
void PanelLibrary::drop_small(const std::string& beginning) const {
  std::error_code failed;
  const std::string prefix = small_file(beginning, "").filename().string();
  for (const auto& entry : std::filesystem::directory_iterator(small_dir(), failed))
    if (entry.path().filename().string().starts_with(prefix)) std::filesystem::remove(entry.path(), failed);
}

void PanelLibrary::remove(const std::string& file) const {
  std::error_code failed;
  if (!std::filesystem::exists(path_of(file), failed)) return;
  static_cast<void>(remove_durably(path_of(file)));
  drop_small(file);
}

void PanelLibrary::drop_index(const PanelId& panel) const {
  drop_small("panels/" + panel.value + "/");
  if (auto cache = planner::IndexCache::open(index_dir())) cache->drop(panel.value);
}

void PanelLibrary::drop_mask(const PanelId& panel, const std::string& mask_file) const {
  drop_small(mask_file);
  if (auto cache = planner::IndexCache::open(index_dir())) cache->drop(panel.value);
}

void PanelLibrary::keep_index_only(const std::vector<PanelId>& panels) const {
  std::vector<std::string> names;
  names.reserve(panels.size());
  for (const PanelId& panel : panels) names.push_back(panel.value);
  if (auto cache = planner::IndexCache::open(index_dir())) cache->keep_only(names);
}

Result<Raster<PanelFrame>> PanelLibrary::load_map(const db::PanelRecord& panel) const {
  return read_stored_raster(path_of(panel.map_file));
}

Result<Raster<PanelFrame>> PanelLibrary::load_mask(const db::PanelRecord& panel) const {
  const auto bits = small_file(panel.mask_file, kBits);
  std::error_code failed;
  // Where the mask itself is lost, what is planned from is lost as well.
  if (std::filesystem::exists(path_of(panel.mask_file), failed) && std::filesystem::exists(bits, failed))
    if (auto kept = read_stored_raster(bits)) return kept;
  auto mask = read_stored_raster(path_of(panel.mask_file));
  if (!mask) return mask.error();
  mask->pixels = mask->pixels != 0;
  keep_small(planner::encode_png_mask(mask->pixels), bits);
  return mask;
}

// What cannot be written is made again.
void PanelLibrary::keep_small(const std::optional<std::string>& png, const std::filesystem::path& file) const {
  const std::lock_guard lock(writing_mutex_);
  if (png) static_cast<void>(write_whole(file, std::as_bytes(std::span(*png))));
}

// "panels/P-0001/map-0123.png" as small/panels_P-0001_map-0123.png-1600.png. What is named by its content never
// changes, nor does what is made of it.
std::filesystem::path PanelLibrary::small_file(const std::string& file, const std::string& what) const {
  std::string name = file;
  std::ranges::replace(name, '/', '_');
  return small_dir() / (what.empty() ? name : fmt::format("{}-{}.png", name, what));
}

// Whether all that is made of it is there: the map stays when a mask is painted.
bool PanelLibrary::has_small(const std::string& file, const std::filesystem::path& own) const {
  std::error_code failed;
  const auto width = width_of(path_of(file));
  return width && std::filesystem::exists(own, failed) && std::ranges::all_of(kUsualWidths, [&](int usual) {
           return usual >= *width || std::filesystem::exists(small_file(file, std::to_string(usual)), failed);
         });
}

void PanelLibrary::make_small(const std::string& map_file, const std::string& mask_file) const {
  const auto make = [&](const std::string& file, const std::filesystem::path& own, const auto& make_own) {
    if (has_small(file, own)) return;
    const auto whole = load_picture(file);
    if (!whole) return;
    for (const int width : kUsualWidths)
      if (const double scale = static_cast<double>(width) / whole->cols; scale < 1)
        keep_small(planner::encode_png(narrowed(*whole, width, scale)), small_file(file, std::to_string(width)));
    make_own(*whole);
  };
  make(map_file, tiles_file(map_file), [&](const cv::Mat& map) {
    const std::lock_guard lock(tiles_mutex_);
    if (has_room_for_tiles()) static_cast<void>(make_tiles(map, tiles_file(map_file)));
  });
  make(mask_file, small_file(mask_file, kBits),
       [&](const cv::Mat& mask) { keep_small(planner::encode_png_mask(mask), small_file(mask_file, kBits)); });
}

// What a cut has to be booked in is not taken by pictures for people.
bool PanelLibrary::has_room_for_tiles() const {
  constexpr std::uintmax_t kSpared = 512 << 20;  // bytes: four times the tiles of the largest panel
  std::error_code failed;
  const auto room = std::filesystem::space(data_dir_, failed);
  return failed || room.available >= kSpared;
}

std::filesystem::path PanelLibrary::tiles_file(const std::string& map_file) const {
  return small_file(map_file, "").string() + kTilesEnd;
}

Status PanelLibrary::make_tiles(const cv::Mat& map, const std::filesystem::path& tiles) const {
  if (Status written = planner::write_tile_pyramid(map, tiles); !written) return written;
  forget_oldest(small_dir(), kTilesEnd, most_tile_bytes_, tiles);
  return Ok();
}

// The file is opened, not asked for first: others' tiles may take its place at any time. What was just made is read
// before they may.
template <class Read>
std::invoke_result_t<Read, const std::filesystem::path&> PanelLibrary::read_tiles(const std::string& map_file,
                                                                                  MissingTiles missing,
                                                                                  Read read) const {
  const auto tiles = tiles_file(map_file);
  const auto told = [](const auto& answer) { return answer.ok() || answer.error().code == ErrorCode::kNotFound; };
  if (auto kept = read(tiles); told(kept)) {
    std::error_code failed;
    std::filesystem::last_write_time(tiles, std::filesystem::file_time_type::clock::now(), failed);  // looked at
    return kept;
  }
  if (missing == MissingTiles::kRefuse)
    return Error{ErrorCode::kRefused,
                 "this map is not kept in tiles any more: an operator who looks at it closely has them made again"};
  const std::lock_guard lock(tiles_mutex_);
  if (auto made = read(tiles); told(made)) return made;  // by somebody else meanwhile
  if (!has_room_for_tiles())
    return Error{ErrorCode::kStorage, fmt::format("the disk of {} has too little room left to show a map closely: make "
                                                  "room on it",
                                                  data_dir_.string())};
  const auto whole = load_picture(map_file);
  if (!whole) return whole.error();
  if (const Status written = make_tiles(*whole, tiles); !written) return written.error();
  return read(tiles);
}

Result<std::vector<cv::Size>> PanelLibrary::tile_levels(const std::string& map_file, MissingTiles missing) const {
  return read_tiles(map_file, missing, planner::read_pyramid_levels);
}

Result<std::string> PanelLibrary::load_tile(const std::string& map_file, int level, int column, int row,
                                            MissingTiles missing) const {
  return read_tiles(map_file, missing, [&](const std::filesystem::path& tiles) {
    return planner::read_pyramid_tile(tiles, level, column, row);
  });
}

Result<PanelLibrary::SmallPicture> PanelLibrary::make_smaller(const std::string& file, int width_px) const {
  const bool usual = std::ranges::count(kUsualWidths, width_px) > 0;
  const auto kept_file = small_file(file, std::to_string(width_px));
  if (const auto width = usual ? width_of(path_of(file)) : std::nullopt; width && width_px < *width)
    if (const auto kept = read_stored_picture(kept_file))
      return SmallPicture{*kept, static_cast<double>(width_px) / *width};
  const auto whole = load_picture(file);
  if (!whole) return whole.error();
  SmallPicture small{*whole, std::min(1.0, static_cast<double>(width_px) / whole->cols)};
  if (small.scale == 1) return small;
  small.pixels = narrowed(*whole, width_px, small.scale);
  if (usual) keep_small(planner::encode_png(small.pixels), kept_file);
  return small;
}

Result<PanelLibrary::SmallPicture> PanelLibrary::load_small(const std::string& file, int width_px) const {
  {
    const std::lock_guard lock(kept_mutex_);
    const auto known = std::find_if(kept_.begin(), kept_.end(),
                                    [&](const auto& k) { return k.file == file && k.width_px == width_px; });
    if (known != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, known);
      known->asked = std::chrono::steady_clock::now();
      return known->picture;
    }
  }
  auto small = make_smaller(file, width_px);
  if (!small || small->pixels.total() > kKeptPixels / 4) return small;
  const std::lock_guard lock(kept_mutex_);
  kept_.push_front({file, width_px, *small, std::chrono::steady_clock::now()});
  std::size_t pixels = 0;
  for (auto kept = kept_.begin(); kept != kept_.end();) {
    pixels += kept->picture.pixels.total();
    kept = pixels > kKeptPixels ? kept_.erase(kept) : std::next(kept);
  }
  return small;
}

bool PanelLibrary::forget_unasked(std::chrono::steady_clock::time_point since) const {
  const bool drawn_gone = drawn_.forget_unasked(since);
  std::list<KeptPicture> gone;  // freed when others may ask again
  const std::lock_guard lock(kept_mutex_);
  // The last one asked for stands first.
  const auto first = std::ranges::find_if(kept_, [&](const auto& one) { return one.asked < since; });
  gone.splice(gone.end(), kept_, first, kept_.end());
  return drawn_gone || !gone.empty();
}

Result<SquareMillimetres> PanelLibrary::usable_area(const db::PanelRecord& panel) const {
  if (panel.usable) return *panel.usable;
  {
    const std::lock_guard lock(areas_mutex_);
    if (const auto known = areas_.find(panel.mask_file); known != areas_.end()) return known->second;
  }
  auto mask = load_mask(panel);
  if (!mask) return mask.error();
  const std::lock_guard lock(areas_mutex_);
  return areas_[panel.mask_file] = wood_area(*mask);
}

std::optional<PanelLibrary::PaintedMask> PanelLibrary::painted_of(const std::string& made_of) const {
  const std::lock_guard lock(painted_mutex_);
  const auto it = std::ranges::find(painted_, made_of, &std::pair<std::string, PaintedMask>::first);
  std::error_code none;
  return it != painted_.end() && std::filesystem::exists(path_of(it->second.file), none) ? std::optional(it->second)
                                                                                         : std::nullopt;
}

void PanelLibrary::remember_painted(const std::string& made_of, const PaintedMask& mask) const {
  constexpr std::size_t kRemembered = 32;
  const std::lock_guard lock(painted_mutex_);
  std::erase_if(painted_, [&](const auto& one) { return one.first == made_of; });
  painted_.emplace_front(made_of, mask);
  if (painted_.size() > kRemembered) painted_.pop_back();
}

calib::PanelFiducials to_calib(const std::vector<db::FiducialRecord>& records) {
  calib::PanelFiducials out;
  for (const auto& record : records) {
    if (record.kind == db::FiducialKind::kHole && !record.corners.empty()) {
      out.holes.push_back({record.corners.front()});
    } else if (record.corners.size() == 4) {
      calib::PanelTag& tag = out.tags.emplace_back();
      tag.id = record.tag_id;
      tag.face = record.face;
      std::copy(record.corners.begin(), record.corners.end(), tag.corners.begin());
    }
  }
  std::sort(out.tags.begin(), out.tags.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return out;
}

std::vector<db::FiducialRecord> to_records(const calib::PanelFiducials& fiducials, Face face) {
  std::vector<db::FiducialRecord> out;
  for (const auto& tag : fiducials.tags)
    if (tag.face == face)
      out.push_back({db::FiducialKind::kTag, tag.id, face, {tag.corners.begin(), tag.corners.end()}});
  if (face == Face::kShow)
    for (std::size_t i = 0; i < fiducials.holes.size(); ++i)
      out.push_back({db::FiducialKind::kHole, static_cast<int>(i), face, {fiducials.holes[i].centre}});
  return out;
}

}  // namespace veneer::daemon
