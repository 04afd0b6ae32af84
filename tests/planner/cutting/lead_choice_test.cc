#include "planner/cutting/lead_choice.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <opencv2/core.hpp>

#include "base/frames.h"
#include "planner/cutting/beam_path.h"
#include "tests/planner/cutting/scattered_pieces.h"

namespace veneer::planner {
namespace {

constexpr Millimetres kKerf{0.27};

Ring<PanelFrame> panel_square(double x, double y, double side) {
  return {point<PanelFrame>(x, y), point<PanelFrame>(x + side, y), point<PanelFrame>(x + side, y + side),
          point<PanelFrame>(x, y + side)};
}

LeadPiece lead_piece(Ring<PanelFrame> outline) {
  LeadPiece out;
  out.allocation = offset(Region<PanelFrame>(outline), kKerf);
  out.outline = std::move(outline);
  return out;
}

// Ten pixels a millimetre, all of it wood.
LeadRoom sheet(int width, int height) {
  return {{cv::Mat(10 * height, 10 * width, CV_8UC1, cv::Scalar(255)), ScanResolution{10}, {}}, {}, kKerf};
}

ToolpathOptions options() {
  ToolpathOptions out;
  out.recipe.kerf_back = out.recipe.kerf_show = kKerf;
  out.cool_distance = Millimetres(0);
  return out;
}

std::ptrdiff_t found(const Result<std::vector<std::optional<LeadIn>>>& leads) {
  EXPECT_TRUE(leads.ok());
  return leads.ok() ? std::count_if(leads->begin(), leads->end(), [](const auto& l) { return l.has_value(); }) : -1;
}

// What the header promises of wood, whatever was chosen.
void expect_good(const std::vector<LeadPiece>& pieces, const LeadRoom& room,
                 const std::vector<std::optional<LeadIn>>& leads) {
  ASSERT_EQ(leads.size(), pieces.size());
  std::vector<Region<PanelFrame>> booked;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    booked.push_back(leads[i] ? unite(pieces[i].allocation, leads[i]->burnt) : pieces[i].allocation);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!leads[i]) continue;
    EXPECT_EQ(booked[i].micro_area().rings.size(), 1U) << "the lead-in meets its own kerf";
    EXPECT_FALSE(overlaps(leads[i]->burnt, Region<PanelFrame>(pieces[i].outline)));
    // With a web of wood between them, which holds the waste.
    const auto webbed = offset(leads[i]->burnt, 0.39_mm, Corners::kRound);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      EXPECT_FALSE(k != i && (overlaps(booked[i], booked[k]) || overlaps(webbed, booked[k]))) << i << " and " << k;
    }
    for (const auto& spared : room.spared) EXPECT_FALSE(overlaps(leads[i]->burnt, spared));
    const auto burnt = leads[i]->burnt.rings();
    for (const auto& p : burnt.front()) {
      double column = 0, row = 0;
      room.free.to_pixels(p, column, row);
      EXPECT_NE(room.free.pixels.at<unsigned char>(static_cast<int>(row), static_cast<int>(column)), 0);
    }
  }
}

// The strokes that a piece is then burnt with lie in what is booked for it.
void expect_burnt_where_booked(const std::vector<LeadPiece>& pieces, const std::vector<std::optional<LeadIn>>& leads) {
  const Isometry2<BedFrame, PanelFrame> bed_from_panel(Radians(0.3), point<BedFrame>(80, 20), Handedness::kImproper);
  std::vector<ToolpathPiece> laid;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    ToolpathPiece& piece = laid.emplace_back();
    piece.piece = PieceId{static_cast<std::int64_t>(i)};
    piece.outline = bed_from_panel * pieces[i].outline;
    if (leads[i]) piece.leads = {{bed_from_panel * leads[i]->way.begin, bed_from_panel * leads[i]->way.end}};
  }
  const auto path = make_toolpath(laid, options());
  ASSERT_TRUE(path.ok());
  for (const auto& stroke : path->strokes) {
    const auto i = static_cast<std::size_t>(stroke.piece.value);
    const auto booked = leads[i] ? unite(pieces[i].allocation, leads[i]->burnt) : pieces[i].allocation;
    const auto path_on_panel = bed_from_panel.inverse() * stroke.path;
    // What the beam burns beside its way, but for a few micrometres of rounding.
    const auto within = offset(booked, -(kKerf / 2 - Millimetres(0.006)));
    EXPECT_TRUE(within.contains(path_on_panel)) << "piece " << i;
    EXPECT_EQ(leads[i].has_value(), path_on_panel.front() != path_on_panel.back());
  }
}

