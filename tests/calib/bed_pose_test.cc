// A panel lies on the bed where nobody told; the tags on its upper face must tell panel, face and place.
#include "calib/bed_pose.h"

#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "tests/support/exact_camera.h"
#include "tests/support/rendered_bed.h"

namespace veneer::calib {
namespace {

constexpr double kWidth = 420, kHeight = 280, kTag = 14;

// Lower left corner, turn in degrees, all as seen from the face the tag is on.
struct GluedTag {
  int id;
  test::Lay lay;
};

const std::vector<GluedTag> kShowTags = {{210, {6.3, 5.1, 1.1, false}},
                                         {211, {398.9, 6.8, -0.7, false}},
                                         {212, {399.2, 258.4, 1.9, false}},
                                         {213, {120.4, 260.2, 0.3, false}},
                                         {214, {5.8, 171.9, -1.4, false}}};
const std::vector<GluedTag> kBackTags = {{215, {7.1, 6.0, 0.8, false}},
                                         {216, {399.5, 5.2, -1.8, false}},
                                         {217, {250.3, 259.6, 0.2, false}},
                                         {218, {6.6, 258.8, 1.2, false}},
                                         {219, {399.7, 140.5, -0.4, false}}};

PanelFiducials fiducials_of(const std::vector<GluedTag>& show, const std::vector<GluedTag>& back) {
  PanelFiducials out;
  const auto add = [&](const GluedTag& glued, Face face) {
    PanelTag tag{glued.id, face, {}};
    const std::array<std::array<double, 2>, 4> own = {{{0, 0}, {kTag, 0}, {kTag, kTag}, {0, kTag}}};
    for (std::size_t i = 0; i < 4; ++i) {
      auto p = glued.lay.bed_of(own[i][0], own[i][1]);
      if (face == Face::kBack) p[0] = kWidth - p[0];  // the back is described from behind, PanelFrame from the front
      tag.corners[i] = point<PanelFrame>(p[0], p[1]);
    }
    out.tags.push_back(tag);
  };
  for (const auto& glued : show) add(glued, Face::kShow);
  for (const auto& glued : back) add(glued, Face::kBack);
  return out;
}

PanelCandidate large_panel() { return {{"P-0001"}, fiducials_of(kShowTags, kBackTags)}; }

// Same places, other ids.
PanelCandidate other_panel() {
  auto show = kShowTags, back = kBackTags;
  for (auto& tag : show) tag.id += 20;
  for (auto& tag : back) tag.id += 20;
  return {{"P-0002"}, fiducials_of(show, back)};
}

float panel_shade(const std::vector<GluedTag>& tags, double x, double y) {
  if (x < 0 || y < 0 || x > kWidth || y > kHeight) return test::kNothingHere;
  for (const auto& tag : tags) {
    const auto own = tag.lay.sheet_of(x, y);
    if (own[0] < -2 || own[1] < -2 || own[0] > 16 || own[1] > 16) continue;
    const float grey = test::tag_shade(tag.id, own[0] / kTag, own[1] / kTag);
    if (grey >= 0) return grey;
  }
  const bool inside = x > 24 && y > 24 && x < kWidth - 24 && y < kHeight - 24;
  return inside ? static_cast<float>(110 + 30 * std::sin(x * 0.8 + std::sin(y * 0.05))) : 128.0F;
}

test::SceneSheet lying(const std::vector<GluedTag>& tags, const test::Lay& lay, double height = 2.1) {
  return {lay, height, [&tags](double x, double y) { return panel_shade(tags, x, y); }};
}

// Worst error of bed_from_panel over the panel, mm. `back_up`: the lay describes the panel as seen from its back.
double worst_error(const BedPose& pose, const test::Lay& lay, bool back_up) {
  double worst = 0;
  for (double y = 0; y <= kHeight; y += 20) {
    for (double x = 0; x <= kWidth; x += 20) {
      const auto real = lay.bed_of(back_up ? kWidth - x : x, y);
      const auto said = pose.bed_from_panel * point<PanelFrame>(x, y);
      worst = std::max(worst, distance(said, point<BedFrame>(real[0], real[1])).count());
    }
  }
  return worst;
}

// How much higher than flat a place of the panel's upper face lies, mm; u, v: 0 to 1 along its sides.
using Lift = std::function<double(double u, double v)>;

// Tags as the detector would report them, without a picture.
std::vector<Tag<CameraFrame>> seen_tags(const test::TrueCamera& camera, const std::vector<GluedTag>& tags,
                                        const test::Lay& lay, double height = 2.1, const Lift& lift = {},
                                        std::uint64_t seed = 5) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 0.06);
  std::vector<Tag<CameraFrame>> out;
  for (const auto& glued : tags) {
    Tag<CameraFrame> tag;
    tag.id = glued.id, tag.decision_margin = 60;
    const std::array<std::array<double, 2>, 4> own = {{{0, 0}, {kTag, 0}, {kTag, kTag}, {0, kTag}}};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto sheet = glued.lay.bed_of(own[i][0], own[i][1]);
      const auto bed = lay.bed_of(sheet[0], sheet[1]);
      const double lifted = lift ? lift(sheet[0] / kWidth, sheet[1] / kHeight) : 0;
      const auto px = camera.pixel_of(bed[0], bed[1], height + lifted);
      const double right = noise(random), down = noise(random);
      tag.corners[i] = point<CameraFrame>(px[0] + right, px[1] + down);
    }
    out.push_back(tag);
  }
  return out;
}

