// The map of a scan is kept in little room, and told as it was.
#include "daemon/orders/packed_lattice.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace veneer::daemon {
namespace {

TEST(PackedLattice, OfAScanTakesAFifthAtMostAndIsTheSame) {
  // An A4 scanner at 300 dpi whose map bends by some hundredths of a millimetre, and trembles by a micrometre.
  nlohmann::json lattice = {{"origin_px", {0, 0}}, {"step_px", 64}, {"cols", 61}, {"rows", 57}, {"panel_mm", {}}};
  for (int row = 0; row < 57; ++row)
    for (int column = 0; column < 61; ++column) {
      const double x = 218.2 - 5.42 * column + 0.03 * std::sin(column / 9.0) + 0.001 * std::sin(7.0 * row + column);
      const double y = -42.8 + 5.41 * row + 0.177 * column + 0.001 * std::cos(5.0 * column - row);
      lattice["panel_mm"].push_back({std::round(x * 1e5) / 1e5, std::round(y * 1e5) / 1e5});
    }
  const std::string text = lattice.dump();
  const std::string packed = packed_lattice(text);
  EXPECT_LT(5 * packed.size(), text.size());
  EXPECT_EQ(unpacked_lattice(packed), text);
  EXPECT_EQ(packed_lattice(packed), packed);
  EXPECT_EQ(unpacked_lattice(text), text) << "as older databases have it";
}

RC_GTEST_PROP(PackedLattice, IsTheSameWhateverItsSamples, ()) {
  const int columns = *rc::gen::inRange(1, 8), rows = *rc::gen::inRange(1, 8);
  nlohmann::json lattice = {
      {"origin_px", {0, 0}}, {"step_px", *rc::gen::inRange(1, 5000)}, {"cols", columns}, {"rows", rows}};
  lattice["panel_mm"] = nlohmann::json::array();
  for (int i = 0; i < columns * rows; ++i)
    lattice["panel_mm"].push_back(
        {*rc::gen::inRange(-100'000'000, 100'000'001) / 1e5, *rc::gen::inRange(-50, 50) / 1e5});
  const std::string text = lattice.dump();
  RC_ASSERT(packed_lattice(text).starts_with('#'));
  RC_ASSERT(unpacked_lattice(packed_lattice(text)) == text);
}

TEST(PackedLattice, TellsHowItsFiducialsFit) {
  nlohmann::json lattice = {
      {"origin_px", {0, 0}}, {"step_px", 64}, {"cols", 1}, {"rows", 1}, {"panel_mm", {{1.0, 2.0}}}};
  const std::string first = packed_lattice(lattice.dump());
  EXPECT_TRUE(kept_offsets(first).empty()) << "nobody knows of a first scan";
  const std::vector<calib::FiducialOffset> offsets = {{212, point<PanelFrame>(12.34567, 140), Millimetres(0.30001)},
                                                      {-1, point<PanelFrame>(-3.5, 0), Millimetres(0)}};
  lattice[kLatticeFiducials] = lattice_fiducials(offsets);
  const std::string text = lattice.dump(), packed = packed_lattice(text);
  EXPECT_TRUE(packed.starts_with(first + ";")) << packed;
  EXPECT_EQ(unpacked_lattice(packed), text);
  for (const std::string& kept : {packed, text}) {
    const auto known = kept_offsets(kept);
    ASSERT_EQ(known.size(), 2U);
    for (const std::size_t i : {0U, 1U}) {
      EXPECT_EQ(known[i].tag, offsets[i].tag);
      EXPECT_EQ(known[i].place, offsets[i].place);
      EXPECT_NEAR(known[i].off.count(), offsets[i].off.count(), 1e-9);
    }
  }
  for (const char* odd :
       {R"([{"tag":1}])", R"([{"tag":-1,"place_mm":[1,2],"off_mm":0.1}])", R"([7])", R"({"tag":1})"}) {
    lattice[kLatticeFiducials] = nlohmann::json::parse(odd);
    EXPECT_EQ(packed_lattice(lattice.dump()), lattice.dump());
    EXPECT_TRUE(kept_offsets(lattice.dump()).empty()) << odd;
  }
  // What is damaged costs no more than itself: the samples before it are good.
  for (const char* damaged : {"#64,1,1;??;", "#64,1,1;??;???", "#64,1,1;??;????x", "#64,1,1;??;????@"}) {
    EXPECT_EQ(unpacked_lattice(damaged), unpacked_lattice("#64,1,1;??")) << damaged;
    EXPECT_TRUE(kept_offsets(damaged).empty()) << damaged;
  }
  // How the fiducials fit is told whatever the samples say.
  EXPECT_EQ(kept_offsets("#64,1,1;x;????").size(), 1U);
}

TEST(PackedLattice, WhatIsNoSuchLatticeStaysAsItIs) {
  for (const char* other : {"", "{}", "[1]", "x", R"({"panel_mm":[[1,2]]})",
                            R"({"cols":1,"origin_px":[0,0],"panel_mm":[[1.000001,2.0]],"rows":1,"step_px":64})",
                            R"({"cols":1,"origin_px":[5,0],"panel_mm":[[1.0,2.0]],"rows":1,"step_px":64})",
                            R"({"cols":2,"origin_px":[0,0],"panel_mm":[[1.0,2.0]],"rows":1,"step_px":64})",
                            R"({"cols":1,"more":1,"origin_px":[0,0],"panel_mm":[[1.0,2.0]],"rows":1,"step_px":64})"})
    EXPECT_EQ(packed_lattice(other), other);
  for (const char* damaged : {"#", "#64,1,1;", "#64,1,1;??x ", "#64,1,1;???", "#64,9999999,9999999;??", "#0,1,1;??"})
    EXPECT_EQ(unpacked_lattice(damaged), damaged);
}

}  // namespace
}  // namespace veneer::daemon
