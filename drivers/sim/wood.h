// Procedurally grown wood. A strip of veneer is a cut through a log: growth rings around a wandering pith, seen flat
// (cathedrals), rift or quarter sawn (lines); pores, rays, fibre, curl and colour streaks follow the species.
//
// Pure functions of their arguments: equal seeds grow equal wood. Thread-safe.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace veneer::sim {

enum class PoreKind { kFine, kDiffuse, kRingPorous };

// Lengths in mm unless said otherwise; contrasts in parts of the palette's length (0 = lightest wood, 1 = darkest).
struct WoodSpecies {
  std::string name;
  std::vector<cv::Vec3b> palette;  // BGR, from the lightest to the darkest wood of the species
  double tone = 0.4;               // where on the palette the plain wood lies
  double tone_spread = 0.08;       // how much one strip differs from the next
  double ring_width = 3, ring_contrast = 0.2;
  double ring_edge = 0.1;  // share of a ring taken by the dark line at its end
  double ring_variation = 0.4;
  double band_contrast = 0;  // pigment bands that follow the rings but not each ring (rosewood, zebrano)
  double band_width = 6;
  double band_sharpness = 1;  // 1 = soft, 4 = drawn lines
  double flat_sawn = 0.7;     // how likely a strip shows cathedrals; the rest is rift or quarter
  double fibre_contrast = 0.06, streak_contrast = 0.08, mottle_contrast = 0.04;
  PoreKind pores = PoreKind::kFine;
  double pore_density = 1;  // per mm2
  double pore_length = 2, pore_width = 0.15, pore_darkness = 0.4;
  double ray_density = 0, ray_length = 2, ray_width = 0.15, ray_darkness = 0.3;  // short dark lines along the grain
  double silver = 0;  // light ribbons across quarter-sawn wood, 0 to 1
  double curl = 0;    // brightness swing of flame figure
  double curl_length = 9;
  double hue_spread = 0.02;  // slow change of red against blue
};

const std::vector<WoodSpecies>& wood_species();
// What no tree grows: weathered, dyed, bleached and ebonised woods, some without any warmth.
const std::vector<WoodSpecies>& treated_woods();
const WoodSpecies* find_species(const std::string& name);  // of either; null when unknown

// CV_8UC3 BGR of `size` pixels; the grain runs along the columns (top to bottom).
cv::Mat grow_wood(const WoodSpecies& species, cv::Size size, double px_per_mm, std::uint64_t seed);

// All species beside each other, for people to look at.
cv::Mat draw_swatches(std::uint64_t seed);

}  // namespace veneer::sim