const test::Lay kLay{52, 41, 3.2, false};

TEST(BedPose, FindsAFaceDownPanelOnARenderedPicture) {
  const test::TrueCamera camera;
  const cv::Mat picture = test::photograph(camera, {lying(kBackTags, kLay)});
  const std::vector<PanelCandidate> candidates = {other_panel(), large_panel()};
  const auto pose = locate_panel(detect_tags<CameraFrame>(picture), exact_model(camera), 2.1_mm, candidates);
  ASSERT_TRUE(pose.ok()) << pose.error().message;
  EXPECT_EQ(pose->panel.value, "P-0001");
  EXPECT_EQ(pose->face_up, Face::kBack);
  EXPECT_EQ(pose->bed_from_panel.handedness(), Handedness::kImproper);
  EXPECT_EQ(pose->tags.size(), 5U);
  EXPECT_LT(pose->rms.count(), 0.05);
  EXPECT_LT(worst_error(*pose, kLay, true), 0.05);
  EXPECT_GT(pose->other_hand_rms.count(), 10);
  std::cout << "face down, 3 MP: rms " << pose->rms.count() << " mm, worst place " << worst_error(*pose, kLay, true)
            << " mm\n";

  const std::vector<Point<PanelFrame>> outline = {point<PanelFrame>(0, 0), point<PanelFrame>(kWidth, 0),
                                                  point<PanelFrame>(kWidth, kHeight), point<PanelFrame>(0, kHeight)};
  const cv::Mat drawn = draw_pose(picture, exact_model(camera), 2.1_mm, *pose, candidates[1].fiducials, outline);
  EXPECT_EQ(drawn.size(), picture.size());
  EXPECT_GT(cv::norm(drawn, picture, cv::NORM_L1), 1000);
  if (const char* out = std::getenv("VENEER_TEST_PICTURES"))  // NOLINT(concurrency-mt-unsafe)
    cv::imwrite(std::string(out) + "/bed_pose.png", drawn);
}

TEST(BedPose, FindsAFaceUpPanelTurnedByHalfATurn) {
  const test::TrueCamera camera;
  const test::Lay turned{470, 330, 178.5, false};
  const auto pose =
      locate_panel(seen_tags(camera, kShowTags, turned), exact_model(camera), 2.1_mm, std::vector{large_panel()});
  ASSERT_TRUE(pose.ok()) << pose.error().message;
  EXPECT_EQ(pose->face_up, Face::kShow);
  EXPECT_EQ(pose->bed_from_panel.handedness(), Handedness::kProper);
  EXPECT_LT(worst_error(*pose, turned, false), 0.03);
}

