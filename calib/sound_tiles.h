// What every scan must satisfy before anything is fitted to its tags. Internal to registration. Thread-safe.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "calib/registration.h"

namespace veneer::calib {

struct SoundTiles {
  struct Spoiled {
    std::size_t tile;
    Tag<ScanFrame> tag;
    Millimetres side;  // as it measures
  };
  std::vector<TileView> tiles;
  std::vector<Spoiled> spoiled;  // and left out of them
};
// kNotFound: a tile without tags. kRefused: a foreign tag, one that is seen twice, too few that are sound; or half of
// all tags, or all of one tile, measure otherwise than they were printed.
Result<SoundTiles> check_tags(std::span<const TileView> tiles, const ScannerModel& scanner,
                              const RegistrationOptions& options);

// Ascending.
std::vector<int> seen_ids(std::span<const TileView> tiles);

}  // namespace veneer::calib
