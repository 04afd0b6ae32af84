// The woods of the simulated shelf. Colours are BGR, oiled-veneer tones as a scanner sees them.
#include "drivers/sim/wood.h"

namespace veneer::sim {
namespace {

cv::Vec3b rgb(int r, int g, int b) {
  return {static_cast<unsigned char>(b), static_cast<unsigned char>(g), static_cast<unsigned char>(r)};
}

WoodSpecies maple() {
  WoodSpecies w;
  w.name = "maple";
  w.palette = {rgb(243, 228, 200), rgb(234, 214, 180), rgb(219, 193, 153), rgb(190, 157, 113)};
  w.tone = 0.28, w.ring_width = 3.4, w.ring_contrast = 0.20, w.ring_edge = 0.06, w.flat_sawn = 0.7;
  w.fibre_contrast = 0.10, w.streak_contrast = 0.12, w.mottle_contrast = 0.08;
  w.pore_density = 1.6, w.pore_length = 1.2, w.pore_width = 0.07, w.pore_darkness = 0.10;
  w.ray_density = 0.9, w.ray_length = 1.1, w.ray_width = 0.11, w.ray_darkness = 0.10;
  w.curl = 0.042, w.curl_length = 7, w.hue_spread = 0.012;
  return w;
}

WoodSpecies ash() {
  WoodSpecies w;
  w.name = "ash";
  w.palette = {rgb(231, 212, 178), rgb(217, 192, 151), rgb(194, 163, 117), rgb(150, 116, 76)};
  w.tone = 0.22, w.ring_width = 3.0, w.ring_contrast = 0.34, w.ring_edge = 0.30, w.flat_sawn = 0.85;
  w.fibre_contrast = 0.10, w.streak_contrast = 0.10;
  w.pores = PoreKind::kRingPorous, w.pore_density = 4.5, w.pore_length = 3.2, w.pore_width = 0.17;
  w.pore_darkness = 0.40;
  return w;
}

WoodSpecies oak() {
  WoodSpecies w;
  w.name = "oak";
  w.palette = {rgb(214, 182, 133), rgb(194, 157, 106), rgb(165, 126, 79), rgb(116, 82, 49)};
  w.tone = 0.30, w.ring_width = 2.3, w.ring_contrast = 0.26, w.ring_edge = 0.35, w.flat_sawn = 0.5;
  w.fibre_contrast = 0.13, w.streak_contrast = 0.14;
  w.pores = PoreKind::kRingPorous, w.pore_density = 6.0, w.pore_length = 2.6, w.pore_width = 0.20;
  w.pore_darkness = 0.48;
  w.ray_density = 0.16, w.ray_length = 8, w.ray_width = 0.18, w.ray_darkness = 0.25;
  w.silver = 0.7;
  return w;
}

WoodSpecies cherry() {
  WoodSpecies w;
  w.name = "cherry";
  w.palette = {rgb(211, 157, 110), rgb(190, 128, 82), rgb(163, 99, 60), rgb(118, 66, 40)};
  w.tone = 0.34, w.ring_width = 3.8, w.ring_contrast = 0.22, w.ring_edge = 0.08, w.flat_sawn = 0.8;
  w.fibre_contrast = 0.10, w.streak_contrast = 0.16, w.mottle_contrast = 0.08;
  w.pore_density = 2.2, w.pore_length = 1.4, w.pore_width = 0.07, w.pore_darkness = 0.16;
  w.ray_density = 0.5, w.ray_length = 1.6, w.ray_width = 0.12, w.ray_darkness = 0.10;
  w.curl = 0.035, w.curl_length = 11, w.hue_spread = 0.025;
  return w;
}

WoodSpecies walnut() {
  WoodSpecies w;
  w.name = "walnut";
  w.palette = {rgb(148, 110, 76), rgb(118, 83, 55), rgb(89, 60, 40), rgb(54, 36, 26)};
  w.tone = 0.42, w.tone_spread = 0.12, w.ring_width = 4.2, w.ring_contrast = 0.30, w.ring_edge = 0.14,
  w.flat_sawn = 0.8;
  w.band_contrast = 0.22, w.band_width = 11;
  w.fibre_contrast = 0.14, w.streak_contrast = 0.22, w.mottle_contrast = 0.10;
  w.pores = PoreKind::kDiffuse, w.pore_density = 1.3, w.pore_length = 2.6, w.pore_width = 0.15, w.pore_darkness = 0.42;
  w.curl = 0.05, w.curl_length = 13, w.hue_spread = 0.03;
  return w;
}

WoodSpecies padauk() {
  WoodSpecies w;
  w.name = "padauk";
  w.palette = {rgb(194, 92, 52), rgb(164, 66, 38), rgb(130, 47, 30), rgb(84, 30, 22)};
  w.tone = 0.36, w.ring_width = 4.5, w.ring_contrast = 0.12, w.ring_edge = 0.20, w.flat_sawn = 0.45;
  w.band_contrast = 0.26, w.band_width = 7;
  w.fibre_contrast = 0.12, w.streak_contrast = 0.20;
  w.pores = PoreKind::kDiffuse, w.pore_density = 1.1, w.pore_length = 4.2, w.pore_width = 0.19, w.pore_darkness = 0.50;
  w.curl = 0.03, w.curl_length = 16, w.hue_spread = 0.03;
  return w;
}

WoodSpecies wenge() {
  WoodSpecies w;
  w.name = "wenge";
  w.palette = {rgb(108, 79, 56), rgb(74, 52, 37), rgb(50, 35, 26), rgb(33, 23, 18)};
  w.tone = 0.50, w.ring_width = 1.15, w.ring_contrast = 0.46, w.ring_edge = 0.45, w.ring_variation = 0.5;
  w.flat_sawn = 0.4, w.fibre_contrast = 0.10, w.streak_contrast = 0.12, w.mottle_contrast = 0.03;
  w.pores = PoreKind::kDiffuse, w.pore_density = 0.8, w.pore_length = 3.2, w.pore_width = 0.16, w.pore_darkness = 0.35;
  return w;
}

WoodSpecies rosewood() {
  WoodSpecies w;
  w.name = "rosewood";
  w.palette = {rgb(140, 82, 54), rgb(106, 57, 39), rgb(72, 38, 29), rgb(34, 20, 18)};
  w.tone = 0.40, w.tone_spread = 0.10, w.ring_width = 3.6, w.ring_contrast = 0.10, w.ring_edge = 0.12,
  w.flat_sawn = 0.75;
  w.band_contrast = 0.55, w.band_width = 4.2, w.band_sharpness = 2.4;
  w.fibre_contrast = 0.10, w.streak_contrast = 0.14;
  w.pores = PoreKind::kDiffuse, w.pore_density = 0.9, w.pore_length = 2.4, w.pore_width = 0.16, w.pore_darkness = 0.45;
  w.hue_spread = 0.03;
  return w;
}

WoodSpecies zebrano() {
  WoodSpecies w;
  w.name = "zebrano";
  w.palette = {rgb(214, 184, 132), rgb(186, 150, 100), rgb(116, 82, 52), rgb(58, 38, 27)};
  w.tone = 0.30, w.ring_width = 3.4, w.ring_contrast = 1.0, w.ring_edge = 0.36, w.ring_variation = 0.6,
  w.flat_sawn = 0.1;
  w.band_contrast = 0.15, w.band_width = 7;
  w.fibre_contrast = 0.12, w.streak_contrast = 0.12;
  w.pores = PoreKind::kDiffuse, w.pore_density = 0.9, w.pore_length = 3.0, w.pore_width = 0.15, w.pore_darkness = 0.36;
  return w;
}

WoodSpecies weathered_oak() {
  WoodSpecies w = oak();
  w.name = "weathered oak";
  w.palette = {rgb(176, 174, 170), rgb(152, 150, 147), rgb(122, 121, 119), rgb(82, 82, 81)};
  w.hue_spread = 0.005;
  return w;
}

WoodSpecies silver_maple() {
  WoodSpecies w = maple();
  w.name = "silver maple";
  w.palette = {rgb(196, 199, 202), rgb(178, 181, 185), rgb(154, 158, 163), rgb(120, 124, 130)};
  w.hue_spread = 0.004;
  return w;
}

WoodSpecies bleached_ash() {
  WoodSpecies w = ash();
  w.name = "bleached ash";
  w.palette = {rgb(242, 239, 232), rgb(231, 227, 218), rgb(212, 207, 197), rgb(180, 174, 163)};
  w.hue_spread = 0.005;
  return w;
}

WoodSpecies ebonised_cherry() {
  WoodSpecies w = cherry();
  w.name = "ebonised cherry";
  w.palette = {rgb(58, 56, 55), rgb(44, 43, 42), rgb(32, 31, 31), rgb(20, 20, 20)};
  w.hue_spread = 0.004;
  return w;
}

}  // namespace

const std::vector<WoodSpecies>& treated_woods() {
  static const std::vector<WoodSpecies> kAll = {weathered_oak(), silver_maple(), bleached_ash(), ebonised_cherry()};
  return kAll;
}

const std::vector<WoodSpecies>& wood_species() {
  static const std::vector<WoodSpecies> kAll = {maple(), oak(),    walnut(),  cherry(),  wenge(),
                                                ash(),   padauk(), zebrano(), rosewood()};
  return kAll;
}

const WoodSpecies* find_species(const std::string& name) {
  for (const WoodSpecies& w : wood_species()) {
    if (w.name == name) return &w;
  }
  for (const WoodSpecies& w : treated_woods()) {
    if (w.name == name) return &w;
  }
  return nullptr;
}

}  // namespace veneer::sim