TEST(BedPose, TellsTheSameForEveryTurnOfAFaceDownPanel) {
  test::TrueCamera camera;
  camera.eye_z = 700;  // all of it in view at any turn
  for (double turn = 0; turn < 360; turn += 30) {
    test::Lay lay{0, 0, turn, false};
    const auto middle = lay.bed_of(kWidth / 2, kHeight / 2);
    lay.x = 260 - middle[0], lay.y = 190 - middle[1];
    const auto pose =
        locate_panel(seen_tags(camera, kBackTags, lay), exact_model(camera), 2.1_mm, std::vector{large_panel()});
    ASSERT_TRUE(pose.ok()) << turn << ": " << pose.error().message;
    EXPECT_EQ(pose->bed_from_panel.handedness(), Handedness::kImproper);
    EXPECT_LT(worst_error(*pose, lay, true), 0.05) << turn;
  }
}

// 2.1 mm of thickness forgotten is 0.4 % of the distance: no residual can hide it.
TEST(BedPose, RefusesAPanelWhoseThicknessWasForgotten) {
  const test::TrueCamera camera;
  const auto pose =
      locate_panel(seen_tags(camera, kBackTags, kLay), exact_model(camera), 0_mm, std::vector{large_panel()});
  ASSERT_FALSE(pose.ok());
  EXPECT_EQ(pose.error().code, ErrorCode::kRefused);
  EXPECT_NE(pose.error().message.find("thickness"), std::string::npos) << pose.error().message;
}

// As veneered boards are: bowed one way or the other by some tenths of a millimetre, and not all as thick.
TEST(BedPose, LaysABowedOrThickerPanelWhereItIs) {
  const test::TrueCamera camera;
  const std::vector<PanelCandidate> candidates = {large_panel()};
  struct Sheet {
    double thicker, bow_x, bow_y;
  };
  double worst = 0, worst_flat = 0;
  for (const test::Lay& lay : {kLay, test::Lay{75, 12, -2.0, false}, test::Lay{20, 85, 1.0, false}})
    for (const Sheet& sheet : {Sheet{0.05, 0.15, 0}, {-0.05, -0.08, -0.05}, {0.05, -0.1, 0.1}, {0.12, 0, 0}}) {
      const Lift lift = [&](double u, double v) {
        const auto one = [](double bow, double t) {
          return bow >= 0 ? bow * 4 * t * (1 - t) : -bow * (1 - 4 * t * (1 - t));
        };
        return sheet.thicker + one(sheet.bow_x, u) + one(sheet.bow_y, v);
      };
      for (const std::uint64_t seed : {1U, 2U, 3U}) {
        const auto tags = seen_tags(camera, kBackTags, lay, 2.1, lift, seed);
        const auto pose = locate_panel(tags, exact_model(camera), 2.1_mm, candidates);
        ASSERT_TRUE(pose.ok()) << pose.error().message;
        worst = std::max(worst, worst_error(*pose, lay, true));
        const auto flat =
            locate_panel(seen_tags(camera, kBackTags, lay, 2.1, {}, seed), exact_model(camera), 2.1_mm, candidates);
        ASSERT_TRUE(flat.ok()) << flat.error().message;
        worst_flat = std::max(worst_flat, worst_error(*flat, lay, true));
      }
    }
  EXPECT_LT(worst, 0.03);
  EXPECT_LT(worst_flat, 0.03) << "a flat one is found as well";
  std::cout << "bowed: worst place " << worst << " mm, flat " << worst_flat << " mm\n";
}

