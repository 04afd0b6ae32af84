// Tags that are left out of a scan, told with where they lie. Internal to registration. Thread-safe.
#pragma once

#include <cstddef>
#include <vector>

#include "calib/registration.h"
#include "calib/sound_tiles.h"
#include "calib/tile_join.h"

namespace veneer::calib {

std::vector<SpoiledTag> place_spoiled(const std::vector<SoundTiles::Spoiled>& spoiled,
                                      const std::vector<TileView>& tiles, const std::vector<ScanMap>& maps, Face face);

// Those that the tiles do not show alike, as the tile shows them that was joined to the other.
void add_unlike(const Join& join, const std::vector<TileView>& tiles, const std::vector<ScanMap>& maps, Face face,
                std::vector<SpoiledTag>& out);

// kRefused when too few tags are left without those.
Status check_left(const Join& join, std::size_t min_tags);

}  // namespace veneer::calib
