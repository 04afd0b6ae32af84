#include "calib/sound_tiles.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <utility>

#include "calib/refused.h"
#include "calib/tile_join.h"

namespace veneer::calib {
namespace {

// Without the tags that measure otherwise than they were printed, which are added to `spoiled`.
TileView sound_tile(const TileView& tile, std::size_t number, const ScannerModel& scanner,
                    const RegistrationOptions& options, std::vector<SoundTiles::Spoiled>& spoiled) {
  const auto corners = corners_on_glass(tile, scanner);
  TileView out = tile;
  out.tags.clear();
  for (const auto& tag : tile.tags) {
    Millimetres side{0};
    for (int i = 0; i < 4; ++i) side += distance(corners.at(tag.id * 4 + i), corners.at(tag.id * 4 + (i + 1) % 4)) / 4;
    if (std::abs(side / options.tag_size - 1) <= options.tag_size_tolerance)
      out.tags.push_back(tag);
    else
      spoiled.push_back({number, tag, side});
  }
  return out;
}

// Where half of the tags are off, or all on one tile, it is the scan.
Status check_sizes(std::span<const TileView> tiles, const SoundTiles& sound, Millimetres printed) {
  std::size_t tags = 0;
  bool none_left = false;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    tags += tiles[i].tags.size(), none_left = none_left || sound.tiles[i].tags.empty();
  if (!none_left && 2 * sound.spoiled.size() < tags) return Ok();
  const auto& [tile, tag, side] = sound.spoiled[0];
  return refused(
      fmt::format("tag {} on {} measures {:.2f} mm instead of {:.2f}: check the scan's resolution and the printed tags",
                  tag.id, tiles[tile].name, side.count(), printed.count()));
}

}  // namespace

std::vector<int> seen_ids(std::span<const TileView> tiles) {
  std::set<int> ids;
  for (const TileView& tile : tiles)
    for (const auto& tag : tile.tags) ids.insert(tag.id);
  return {ids.begin(), ids.end()};
}

Result<SoundTiles> check_tags(std::span<const TileView> tiles, const ScannerModel& scanner,
                              const RegistrationOptions& options) {
  SoundTiles out;
  if (tiles.empty()) return Error{ErrorCode::kInvalidArgument, "no scan was given to register"};
  for (const TileView& tile : tiles) {
    if (tile.tags.empty())
      return Error{ErrorCode::kNotFound, fmt::format("no fiducials found on {}: lay the panel with its tags on the "
                                                     "glass and scan again",
                                                     tile.name)};
    for (std::size_t i = 0; i < tile.tags.size(); ++i) {
      const int id = tile.tags[i].id;
      if (options.foreign_tags.contains(id))
        return refused(fmt::format("tag {} on {} belongs to another sheet: lay only the wanted panel on the glass", id,
                                   tile.name));
      if (i > 0 && tile.tags[i - 1].id == id)
        return refused(fmt::format("tag {} is seen twice on {}: remove the copy", id, tile.name));
    }
    out.tiles.push_back(sound_tile(tile, out.tiles.size(), scanner, options, out.spoiled));
  }
  if (const Status sizes = check_sizes(tiles, out, options.tag_size); !sizes) return sizes.error();
  const std::size_t found = seen_ids(out.tiles).size();
  if (found < options.min_tags && !out.spoiled.empty())
    return refused(
        fmt::format("tag {} on {} measures {:.2f} mm instead of {:.2f}, and without it {} of at least {} tags "
                    "are left: wipe it clean, or replace it, and scan again",
                    out.spoiled[0].tag.id, tiles[out.spoiled[0].tile].name, out.spoiled[0].side.count(),
                    options.tag_size.count(), found, options.min_tags));
  if (found < options.min_tags)
    return refused(fmt::format("{} shows {} of at least {} tags: lay the panel fully on the glass and scan again",
                               tiles[0].name, found, options.min_tags));
  return out;
}

}  // namespace veneer::calib
