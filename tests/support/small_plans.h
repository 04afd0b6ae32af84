// Plans that take a moment.
#pragma once

#include <stdexcept>
#include <stop_token>
#include <utility>
#include <vector>

#include "planner/plan.h"

namespace veneer::planner::test {

inline PlanOptions small_options() {
  PlanOptions options;
  options.patch = Millimetres(7), options.dpi = 50.8, options.rotations = 5, options.threads = 1;
  return options;
}

// The same without saliency, which costs more time than all the rest of a small plan.
inline PlanOptions small_options_without_saliency() {
  PlanOptions options = small_options();
  options.priority = Priority::kCentre;
  return options;
}

inline PlanOptions one_rotation_options() {
  PlanOptions options = small_options();
  options.patch = Millimetres(5), options.rotations = 1;
  return options;
}

inline Plan planned(const std::vector<Artwork>& artworks, const std::vector<StockPanel>& stock,
                    const PlanOptions& options, const Progress& progress = {}, std::stop_token stop = {}) {
  const auto plan = make_plan(artworks, stock, options, progress, std::move(stop));
  if (!plan.ok()) throw std::runtime_error(plan.error().message);
  return *plan;
}

inline bool same_place(const Piece& a, const Piece& b) {
  return a.placement && b.placement && a.placement->panel == b.placement->panel &&
         a.panel_outline() == b.panel_outline();
}

}  // namespace veneer::planner::test
