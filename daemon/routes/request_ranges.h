// What numbers in requests may be; docs/openapi.json says the same, and a test holds the two together.
#pragma once

#include <cstddef>

#include "daemon/api/request_reader.h"

namespace veneer::daemon::ranges {

inline constexpr NumberRange kPower{0, 1};              // of the rated power
inline constexpr NumberRange kSpeed{0.01, 1000};        // mm/s, of the beam
inline constexpr NumberRange kJogSpeed{0.1, 10'000};    // mm/s, dark
inline constexpr NumberRange kKerf{0, 5};               // mm
inline constexpr NumberRange kPlace{-10'000, 10'000};   // mm, anywhere a machine may reach
inline constexpr NumberRange kPatternSide{10, 10'000};  // mm
inline constexpr NumberRange kFieldSide{1, 200};        // mm, of a test card's field
inline constexpr NumberRange kHeightAboveBed{0, 1000};  // mm
inline constexpr NumberRange kTile{1, 1000};            // of a series of scans
inline constexpr NumberRange kBoardSide{1, 10'000};     // mm
inline constexpr NumberRange kTurn{-360, 360};          // degrees
inline constexpr NumberRange kShownWidth{16, 8192};     // px, of a picture for people
inline constexpr NumberRange kTileLevel{0, 23};         // of a map in tiles
inline constexpr NumberRange kTilePlace{0, 10'000};     // column or row of one
inline constexpr NumberRange kWoodSide{16, 2048};       // px, of a picture of one piece
inline constexpr NumberRange kAlternative{1, 1000};
inline constexpr NumberRange kAlternatives{0, 1000};  // listed for each piece
inline constexpr NumberRange kFreeArea{0, 1e9};       // mm2
inline constexpr NumberRange kPatchSide{0.1, 1000};   // mm, of wood that is looked for
inline constexpr NumberRange kPasses{1, 20};
inline constexpr NumberRange kThickness{0.001, 100};  // mm, of veneer and substrate
inline constexpr NumberRange kTag{0, 586};            // numbers of the family 36h11
inline constexpr NumberRange kPrintedPanels{1, 20};   // whose tags are printed at once
inline constexpr NumberRange kZone{1, 1000};
inline constexpr NumberRange kLeaseDays{1, 90};
inline constexpr NumberRange kMaskVersion{1, 1'000'000};
inline constexpr std::ptrdiff_t kLongestReason = 500;  // characters
inline constexpr NumberRange kBrushWidth{0.5, 60};     // mm; stock/brush.h has the same
inline constexpr std::size_t kMostCorners = 1'500;     // of an outline that is painted on a mask, with any digits
inline constexpr NumberRange kPointsOfStroke{2, 500'000};
inline constexpr NumberRange kSwitch{0, 1};                                                             // off, on
inline constexpr NumberRange kFeedOverride{25, 200}, kRapidOverride{25, 100}, kPowerOverride{10, 100};  // per cent

}  // namespace veneer::daemon::ranges
