// Panels as files and records: raw scans, veneer maps and masks in the data folder, and the way between the database's
// records and what calib and the planner speak of.
//
// Files are named by their content hash, written whole (base/files.h) and never changed. Any thread
// but the reactor: these functions read and write megabytes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/raster.h"
#include "base/result.h"
#include "calib/fiducials.h"
#include "calib/registration.h"
#include "daemon/orders/stored_picture.h"
#include "daemon/stock/drawn_pictures.h"
#include "daemon/store/database_thread.h"
#include "planner/stock.h"

namespace veneer::daemon {

// Maps, masks and previews are decoded by this process for people's eyes and for figures. A panel of
// 1500 x 1000 mm at the map's 300 dpi has 209 million pixels, which are 0.6 GB in colour; a preview has 75 dpi, and so
// room for 16 times that.
inline constexpr std::int64_t kMostPixelsShown = 212'000'000;
// Raw scans are decoded by workers only: what they can read (planner/pictures/picture_limits.h).
inline constexpr std::int64_t kMostPixelsScanned = 300'000'000;

class PanelLibrary {
 public:
  static constexpr std::uintmax_t kMostTileBytes = 4ULL << 30;  // of some hundred large maps
  explicit PanelLibrary(std::filesystem::path data_dir, std::uintmax_t most_tile_bytes = kMostTileBytes)
      : data_dir_(std::move(data_dir)), most_tile_bytes_(most_tile_bytes) {}

  struct Stored {
    std::string file;  // relative to the data folder
    std::string sha256;
  };
  // Lossless, below `folder` ("scans", "panels/P-0001").
  Result<Stored> store_picture(const cv::Mat& picture, const std::string& folder, const std::string& prefix) const;
  // A picture that a worker process has made: it becomes one of the library's, as if it were stored here. kRefused when
  // it has more than `most_pixels`.
  Result<Stored> adopt(const std::filesystem::path& made, const std::string& folder, const std::string& prefix,
                       std::int64_t most_pixels = kMostPixelsShown) const;
  Result<Stored> store_bytes(std::string_view bytes, const std::string& folder, const std::string& name) const;
  Result<cv::Mat> load_picture(const std::string& file) const;  // as stored: BGR or grey
  std::filesystem::path path_of(const std::string& file) const { return data_dir_ / file; }
  Result<std::string> load_bytes(const std::string& file) const;
  // The same at most `width_px` wide, for people's eyes; its sides were multiplied with `scale` (1 at most). The last
  // few are kept in memory, because pages ask for them again and again and a map has a hundred million pixels (draw on
  // a copy), and those of usual widths on the disk, so that nothing is decoded whole after a start.
  struct SmallPicture {
    cv::Mat pixels;
    double scale = 1;
  };
  Result<SmallPicture> load_small(const std::string& file, int width_px) const;
  // Gives up what is kept in memory of them, and of what was drawn of them, that nobody has asked for since then, and
  // says whether there was any.
  bool forget_unasked(std::chrono::steady_clock::time_point since) const;
  // What was drawn of these.
  const DrawnPictures& drawn() const { return drawn_; }
  // A map in tiles, whole and at every half (planner/pictures/tile_pyramid.h), for whoever looks closely: of the
  // hundred million pixels only those are read that are looked at. The levels' sizes, and one tile, a JPEG file.
  // Where they are not there, or cannot be read, they are made, one map's after the other, which takes seconds; those
  // of maps that nobody has looked at for the longest time give way to them, and are made again for who looks just
  // then. kNotFound: the map has no such tile; kRefused: they are not there and are not to be made; kStorage: also
  // while the disk has little room.
  enum class MissingTiles { kMake, kRefuse };
  Result<std::vector<cv::Size>> tile_levels(const std::string& map_file,
                                            MissingTiles missing = MissingTiles::kMake) const;
  Result<std::string> load_tile(const std::string& map_file, int level, int column, int row,
                                MissingTiles missing = MissingTiles::kMake) const;
  const std::filesystem::path& data_dir() const { return data_dir_; }
  // Where the planner keeps what it measured of panels (planner/matching/index_cache.h).
  std::filesystem::path index_dir() const { return data_dir_ / "index"; }
  std::filesystem::path edges_dir() const { return index_dir() / "edges"; }  // daemon/orders/kept_edges.h
  // Where small pictures are kept; may be removed at any time.
  std::filesystem::path small_dir() const { return data_dir_ / "small"; }
  // Makes those of a map and a mask that were just entered, and the map's tiles. What cannot be written is made when
  // somebody asks for it.
  void make_small(const std::string& map_file, const std::string& mask_file) const;
  // Removes a file that nothing names any more, if it is there, and what was made of it. What cannot be removed does no
  // harm.
  void remove(const std::string& file) const;
  // Removes what is kept in both for a panel whose map was replaced or whose wood is used up: it will never be read
  // again, and may be gigabytes. What cannot be removed does no harm.
  void drop_index(const PanelId& panel) const;
  // The same for one whose mask alone was replaced: what was made of its map stays.
  void drop_mask(const PanelId& panel, const std::string& mask_file) const;
  // As drop_index(), for all panels but these.
  void keep_index_only(const std::vector<PanelId>& panels) const;