TEST(LeadChoice, APieceAloneIsLedIntoFromOutside) {
  const std::vector<LeadPiece> pieces = {lead_piece(panel_square(40, 40, 14))};
  const LeadRoom room = sheet(100, 100);
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok()) << leads.error().message;
  ASSERT_TRUE(leads->front().has_value());
  expect_good(pieces, room, *leads);
  expect_burnt_where_booked(pieces, *leads);
  // A quarter of a square millimetre is what it costs.
  const auto booked = unite(pieces[0].allocation, (*leads)[0]->burnt);
  EXPECT_LT((booked.area() - pieces[0].allocation.area()).count(), 0.32);
  EXPECT_GT((booked.area() - pieces[0].allocation.area()).count(), 0.15);
}

TEST(LeadChoice, WasteThatNothingFitsIntoComesFirst) {
  // A gap of 1.5 mm to the right, free wood everywhere else.
  const std::vector<LeadPiece> pieces = {lead_piece(panel_square(40, 40, 14)), lead_piece(panel_square(56.04, 30, 40))};
  const LeadRoom room = sheet(140, 100);
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok()) << leads.error().message;
  ASSERT_TRUE((*leads)[0].has_value());
  EXPECT_GT((*leads)[0]->way.begin.x.count(), 54);
  expect_good(pieces, room, *leads);
  expect_burnt_where_booked(pieces, *leads);
}

TEST(LeadChoice, PiecesPackedTightlyGetNoneInside) {
  // Nine squares whose kerfs touch: the middle one has no waste at all.
  std::vector<LeadPiece> pieces;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pieces.push_back(lead_piece(panel_square(40 + 14.54 * c, 40 + 14.54 * r, 14)));
  const LeadRoom room = sheet(130, 130);
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok()) << leads.error().message;
  EXPECT_FALSE((*leads)[4].has_value());
  for (const int corner : {0, 2, 6, 8}) EXPECT_TRUE((*leads)[static_cast<std::size_t>(corner)].has_value()) << corner;
  expect_good(pieces, room, *leads);
  expect_burnt_where_booked(pieces, *leads);
}

TEST(LeadChoice, NothingOutsideTheUsableWoodIsBurntAndNoFiducial) {
  const std::vector<LeadPiece> pieces = {lead_piece(panel_square(40, 40, 14))};
  LeadRoom room = sheet(100, 100);
  // Only a strip along the upper edge is wood, and a tag lies on its right end.
  room.free.pixels.setTo(0);
  room.free.pixels(cv::Rect(390, 390, 160, 220)).setTo(255);
  room.spared = {Region<PanelFrame>(panel_square(53, 54.5, 10))};
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok()) << leads.error().message;
  ASSERT_TRUE((*leads)[0].has_value());
  EXPECT_LT((*leads)[0]->way.begin.x.count(), 47);
  EXPECT_GT((*leads)[0]->way.begin.y.count(), 54);
  expect_good(pieces, room, *leads);
  // Nothing but what is booked for the piece itself.
  room.free.pixels.setTo(0);
  room.free.pixels(cv::Rect(397, 457, 146, 146)).setTo(255);
  EXPECT_EQ(found(choose_leads(pieces, room, options())), 0);
}

TEST(LeadChoice, ALengthOfZeroIsNone) {
  auto off = options();
  off.leads.length = Millimetres(0);
  EXPECT_EQ(found(choose_leads({lead_piece(panel_square(40, 40, 14))}, sheet(100, 100), off)), 0);
}

TEST(LeadChoice, TwoPiecesNeverTakeTheSameWaste) {
  // Two squares corner to corner, 1.3 mm apart: each alone would begin in between.
  const std::vector<LeadPiece> pieces = {lead_piece(panel_square(40, 40, 14)),
                                         lead_piece(panel_square(55.3, 55.3, 14))};
  const LeadRoom room = sheet(120, 120);
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok());
  EXPECT_TRUE((*leads)[0].has_value() && (*leads)[1].has_value());
  expect_good(pieces, room, *leads);
}

