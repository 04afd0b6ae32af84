// Panels of the twin, drawn from a seed, scanned by its scanner and masked as a first scan is: which of the screw holes
// that truly are there the mask takes for wood, and how much sound wood it does not take.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace veneer::workshop {

struct HoledPanelOrder {
  std::uint64_t seed = 1;
  int panel = 0;                 // each is another one
  std::string preset = "bench";  // how unkind the twin's workshop is
};

// A screw hole of which the mask takes a part.
struct TakenHole {
  std::string species;
  double x = 0, y = 0, diameter = 0;  // mm of the sheet
  double taken = 0;                   // share of it
};

struct HoledPanelVerdict {
  std::string refused;  // the sentence, when the scan did not enter
  int holes = 0;
  std::vector<TakenHole> taken;
  int strips = 0, asked = 0;
  double wood = 0, wood_taken = 0;  // mm2 of sound wood farther than the mask's margins from everything else
  double beside = 0;                // mm2 taken where no wood is glued
};
HoledPanelVerdict judge_holes(const HoledPanelOrder& order);

struct HoleFigures {
  int panels = 0, refused = 0, holes = 0;
  int whole = 0, in_part = 0;  // holes that lie wholly in the mask; of which it takes more than a fiftieth
  int strips = 0, asked = 0;
  double wood = 0, wood_taken = 0, beside = 0;

  void add(const HoledPanelVerdict& verdict);
  void add(const HoleFigures& other);
};
std::string hole_table_head();
std::string hole_table_line(const std::string& name, const HoleFigures& figures);
nlohmann::json to_json(const HoleFigures& figures);

// Of a hole that lies wholly in the mask, or in part.
constexpr double kWholeHole = 0.98, kPartOfHole = 0.02;

}  // namespace veneer::workshop
