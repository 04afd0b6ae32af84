#include "daemon/stock/scan_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace veneer::daemon {

Error picture_of_series(const std::string& device) {
  return {
      ErrorCode::kRefused,
      fmt::format("{} gives a picture again that is a tile of this series already: move the panel and scan it anew, "
                  "or begin the series anew with veneerctl panel scan --anew",
                  device)};
}

bool ScanSeries::is_there(const ScanTile& tile) const {
  return !tile.sha256.empty() && std::ranges::find(tiles_, tile.sha256, &ScanTile::sha256) != tiles_.end();
}

Status ScanSeries::add(ScanTile tile, const ScanRequest& request) {
  // Tiles of the other face that were never finished belong to nothing, nor do those of a series that was refused,
  // once another one is begun.
  give_up_kept();
  if (std::exchange(face_of_tiles_, request.face) != request.face) tiles_.clear(), note_kept();
  if (is_there(tile)) return picture_of_series(tile.device);
  tiles_.push_back(std::move(tile));
  return Ok();
}

void ScanSeries::replace(int number, ScanTile tile) { tiles_[static_cast<std::size_t>(number) - 1] = std::move(tile); }

Result<ScanRequest> ScanSeries::as_refused(const ScanRequest& request) const {
  if (!refused_)
    return Error{ErrorCode::kNotFound,
                 "no series of several tiles was refused: scan without --again, and the first tile with --more"};
  if (*request.again < 1 || static_cast<std::size_t>(*request.again) > tiles_.size())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no tile {}: name one from 1 to {}, in the order in which they were scanned",
                             *request.again, tiles_.size())};
  ScanRequest out = *refused_;
  if (request.panel) out.panel = request.panel;
  if (request.part_of) out.part_of = request.part_of;
  out.retag = out.retag || request.retag;
  out.accept = request.accept, out.overrule = request.overrule, out.who = request.who;
  return out;
}

// Whatever is thrown, the series is over.
Result<ScanOutcome> ScanSeries::end(const ScanRequest& request, const std::function<Result<ScanOutcome>()>& finish) {
  struct Forget {
    ScanSeries& series;
    bool keep = false;
    ~Forget() {
      if (!keep) series.tiles_.clear();
      series.note_kept();
    }
  } forget{*this};
  refused_.reset();
  note_kept();
  auto outcome = finish();
  if (outcome || outcome.error().code == ErrorCode::kStorage) return outcome;
  const auto is_kept = [this](const ScanTile& one) {
    std::error_code none;
    return std::filesystem::exists(picture_of(one), none);
  };
  if (tiles_.size() < 2 || !std::ranges::all_of(tiles_, is_kept)) return outcome;
  forget.keep = true;
  refused_ = request;
  const bool cancelled = outcome.error().code == ErrorCode::kCancelled;
  return Error{outcome.error().code,
               fmt::format("{}; the {} tiles are kept for a day: {}, the last one by veneerctl panel scan --again {}",
                           outcome.error().message, tiles_.size(),
                           cancelled ? "to have them looked at again, scan one of them anew"
                                     : "once that is seen to, scan the one that was bad anew",
                           tiles_.size())};
}

void ScanSeries::note_kept() {
  const std::lock_guard lock(kept_mutex_);
  kept_.reset(), open_.reset();
  if (refused_) kept_ = Kept{tiles_.size(), utc_timestamp()};
}

// Whoever scans the next tile is told the panel, and whether new tags are to become its own.
void ScanSeries::note_open(const ScanRequest& request) {
  const std::lock_guard lock(kept_mutex_);
  const auto panel = request.panel || !open_ ? request.panel : open_->panel;
  open_ = Open{panel, request.face, tiles_.size(), request.retag || (open_ && open_->retag)};
}

std::optional<ScanSeries::Open> ScanSeries::open() const {
  const std::lock_guard lock(kept_mutex_);
  return open_;
}

std::optional<ScanSeries::Kept> ScanSeries::kept() const {
  const std::lock_guard lock(kept_mutex_);
  return kept_;
}

void ScanSeries::give_up_kept() {
  if (refused_) give_up();
}

void ScanSeries::give_up() {
  tiles_.clear();
  refused_.reset();
  note_kept();
}

std::filesystem::path ScanSeries::picture_of(const ScanTile& tile) const {
  return tile.stored ? library_.path_of(tile.stored->file) : tile.folder.path() / kMadeScan;
}

Result<std::vector<TakenTile>> ScanSeries::store(Face face) {
  std::vector<TakenTile> out;
  for (ScanTile& tile : tiles_) {
    if (!tile.stored) {
      auto stored = library_.adopt(picture_of(tile), "scans", to_string(face), kMostPixelsScanned);
      if (!stored) return stored.error();
      tile.stored = *std::move(stored);
    }
    out.push_back({tile.stored->file, tile.stored->sha256, tile.device, tile.taken_at, tile.view.nominal.dpi()});
  }
  return out;
}

}  // namespace veneer::daemon
