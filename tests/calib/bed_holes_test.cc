// A panel lies on the bed with its tags covered; its holes must tell which one it is, and nothing else may.
#include "calib/bed_holes.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

constexpr double kThickness = 2.1, kHole = 6, kPanelWidth = 200, kPanelHeight = 140;
using Places = std::vector<std::array<double, 2>>;
const Places kHoles = {{22, 10}, {151, 11.5}, {84, 129}, {188, 77}};

PanelCandidate panel(const std::string& id, const Places& holes) {
  PanelCandidate out{PanelId{id}, {}};
  for (const auto& [x, y] : holes) out.fiducials.holes.push_back({point<PanelFrame>(x, y), Millimetres(kHole)});
  return out;
}

// Its surface darkens towards one side, as wood under a lamp does.
test::SceneSheet board(const test::Lay& lay, const Places& holes) {
  return {lay, kThickness, [holes](double x, double y) {
            if (x < 0 || y < 0 || x > kPanelWidth || y > kPanelHeight) return test::kNothingHere;
            for (const auto& [hx, hy] : holes)
              if (std::hypot(x - hx, y - hy) < kHole / 2) return test::kNothingHere;
            return static_cast<float>(130 + 0.25 * x);
          }};
}

// Of 2.3 pixels a millimetre.
test::TrueCamera small_camera() {
  test::TrueCamera camera;
  camera.width = 1400, camera.height = 1050;
  camera.focal = 1092, camera.cx = 707.9, camera.cy = 519.9;
  return camera;
}

std::vector<Point<BedFrame>> holes_in(const std::vector<test::SceneSheet>& scene) {
  return find_bed_holes(test::photograph(small_camera(), scene), exact_model(small_camera()), Millimetres(kThickness),
                        Millimetres(kHole));
}

// Show face up, and turned over, in two directions.
TEST(BedHoles, TellThePanelAndItsPlaceWithoutATag) {
  const std::vector<PanelCandidate> stock = {panel("P-0007", {{20, 9}, {120, 12}, {60, 88}, {141, 50}}),
                                             panel("P-0001", kHoles)};
  for (const test::Lay& lay :
       {test::Lay{120, 60, 4, false}, test::Lay{330, 50, 3, true}, test::Lay{300, 90, 95, false}}) {
    const auto found = locate_by_holes(holes_in({board(lay, kHoles)}), stock);
    ASSERT_EQ(found.size(), 1U) << lay.turn_deg;
    const HolePose& pose = found.front();
    EXPECT_EQ(pose.panel, PanelId{"P-0001"});
    EXPECT_EQ(pose.face_up, lay.mirrored ? Face::kBack : Face::kShow);
    EXPECT_EQ(pose.seen, 4U);
    EXPECT_LT(pose.by_chance, 1e-7);
    EXPECT_LT(pose.rms.count(), 0.2);
    for (const auto& corner : Places{{0, 0}, {kPanelWidth, 0}, {kPanelWidth, kPanelHeight}, {0, kPanelHeight}}) {
      const auto there = lay.bed_of(corner[0], corner[1]);
      EXPECT_LT(
          distance(pose.bed_from_panel * point<PanelFrame>(corner[0], corner[1]), point<BedFrame>(there[0], there[1]))
              .count(),
          0.4);
    }
  }
}

// A shelf of panels of which no two are as thick is searched for in a few pictures, not in one for each.
TEST(BedHoles, OfManyThicknessesAreFoundByOneSearch) {
  const CameraModel model = exact_model(small_camera());
  std::vector<Millimetres> heights;
  for (int i = 0; i < 200; ++i) heights.push_back(Millimetres(0.5 + 0.1 * i));
  const auto groups = searched_at_once(model, heights);
  EXPECT_LE(groups.size(), 3U);
  std::vector<Millimetres> all;
  for (const auto& group : groups) all.insert(all.end(), group.begin(), group.end());
  EXPECT_EQ(all, heights);

  const cv::Mat picture = test::photograph(small_camera(), {board({120, 60, 4, false}, kHoles)});
  const std::vector<Millimetres>& first = groups.front();
  for (const Millimetres searched : {first.front(), first.back()}) {
    const auto found =
        raised(find_bed_holes(picture, model, searched, Millimetres(kHole)), model, searched, Millimetres(kThickness));
    ASSERT_EQ(found.size(), kHoles.size()) << searched.count();
    const auto lay = locate_by_holes(found, {{panel("P-0001", kHoles)}});
    ASSERT_EQ(lay.size(), 1U);
    EXPECT_LT(lay.front().rms.count(), 0.2);
  }
}

// Three agree, but so might three of a stranger's.
TEST(BedHoles, AreLessSureWhereOneIsCovered) {
  const Places three(kHoles.begin(), kHoles.end() - 1);
  const auto found = locate_by_holes(holes_in({board({120, 60, 4, false}, three)}), {{panel("P-0001", kHoles)}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().seen, 3U);
  EXPECT_EQ(found.front().known, 4U);
  EXPECT_GT(found.front().by_chance, 1e-5);
}

// Nor in a honeycomb, whose cells are as wide.
TEST(BedHoles, AreNotSeenInScrapWithHolesOfItsOwn) {
  const Places strange = {{30, 30}, {150, 40}, {70, 110}, {160, 100}, {90, 60}};
  const auto holes = holes_in({board({150, 80, 10, false}, strange)});
  EXPECT_EQ(holes.size(), strange.size());
  EXPECT_TRUE(locate_by_holes(holes, {{panel("P-0001", kHoles)}}).empty());
}

// What is stated of chance is so: strangers strewn over the bed agree no more often.
TEST(BedHoles, SayHowOftenStrangersAgree) {
  std::mt19937_64 random(20261125);
  std::uniform_real_distribution<double> x(0, 480), y(0, 300);
  const std::vector<PanelCandidate> stock = {panel("P-0001", kHoles)};
  constexpr int kBeds = 200;
  constexpr std::size_t kStrangers = 60;
  int agreed = 0;
  double expected = 0;
  for (int bed = 0; bed < kBeds; ++bed) {
    std::vector<Point<BedFrame>> seen;
    for (std::size_t i = 0; i < kStrangers; ++i) {
      const double across = x(random), up = y(random);
      seen.push_back(point<BedFrame>(across, up));
    }
    for (const HolePose& pose : locate_by_holes(seen, stock)) {
      ++agreed;
      EXPECT_GT(pose.by_chance, 0.001) << "never so surely";
      expected = pose.by_chance;
    }
  }
  EXPECT_GT(agreed, 0);
  EXPECT_LT(agreed, 2 * kBeds * expected);
}

}  // namespace
}  // namespace veneer::calib
