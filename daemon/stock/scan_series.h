// The tiles of one face, from the first one that is scanned to the last; and what becomes of them when they are
// refused: of several that are, one can be scanned again, until anything else is.
//
// Threading: the scanner's worker, but for what says otherwise.
#pragma once

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "calib/registration.h"
#include "daemon/orders/scan_work.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {

struct ScanRequest {
  Face face = Face::kShow;
  std::optional<PanelId> panel;    // needed for the first look at a panel's back
  std::optional<PanelId> part_of;  // a sawn panel, where the tags do not say so
  bool retag = false;              // strange tags were newly glued to the panel, and become its own
  bool more = false;               // further tiles follow
  // This scan is one tile of the series that was refused, counted from 1, once more: face, panel, part_of and retag are
  // that series' own where they are not said.
  std::optional<int> again;
  bool anew = false;                  // gives up the tiles of a series that was begun or refused
  bool accept = false;                // takes it into stock when each of its warnings is overruled
  std::vector<std::string> overrule;  // names of warnings
  std::string who = "veneerd";
};

struct ScanTile {
  WorkFolder folder;  // holds the picture, kMadeScan
  std::string device, make;
  calib::TileView view;
  std::vector<ScanWarning> warnings;
  std::string sha256;  // of the picture
  std::optional<PanelLibrary::Stored> stored;
  std::string taken_at = utc_timestamp();
};

// kRefused: a scanner that reads files gives this one's picture again.
Error picture_of_series(const std::string& device);

class ScanSeries {
 public:
  // The library outlives this.
  explicit ScanSeries(const PanelLibrary& library) : library_(library) {}

  // A series that was refused and is kept, of hundreds of megabytes each tile. Thread-safe.
  struct Kept {
    std::size_t tiles = 0;
    std::string since;
    // For a day, and while there is room.
    bool is_over(const std::string& a_day_ago, bool has_room) const { return since < a_day_ago || !has_room; }
  };
  std::optional<Kept> kept() const;
  // A series that was begun with `more` and not ended: whoever comes by may go on with it, or give it up. Thread-safe.
  struct Open {
    std::optional<PanelId> panel;  // as its last tile was asked for
    Face face = Face::kShow;
    std::size_t tiles = 0;
    bool retag = false;  // as one of its tiles was scanned
  };
  std::optional<Open> open() const;

  const std::vector<ScanTile>& tiles() const { return tiles_; }
  // Is its picture that of a tile of this series?
  bool is_there(const ScanTile& tile) const;
  // The next tile, of the series that is open or of a new one. kRefused when it is there already.
  Status add(ScanTile tile, const ScanRequest& request);
  // It stays open for another one.
  void note_open(const ScanRequest& request);
  // What a request for one tile of the series that was refused, once more, means wholly. kNotFound, kInvalidArgument
  // when there is no such series or tile.
  Result<ScanRequest> as_refused(const ScanRequest& request) const;
  // REQUIRES: as_refused() took it.
  void replace(int number, ScanTile tile);
  // The series ends with what comes of all its tiles. One that is refused is kept where it is more than the tile that
  // was scanned just now, and nobody gave it up: the error says so.
  Result<ScanOutcome> end(const ScanRequest& request, const std::function<Result<ScanOutcome>()>& finish);
  // No tile is needed any more, whatever comes.
  void clear() { tiles_.clear(); }
  void give_up();       // all tiles, of whatever series
  void give_up_kept();  // those of one that was refused

  // Of a series that was refused late it is in the data folder already.
  std::filesystem::path picture_of(const ScanTile& tile) const;
  // All of them, in the data folder.
  Result<std::vector<TakenTile>> store(Face face);

 private:
  void note_kept();

  const PanelLibrary& library_;
  std::vector<ScanTile> tiles_;
  Face face_of_tiles_ = Face::kShow;
  std::optional<ScanRequest> refused_;  // how the series was asked for that `tiles_` are kept of
  mutable std::mutex kept_mutex_;
  std::optional<Kept> kept_;  // guarded by kept_mutex_
  std::optional<Open> open_;  // guarded by kept_mutex_
};

}  // namespace veneer::daemon