TEST(BedPose, SaysInOneSentenceWhatIsWrongWithTheTags) {
  const test::TrueCamera camera;
  const CameraModel model = exact_model(camera);
  const std::vector<PanelCandidate> candidates = {large_panel(), other_panel()};
  const auto tags = seen_tags(camera, kBackTags, kLay);
  const auto complaint = [&](std::vector<Tag<CameraFrame>> seen, ErrorCode code) {
    const auto pose = locate_panel(seen, model, 2.1_mm, candidates);
    if (pose.ok()) return std::string("found");
    EXPECT_EQ(pose.error().code, code);
    return pose.error().message;
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << text;
  };
  EXPECT_TRUE(has(complaint({}, ErrorCode::kNotFound), "sees no tags"));
  EXPECT_TRUE(has(complaint({tags[0], tags[1]}, ErrorCode::kRefused), "only 2 of panel P-0001's tags"));

  auto strange = tags;
  for (auto& tag : strange) tag.id += 100;
  EXPECT_TRUE(has(complaint(strange, ErrorCode::kNotFound), "no known panel"));

  auto mixed = tags;
  mixed[4].id += 20;
  EXPECT_TRUE(has(complaint(mixed, ErrorCode::kRefused), "P-0001 and P-0002"));

  auto both_faces = tags;
  both_faces[4].id = kShowTags[0].id;
  EXPECT_TRUE(has(complaint(both_faces, ErrorCode::kRefused), "both faces"));

  auto twice = tags;
  twice.push_back(tags[0]);
  EXPECT_TRUE(has(complaint(twice, ErrorCode::kRefused), "seen twice"));

  auto more = tags;
  more.push_back(tags[0]), more.back().id = 17;
  more.push_back(tags[1]), more.back().id = 18;
  EXPECT_TRUE(has(complaint(more, ErrorCode::kRefused), "17, 18"));

  std::vector<Tag<CameraFrame>> moved(tags.begin(), tags.begin() + 3);
  for (auto& corner : moved[2].corners) corner.x += Pixels(5);
  EXPECT_TRUE(has(complaint(moved, ErrorCode::kRefused), "too few are seen to tell which one has moved"));
}

// A tag that came loose, by what the others say. 0.15 mm may move the pose by 0.02 mm at most.
TEST(BedPose, LeavesOutATagThatHasMoved) {
  const test::TrueCamera camera;
  const CameraModel model = exact_model(camera);
  const std::vector<PanelCandidate> candidates = {large_panel()};
  const auto sound = locate_panel(seen_tags(camera, kBackTags, kLay), model, 2.1_mm, candidates);
  ASSERT_TRUE(sound.ok()) << sound.error().message;
  EXPECT_TRUE(sound->moved.empty());
  EXPECT_EQ(moved_tags_text(*sound), "");
  ASSERT_EQ(sound->left_out.size(), 5U);
  for (const FiducialOffset& tag : sound->left_out) EXPECT_LT(tag.off.count(), 0.05);
  for (const double by : {0.15, 0.22, 0.4, 3.0}) {
    for (std::size_t which = 0; which < kBackTags.size(); ++which) {
      for (const double way : {0.0, 1.9, 4.1}) {
        auto tags = kBackTags;
        tags[which].lay.x += by * std::cos(way), tags[which].lay.y += by * std::sin(way);
        const auto pose = locate_panel(seen_tags(camera, tags, kLay), model, 2.1_mm, candidates);
        ASSERT_TRUE(pose.ok()) << by << " mm: " << pose.error().message;
        ASSERT_EQ(pose->moved.size(), 1U) << by << " mm";
        EXPECT_EQ(pose->moved[0].tag, tags[which].id);
        EXPECT_NEAR(pose->moved[0].off.count(), by, 0.05);
        EXPECT_EQ(pose->tags.size(), 4U);
        double worst = 0;
        for (const auto& corner : {point<PanelFrame>(0, 0), point<PanelFrame>(kWidth, 0), point<PanelFrame>(0, kHeight),
                                   point<PanelFrame>(kWidth, kHeight)})
          worst = std::max(worst, distance(pose->bed_from_panel * corner, sound->bed_from_panel * corner).count());
        EXPECT_LE(worst, 0.02) << "tag " << tags[which].id << ", " << by << " mm";
        EXPECT_NE(moved_tags_text(*pose).find("tag " + std::to_string(tags[which].id)), std::string::npos);
      }
    }
  }
}

