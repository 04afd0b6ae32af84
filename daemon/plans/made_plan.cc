#include "daemon/plans/made_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "base/json_depth.h"
#include "daemon/orders/records_json.h"

namespace veneer::daemon {
namespace {

constexpr std::size_t kMostPieces = 200'000;

// Of what a worker process answers: could it be a piece at all? What is beyond all measure would keep the database's
// thread, or be no number for the polygons.
bool can_be(const db::PlannedPatch& piece) {
  constexpr std::size_t kLongestMark = 40, kMostPoints = 5'000;
  constexpr double kFarthest = 100'000;  // mm
  const auto near = [](const auto& p) {
    return std::abs(p.x.count()) <= kFarthest && std::abs(p.y.count()) <= kFarthest;
  };
  std::size_t points = piece.artwork_outline.size() + piece.panel_outline.size();
  bool good = std::all_of(piece.artwork_outline.begin(), piece.artwork_outline.end(), near) &&
              std::all_of(piece.panel_outline.begin(), piece.panel_outline.end(), near) &&
              near(piece.panel_from_artwork.shift()) && (!piece.lead_in || near(*piece.lead_in));
  for (const auto& ring : piece.allocation.rings()) {
    points += ring.size();
    good = good && std::all_of(ring.begin(), ring.end(), near);
  }
  return good && piece.mark.size() <= kLongestMark && points <= kMostPoints;
}

}  // namespace

Result<std::string> read_made_file(const std::filesystem::path& file, std::uintmax_t most) {
  std::error_code failed;
  if (std::filesystem::symlink_status(file, failed).type() != std::filesystem::file_type::regular ||
      std::filesystem::file_size(file, failed) > most)
    return Error{ErrorCode::kInternal, "the plan came back unreadable: plan again, and report it when it comes back"};
  auto out = read_whole(file);
  if (!out || out->empty())
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot read {}: make room on the disk, then plan again", file.string())};
  return *std::move(out);
}

Result<std::vector<db::PlannedPatch>> read_made_pieces(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMostBytes = 64 << 20;  // some ten times as much in memory, once it is parsed
  const auto text = read_made_file(file, kMostBytes);
  if (!text) return text.error();
  try {
    if (!nested_too_deeply(*text)) {
      auto pieces = nlohmann::json::parse(*text).get<std::vector<db::PlannedPatch>>();
      if (pieces.size() <= kMostPieces && std::all_of(pieces.begin(), pieces.end(), can_be)) return pieces;
    }
  } catch (const nlohmann::json::exception&) {
  }
  return Error{ErrorCode::kInternal, "the plan came back unreadable: plan again, and report it when it comes back"};
}

}  // namespace veneer::daemon
