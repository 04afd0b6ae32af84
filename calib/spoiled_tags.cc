#include "calib/spoiled_tags.h"

#include <fmt/format.h>

#include <array>
#include <set>

namespace veneer::calib {
namespace {

std::array<Point<PanelFrame>, 4> placed(const Tag<ScanFrame>& seen, const ScanMap& map) {
  std::array<Point<PanelFrame>, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = map * seen.corners[k];
  return corners;
}

}  // namespace

std::vector<SpoiledTag> place_spoiled(const std::vector<SoundTiles::Spoiled>& spoiled,
                                      const std::vector<TileView>& tiles, const std::vector<ScanMap>& maps, Face face) {
  std::vector<SpoiledTag> out;
  out.reserve(spoiled.size());
  for (const auto& [tile, seen, side] : spoiled)
    out.push_back({{seen.id, face, placed(seen, maps[tile])}, side, tiles[tile].name, {}});
  return out;
}

void add_unlike(const Join& join, const std::vector<TileView>& tiles, const std::vector<ScanMap>& maps, Face face,
                std::vector<SpoiledTag>& out) {
  for (const Join::UnlikeTag& unlike : join.unlike)
    for (const auto& seen : tiles[unlike.tile].tags) {
      if (seen.id != unlike.tag) continue;
      const auto corners = placed(seen, maps[unlike.tile]);
      Millimetres side{0};
      for (std::size_t k = 0; k < 4; ++k) side += distance(corners[k], corners[(k + 1) % 4]) / 4;
      out.push_back({{seen.id, face, corners}, side, tiles[unlike.tile].name, unlike.off});
    }
}

Status check_left(const Join& join, std::size_t min_tags) {
  std::set<int> left;
  for (const auto& [key, corner] : join.corners) left.insert(key / 4);
  if (join.unlike.empty() || left.size() >= min_tags) return Ok();
  return Error{ErrorCode::kRefused,
               fmt::format("tag {} is not seen alike on the tiles, by {:.2f} mm, and without it {} of at least {} tags "
                           "are left: wipe it clean, or replace it, and scan again",
                           join.unlike[0].tag, join.unlike[0].off.count(), left.size(), min_tags)};
}

}  // namespace veneer::calib
