#include "drivers/sim/wood.h"

#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>

namespace veneer::sim {
namespace {

cv::Scalar mean_colour(const WoodSpecies& wood, std::uint64_t seed) {
  return cv::mean(grow_wood(wood, {200, 500}, 5, seed));
}

TEST(Wood, GrowsTheSameFromTheSameSeed) {
  for (const WoodSpecies& wood : wood_species()) {
    const cv::Mat once = grow_wood(wood, {80, 200}, 4, 7), again = grow_wood(wood, {80, 200}, 4, 7);
    EXPECT_EQ(cv::norm(once, again, cv::NORM_INF), 0) << wood.name;
    EXPECT_GT(cv::norm(once, grow_wood(wood, {80, 200}, 4, 8), cv::NORM_INF), 10) << wood.name;
  }
}

TEST(Wood, OffersAtLeastSixSpeciesFromLightToVeryDark) {
  EXPECT_GE(wood_species().size(), 6U);
  double lightest = 0, darkest = 255;
  for (const WoodSpecies& wood : wood_species()) {
    const cv::Scalar colour = mean_colour(wood, 1);
    lightest = std::max(lightest, colour[1]), darkest = std::min(darkest, colour[1]);
  }
  EXPECT_GT(lightest, 195);
  EXPECT_LT(darkest, 55);
}

TEST(Wood, KeepsItsSpeciesApartByColour) {
  const auto& woods = wood_species();
  std::vector<cv::Scalar> colours;
  for (const WoodSpecies& wood : woods) colours.push_back(mean_colour(wood, 3));
  for (std::size_t i = 0; i < woods.size(); ++i) {
    for (std::size_t k = i + 1; k < woods.size(); ++k) {
      EXPECT_GT(cv::norm(colours[i] - colours[k]), 10) << woods[i].name << " and " << woods[k].name;
    }
  }
}

// Treated woods have hardly any hue of their own; a shop has them all the same.
TEST(Wood, IsTreatedInNeutralTonesFromWhiteToBlack) {
  double lightest = 0, darkest = 255;
  for (const WoodSpecies& wood : treated_woods()) {
    const cv::Scalar colour = mean_colour(wood, 2);
    EXPECT_LT(std::abs(colour[2] - colour[0]), 16) << wood.name;
    EXPECT_EQ(find_species(wood.name), &wood);
    lightest = std::max(lightest, colour[1]), darkest = std::min(darkest, colour[1]);
  }
  EXPECT_GT(lightest, 210);
  EXPECT_LT(darkest, 60);
}

// Along the grain wood changes slowly, across it quickly; noise would do both alike.
TEST(Wood, RunsItsGrainAlongTheColumns) {
  for (const WoodSpecies& wood : wood_species()) {
    cv::Mat grey;
    cv::cvtColor(grow_wood(wood, {160, 600}, 6, 5), grey, cv::COLOR_BGR2GRAY);
    const double across = cv::norm(grey.colRange(2, 160), grey.colRange(0, 158), cv::NORM_L1);
    const double along = cv::norm(grey.rowRange(2, 600), grey.rowRange(0, 598), cv::NORM_L1);
    EXPECT_GT(across, 1.6 * along) << wood.name;
  }
}

}  // namespace
}  // namespace veneer::sim