std::vector<LeadPiece> scattered(int count, double side, bool marks) {
  std::vector<LeadPiece> out;
  const Isometry2<PanelFrame, BedFrame> same;
  for (const auto& piece : test::scattered_pieces(count, side, marks)) {
    LeadPiece& lead = out.emplace_back(lead_piece(same * piece.outline));
    lead.mark = piece.mark;
    lead.artwork_up = piece.artwork_up;
  }
  return out;
}

TEST(LeadChoice, AFullPanelFindsOneForNearlyEveryPiece) {
  const auto pieces = scattered(300, 14, false);
  const LeadRoom room = sheet(480, 340);
  const auto leads = choose_leads(pieces, room, options());
  ASSERT_TRUE(leads.ok()) << leads.error().message;
  expect_good(pieces, room, *leads);
  expect_burnt_where_booked(pieces, *leads);
  EXPECT_GE(found(leads), 295);
}

// A square whose sides are waves, in short straight steps as flattened curves are.
Ring<PanelFrame> wavy_square(double x, double y, double side, cv::RNG& random) {
  constexpr int kSteps = 24;
  Ring<PanelFrame> out;
  const Ring<PanelFrame> corners = panel_square(x, y, side);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto &a = corners[k], &b = corners[(k + 1) % 4];
    const double ux = (b.x - a.x).count() / side, uy = (b.y - a.y).count() / side;
    const double height = random.uniform(-2.5, 2.5), waves = random.uniform(1, 4);
    for (int i = 0; i < kSteps; ++i) {
      const double t = static_cast<double>(i) / kSteps;
      const double along = t * side, aside = height * std::sin(kPi * t) * std::sin(waves * kPi * t);
      out.push_back(point<PanelFrame>(a.x.count() + ux * along - uy * aside, a.y.count() + uy * along + ux * aside));
    }
  }
  return out;
}

// On the bed the same outline begins elsewhere, is mirrored and rounded anew: its lead-in must end where it was booked.
TEST(LeadChoice, CurvedPiecesAreBurntWhereTheyAreBooked) {
  std::ptrdiff_t with_lead = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    cv::RNG random(seed);
    std::vector<LeadPiece> pieces;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) pieces.push_back(lead_piece(wavy_square(12 + 18.5 * c, 12 + 18.5 * r, 12, random)));
    const LeadRoom room = sheet(75, 75);
    const auto leads = choose_leads(pieces, room, options());
    ASSERT_TRUE(leads.ok()) << leads.error().message;
    expect_good(pieces, room, *leads);
    expect_burnt_where_booked(pieces, *leads);
    with_lead += found(leads);
    ASSERT_FALSE(HasFailure()) << "seed " << seed;
  }
  EXPECT_GE(with_lead, 240) << "of 270";
}

// A piece of the demo's (seed 16369156): one of its points lies amid a straight edge, where the panel's ring has no
// vertex but the bed's has one, 0.02 mm nearer to where its cut began. The beam went there, 0.3 mm through wood of
// nobody.
TEST(LeadChoice, ALeadInEndsWhereItWasBookedThoughTheRingOnTheBedHasAVertexNearer) {
  const Ring<PanelFrame> outline = {point<PanelFrame>(20, 22),         point<PanelFrame>(24, 20),
                                    point<PanelFrame>(26.914, 27.35),  point<PanelFrame>(26.451, 27.909),
                                    point<PanelFrame>(25.988, 28.468), point<PanelFrame>(20, 26.846)};
  const Recipe recipe = options().recipe;
  const auto corner = point<PanelFrame>(26.1, 28.6), amid = point<PanelFrame>(26.55, 28);
  const auto begin = point<PanelFrame>(27.1, 28.85);
  ASSERT_LT(distance(begin, amid), distance(begin, corner));
  const auto lead = lead_of(outline, begin, recipe, Millimetres(0.05));
  ASSERT_TRUE(lead.ok());
  ASSERT_LT(distance(lead->end, corner).count(), 0.1) << "the panel's ring has no vertex amid that edge";
  for (int turn = 0; turn < 100; ++turn) {
    const Isometry2<BedFrame, PanelFrame> bed_from_panel(Radians(0.0631 * turn), point<BedFrame>(80.1234, 20.4321),
                                                         Handedness::kImproper);
    ToolpathPiece laid;
    laid.piece = PieceId{1};
    laid.outline = bed_from_panel * outline;
    laid.recipe = recipe;
    laid.leads = {{bed_from_panel * lead->begin, bed_from_panel * lead->end}};
    const auto path = make_toolpath({laid}, options());
    ASSERT_TRUE(path.ok());
    const auto end = bed_from_panel.inverse() * path->strokes.front().path[1];
    EXPECT_LT(distance(end, lead->end).count(), 0.01) << "turn " << turn;
  }
}