  Result<Raster<PanelFrame>> load_map(const db::PanelRecord& panel) const;
  // 0 or 255. From a copy in one bit a pixel where there is one, since a search looks at the masks of all panels.
  Result<Raster<PanelFrame>> load_mask(const db::PanelRecord& panel) const;
  // Of the mask, as it was counted when it was made. Masks older than schema 8 have no count in the database: theirs is
  // taken once for each file.
  Result<SquareMillimetres> usable_area(const db::PanelRecord& panel) const;

  // A mask that was painted, by what it was made of (mask_painter.h). The last few are remembered, so that the next
  // stroke is drawn over the mask that has all others, and one that is taken back at once needs no drawing.
  struct PaintedMask {
    std::string file;  // in the data folder
    SquareMillimetres usable{0};
  };
  std::optional<PaintedMask> painted_of(const std::string& made_of) const;
  void remember_painted(const std::string& made_of, const PaintedMask& mask) const;

 private:
  std::filesystem::path small_file(const std::string& file, const std::string& what) const;
  void drop_small(const std::string& beginning) const;
  void keep_small(const std::optional<std::string>& png, const std::filesystem::path& file) const;
  Result<SmallPicture> make_smaller(const std::string& file, int width_px) const;
  bool has_small(const std::string& file, const std::filesystem::path& own) const;
  bool has_room_for_tiles() const;
  std::filesystem::path tiles_file(const std::string& map_file) const;
  // What `read` makes of the map's tiles, which are made before where it can read none.
  template <class Read>
  std::invoke_result_t<Read, const std::filesystem::path&> read_tiles(const std::string& map_file, MissingTiles missing,
                                                                      Read read) const;
  Status make_tiles(const cv::Mat& map, const std::filesystem::path& tiles) const;  // tiles_mutex_ is held

  std::filesystem::path data_dir_;
  std::uintmax_t most_tile_bytes_;
  mutable std::mutex writing_mutex_;  // of small files: two that ask for one make it one after the other
  mutable std::mutex tiles_mutex_;    // of tiles, which take seconds to make: the same
  mutable std::mutex areas_mutex_;
  mutable std::map<std::string, SquareMillimetres> areas_;  // by mask file; guarded by areas_mutex_
  mutable std::mutex painted_mutex_;
  mutable std::list<std::pair<std::string, PaintedMask>> painted_;  // the last one first; guarded by painted_mutex_
  struct KeptPicture {
    std::string file;
    int width_px = 0;
    SmallPicture picture;
    std::chrono::steady_clock::time_point asked;
  };
  DrawnPictures drawn_;
  mutable std::mutex kept_mutex_;
  mutable std::list<KeptPicture> kept_;  // the last one asked for first; guarded by kept_mutex_
};

calib::PanelFiducials to_calib(const std::vector<db::FiducialRecord>& records);
// Those of one face; holes count to the show face.
std::vector<db::FiducialRecord> to_records(const calib::PanelFiducials& fiducials, Face face);

}  // namespace veneer::daemon
