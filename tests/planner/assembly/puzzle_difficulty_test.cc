#include "planner/assembly/puzzle_difficulty.h"

#include <gtest/gtest.h>

#include <cmath>

namespace veneer::planner {
namespace {

Piece piece_of(Ring<ArtworkFrame> outline, std::size_t artwork = 0) {
  Piece piece;
  piece.artwork = artwork;
  piece.artwork_outline = std::move(outline);
  return piece;
}

Ring<ArtworkFrame> rectangle(double x, double y, double width, double height) {
  return {point<ArtworkFrame>(x, y), point<ArtworkFrame>(x + width, y), point<ArtworkFrame>(x + width, y + height),
          point<ArtworkFrame>(x, y + height)};
}

// A square with a bulge of its own size on one side.
Ring<ArtworkFrame> bulging(double x, double y, double bulge) {
  Ring<ArtworkFrame> ring = {point<ArtworkFrame>(x, y), point<ArtworkFrame>(x + 10, y)};
  for (int i = 1; i < 20; ++i)
    ring.push_back(point<ArtworkFrame>(x + 10 + bulge * std::sin(kPi * i / 20), y + 10.0 * i / 20));
  ring.push_back(point<ArtworkFrame>(x + 10, y + 10));
  ring.push_back(point<ArtworkFrame>(x, y + 10));
  return ring;
}

Plan plan_of(int artworks, std::vector<Piece> pieces) {
  Plan plan;
  plan.artworks.resize(static_cast<std::size_t>(artworks));
  plan.pieces = std::move(pieces);
  return plan;
}

TEST(PuzzleDifficulty, ASquareOfAGridFitsEveryPlaceInFourWays) {
  std::vector<Piece> pieces;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 8; ++column) pieces.push_back(piece_of(rectangle(12 * column, 12 * row, 12, 12)));
  EXPECT_NEAR(puzzle_difficulty(plan_of(1, pieces)), std::log2(4 * 32), 1e-9);
}

TEST(PuzzleDifficulty, ARectangleFitsInTwoWays) {
  EXPECT_NEAR(puzzle_difficulty(plan_of(1, {piece_of(rectangle(0, 0, 10, 14)), piece_of(rectangle(10, 0, 10, 14))})),
              std::log2(4), 1e-9);
}

TEST(PuzzleDifficulty, ShapesOfTheirOwnLeaveNothingToTell) {
  std::vector<Piece> pieces;
  for (int i = 1; i <= 6; ++i) pieces.push_back(piece_of(bulging(30 * i, 0, i)));
  EXPECT_EQ(puzzle_difficulty(plan_of(1, pieces)), 0);
}

TEST(PuzzleDifficulty, APieceThatIsTurnedInItsPlaceIsTheSameShape) {
  // The second is the first, turned by 120 degrees.
  Ring<ArtworkFrame> turned;
  const double c = std::cos(degrees(120).count()), s = std::sin(degrees(120).count());
  for (const auto& p : bulging(0, 0, 4))
    turned.push_back(point<ArtworkFrame>(50 + c * p.x.count() - s * p.y.count(), s * p.x.count() + c * p.y.count()));
  EXPECT_NEAR(puzzle_difficulty(plan_of(1, {piece_of(bulging(0, 0, 4)), piece_of(turned)})), 1, 1e-9);
}

TEST(PuzzleDifficulty, AMirroredPieceFitsNowhereFaceUp) {
  const Ring<ArtworkFrame> skew = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(12, 0), point<ArtworkFrame>(9, 9)};
  Ring<ArtworkFrame> mirrored = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(12, 0), point<ArtworkFrame>(3, 9)};
  EXPECT_EQ(puzzle_difficulty(plan_of(1, {piece_of(skew), piece_of(mirrored)})), 0);
}

TEST(PuzzleDifficulty, PicturesAreTakenOneByOneAndNothingIsNotHard) {
  EXPECT_EQ(puzzle_difficulty(plan_of(0, {})), 0);
  const auto two = plan_of(2, {piece_of(rectangle(0, 0, 9, 9), 0), piece_of(rectangle(0, 0, 9, 9), 1)});
  EXPECT_NEAR(puzzle_difficulty(two), std::log2(4), 1e-9);
  EXPECT_NEAR(puzzle_difficulty(two, 1), std::log2(4), 1e-9);
}

}  // namespace
}  // namespace veneer::planner