// Offsets cut tips off where a corner is sharper than 60 degrees. Rounded anew, a corner of about that may keep on the
// bed the tip that it lost when it was booked.
TEST(BeamRing, StaysWithinWhatIsBookedAtCornersOfAnyAngleHoweverTheOutlineLies) {
  constexpr Millimetres kRounding{0.006};
  for (double degrees = 50; degrees <= 90; degrees += degrees > 59 && degrees < 63 ? 0.0625 : 0.25)
    for (const double part : {0.1, 0.3})
      for (int turn = 0; turn < 8; ++turn) {
        const double angle = degrees * kPi / 180;
        // Short parts at the tip, as flattened curves have them.
        const Ring<PanelFrame> outline{point<PanelFrame>(20, 20), point<PanelFrame>(20 + part, 20),
                                       point<PanelFrame>(32, 20.5),
                                       point<PanelFrame>(20 + 12 * std::cos(angle), 20.5 + 12 * std::sin(angle)),
                                       point<PanelFrame>(20 + part * std::cos(angle), 20 + part * std::sin(angle))};
        const auto within = offset(offset(Region<PanelFrame>(outline), kKerf), -(kKerf / 2 - kRounding));
        const Isometry2<BedFrame, PanelFrame> bed_from_panel(Radians(0.1 + 0.77 * turn),
                                                             point<BedFrame>(80.1234, 20.4321), Handedness::kImproper);
        const auto ring = beam_ring(bed_from_panel * outline, kKerf / 2);
        ASSERT_TRUE(ring.ok()) << ring.error().message;
        for (const auto& p : *ring) {
          ASSERT_TRUE(within.contains(bed_from_panel.inverse() * p)) << degrees << " degrees, turn " << turn;
          // Nor does the beam come nearer to the piece than half its kerf.
          ASSERT_FALSE(offset(Region<PanelFrame>(outline), kKerf / 2 - Millimetres(0.003), Corners::kRound)
                           .contains(bed_from_panel.inverse() * p))
              << degrees << " degrees, turn " << turn;
        }
      }
}

RC_GTEST_PROP(LeadChoice, TakesNobodysWoodWhateverTheOutlines, ()) {
  // Stars of random radii in a loose lattice, on wood with random stains.
  std::vector<LeadPiece> pieces;
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) {
      const int n = *rc::gen::inRange(3, 9);
      Ring<PanelFrame> outline;
      for (int i = 0; i < n; ++i) {
        const double radius = *rc::gen::inRange(50, 110) / 10.0;
        outline.push_back(point<PanelFrame>(25 + 22.6 * c + radius * std::cos(2 * kPi * i / n),
                                            25 + 22.6 * r + radius * std::sin(2 * kPi * i / n)));
      }
      pieces.push_back(lead_piece(std::move(outline)));
    }
  LeadRoom room = sheet(75, 75);
  for (int i = 0; i < 6; ++i)
    room.free.pixels(cv::Rect{*rc::gen::inRange(0, 700), *rc::gen::inRange(0, 700), 40, 40}).setTo(0);
  // Pieces themselves lie on free wood, always.
  for (const auto& piece : pieces) {
    const auto box = bounds(piece.allocation.rings().front());
    for (int y = 0; y < room.free.pixels.rows; ++y)
      for (int x = 0; x < room.free.pixels.cols; ++x)
        if (const auto p = room.free.from_pixels(x + 0.5, y + 0.5); box.contains(p) && piece.allocation.contains(p))
          room.free.pixels.at<unsigned char>(y, x) = 255;
  }
  const auto leads = choose_leads(pieces, room, options());
  RC_ASSERT(leads.ok());
  expect_good(pieces, room, *leads);
  RC_ASSERT(!::testing::Test::HasFailure());
}

}  // namespace
}  // namespace veneer::planner