TEST(BedPose, RefusesWhenNobodyCanTellWhichTagsHaveMoved) {
  const test::TrueCamera camera;
  const CameraModel model = exact_model(camera);
  const std::vector<PanelCandidate> candidates = {large_panel()};
  auto tags = kBackTags;
  tags[1].lay.y += 0.3, tags[3].lay.x -= 0.25;
  const auto two = locate_panel(seen_tags(camera, tags, kLay), model, 2.1_mm, candidates);
  ASSERT_FALSE(two.ok()) << "two of five: the sheet may be bent as well";
  EXPECT_NE(two.error().message.find("which one has moved"), std::string::npos) << two.error().message;
  // Three tags: one of them moved, and any may be the one.
  tags = {kBackTags[0], kBackTags[1], kBackTags[3]};
  tags[2].lay.x += 0.25;
  const auto three = locate_panel(seen_tags(camera, tags, kLay), model, 2.1_mm, candidates);
  ASSERT_FALSE(three.ok());
  EXPECT_EQ(three.error().code, ErrorCode::kRefused);
  EXPECT_NE(three.error().message.find("which one has moved"), std::string::npos) << three.error().message;
}

// What three tags disagree by is borne up to a limit, but never in silence.
TEST(BedPose, TellsOfTagsThatDisagreeALittle) {
  const test::TrueCamera camera;
  const CameraModel model = exact_model(camera);
  std::vector<GluedTag> tags = {kBackTags[0], kBackTags[1], kBackTags[3]};
  tags[2].lay.x += 0.08;
  const auto pose = locate_panel(seen_tags(camera, tags, kLay), model, 2.1_mm, std::vector{large_panel()});
  ASSERT_TRUE(pose.ok()) << pose.error().message;
  EXPECT_TRUE(pose->moved.empty());
  ASSERT_TRUE(pose->disagreement);
  EXPECT_GT(pose->disagreement->count(), 0.08);
  EXPECT_LE(pose->disagreement->count(), 0.16);
  EXPECT_NE(moved_tags_text(*pose).find("nobody can tell which one has moved"), std::string::npos)
      << moved_tags_text(*pose);
}

// Four tags of which one has moved, each corner seen with as much noise as a dim picture gives: the wrong one must not
// be named and dropped because it happens to agree a little better.
TEST(BedPose, NamesNoTagThatDidNotMoveHoweverNoisyThePicture) {
  const test::TrueCamera camera;
  const CameraModel model = exact_model(camera);
  const std::vector<PanelCandidate> candidates = {large_panel()};
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.06);  // px, beside that of seen_tags()
  int named = 0, wrong = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<GluedTag> tags = {kBackTags[0], kBackTags[1], kBackTags[2], kBackTags[3]};
    const std::size_t which = static_cast<std::size_t>(round) % tags.size();
    const double way = 0.7 * round;
    tags[which].lay.x += 0.12 * std::cos(way), tags[which].lay.y += 0.12 * std::sin(way);
    auto seen = seen_tags(camera, tags, kLay);
    for (auto& tag : seen)
      for (auto& corner : tag.corners) corner.x += Pixels(noise(random)), corner.y += Pixels(noise(random));
    const auto pose = locate_panel(seen, model, 2.1_mm, candidates);
    if (!pose.ok()) continue;
    for (const FiducialOffset& moved : pose->moved) ++named, wrong += moved.tag != tags[which].id ? 1 : 0;
  }
  EXPECT_GT(named, 30);
  EXPECT_LE(wrong * 100, named) << wrong << " of " << named;
}

// A registration that lost the mirroring between the faces must not reach the laser.
TEST(BedPose, RefusesBackTagsThatLieLikeAShowFace) {
  const test::TrueCamera camera;
  PanelCandidate wrong = large_panel();
  for (auto& tag : wrong.fiducials.tags) {
    for (auto& corner : tag.corners) corner.x = Millimetres(kWidth) - corner.x;
  }
  const auto pose = locate_panel(seen_tags(camera, kBackTags, kLay), exact_model(camera), 2.1_mm, std::vector{wrong});
  ASSERT_FALSE(pose.ok());
  EXPECT_NE(pose.error().message.find("the other way round"), std::string::npos) << pose.error().message;
}

}  // namespace
}  // namespace veneer::calib
