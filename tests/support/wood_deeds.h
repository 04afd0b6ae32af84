// What reconciliation makes of panels whose fate is known: sheets of every board and wood, something done on each
// strip, scanned again in another light, and the differences that are told held against those that are there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/polygon_ops.h"
#include "tests/support/workshop_panel.h"

namespace veneer::workshop {

// What became of a piece of wood, by the sheet and by the ledger.
enum class Fate : std::uint8_t {
  kCutAsBooked,
  kBookedUntouched,  // booked for cut, and nothing was done
  kBookedHanging,    // booked for cut, cut all around, and it hangs in its place
  kGoneUnbooked,     // cut out, and nobody booked it
  kNarrowUnbooked,   // the same, 0.7 to 1.2 mm wide
  kTornUnbooked,     // its veneer came off the board
  kLeftAlone,        // neither
};
constexpr int kFates = 7;
const char* name_of(Fate fate);

struct PieceVerdict {
  Fate fate = Fate::kCutAsBooked;
  std::string wood;
  Point<PanelFrame> place{};
  double area = 0;        // mm2
  bool found = true;      // what should be told is told, but for less than 3 mm2 or what is narrower than 0.5 mm
  double share_gone = 0;  // of its inside, as a suspect's
};

// Were it a suspect, a person would be told nothing clear about it, or what is wrong.
bool is_doubted(const PieceVerdict& piece);

struct FateVerdict {
  std::string board, refused;
  Lid lid = Lid::kWhite;
  std::vector<PieceVerdict> pieces;
  std::vector<std::string> false_ones;  // differences that are told and are not there
  double seconds = 0;                   // of the comparison alone
  cv::Mat before, now;                  // maps, for people to look at
};

// The i-th case of a campaign: boards, woods, lids and resolutions come round, and each piece's fate is drawn.
FateVerdict judge_fates(std::uint64_t seed, int i, const std::filesystem::path& woods);

struct FateFigures {
  int cases = 0, refused = 0, false_ones = 0;
  int pieces[kFates] = {}, missed[kFates] = {};
  int doubted[kFates] = {};  // is_doubted
  double seconds = 0;

  void add(const FateVerdict& verdict);
  int all_missed() const;
};
std::string to_table(const FateFigures& figures);
nlohmann::json to_json(const FateFigures& figures);

}  // namespace veneer::workshop
