#include "daemon/orders/plan_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "base/clock.h"
#include "daemon/orders/artwork_file.h"
#include "daemon/orders/artwork_guides.h"
#include "daemon/orders/records_json.h"
#include "daemon/orders/stored_picture.h"
#include "daemon/orders/wood_options.h"
#include "daemon/orders/wood_recipes.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/cutting/lead_choice.h"
#include "planner/cutting/marks.h"
#include "planner/cutting/omissions.h"
#include "planner/files/plan_files.h"
#include "planner/files/preview.h"
#include "planner/parallel.h"
#include "planner/problem/shortage.h"
#include "planner/suggest/fitting_size.h"

namespace veneer::daemon {
namespace {

std::vector<db::PlannedPatch> pieces_of(const planner::Plan& plan) {
  std::vector<db::PlannedPatch> out;
  for (const auto& piece : plan.pieces) {
    db::PlannedPatch& p = out.emplace_back();
    p.mark = piece.mark;
    p.artwork_outline = piece.artwork_outline;
    if (!piece.placement) continue;
    p.panel = piece.placement->panel;
    p.panel_outline = piece.panel_outline();
    p.panel_from_artwork = piece.placement->panel_from_artwork;
    p.allocation = offset(Region<PanelFrame>(piece.panel_outline()), plan.kerf);
  }
  return out;
}

const HeldPanel& held(const MakePlan& order, const PanelId& id) {
  return *std::find_if(order.wood.panels.begin(), order.wood.panels.end(),
                       [&](const HeldPanel& panel) { return panel.id == id; });
}

// Books a lead-in for every piece that has waste beside it; how many have none.
Result<std::size_t> add_leads(const MakePlan& order, Millimetres kerf, const std::vector<planner::StockPanel>& stock,
                              std::vector<db::PlannedPatch>& pieces) {
  const planner::ToolpathOptions options = toolpath_options(order.recipe);
  std::size_t without = 0;
  for (const auto& panel : stock) {
    if (options.leads.length.count() <= 0) break;
    const HeldPanel& of = held(order, panel.id);
    const planner::LeadRoom room{panel.open.pixels.empty() ? panel.free : panel.open, of.spared, kerf};
    const WoodRecipes recipes(order.recipe, order.kerf, order.recipes, of.zones);
    std::vector<db::PlannedPatch*> on_panel;
    std::vector<planner::LeadPiece> to_lead;
    for (auto& piece : pieces) {
      if (piece.panel != panel.id) continue;
      on_panel.push_back(&piece);
      to_lead.push_back({piece.panel_outline, piece.mark, piece.panel_from_artwork.angle() + Radians(kPi / 2),
                         recipes.recipe_of(recipes.material_at(piece.panel_outline)), piece.allocation});
    }
    const auto leads = planner::choose_leads(to_lead, room, options);
    if (!leads) return leads.error();
    for (std::size_t i = 0; i < on_panel.size(); ++i) {
      if (const auto& lead = (*leads)[i]) {
        on_panel[i]->lead_in = lead->way.begin;
        on_panel[i]->allocation = unite(on_panel[i]->allocation, lead->burnt);
      } else {
        ++without;
      }
    }
  }
  return without;
}

Result<std::optional<planner::Plan>> earlier_of(const MakePlan& order) {
  if (order.earlier.empty()) return std::optional<planner::Plan>();
  auto read = planner::read_plan(order.earlier);
  if (!read) return read.error();
  return std::optional(std::move(*read));
}

Result<planner::PlanOptions> options_of(const MakePlan& order, const std::optional<planner::Plan>& earlier,
                                        const std::vector<planner::StockPanel>& stock) {
  auto named = wood_options(order.options, order.wood, stock, order.kerf, order.recipes);
  if (!named) return named.error();
  planner::PlanOptions options = std::move(*named);
  options.threads = order.threads;
  options.index_cache = order.wood.index_dir;
  if (!earlier) return options;
  if (const Status kept = planner::keep_edited(*earlier, order.edits, options); !kept) return kept.error();
  if (!options.kept_layouts.empty()) options.web = planner::kPieceWeb;
  return options;
}

// Which pieces the cell would cut without their marks: whoever plans can still choose larger patches.
void tell_marks_without_room(const MakePlan& order, planner::Plan& plan) {
  const planner::MarkOptions marks = toolpath_options(order.recipe).marks;
  std::vector<char> fits(plan.pieces.size());
  static_cast<void>(planner::run_parallel(fits.size(), planner::threads_meant(order.threads), {}, [&](std::size_t i) {
    fits[i] = planner::has_room_for_mark(plan.pieces[i].mark, plan.pieces[i].artwork_outline, marks) ? 1 : 0;
  }));
  planner::Omissions omissions;
  for (std::size_t i = 0; i < fits.size(); ++i)
    if (fits[i] == 0) omissions.marks.push_back(plan.pieces[i].mark);
  for (std::string& sentence : planner::sentences_of(omissions, marks.min_height))
    plan.warnings.push_back(std::move(sentence));
}

// The pieces that are made again, and what the picture costs with them. What stays costs what it cost when it was
// planned, so that the difference is theirs alone.
void report_redone(const planner::Plan& before, const planner::Plan& plan, const std::vector<std::string>& marks,
                   PlanMade& made) {
  const std::set<std::string> redone(marks.begin(), marks.end());
  std::map<std::string, const planner::Piece*> earlier;
  for (const planner::Piece& piece : before.pieces) earlier[piece.mark] = &piece;
  double cost = 0;
  std::int64_t pixels = 0;
  for (const planner::Piece& piece : plan.pieces) {
    if (!piece.placement || piece.pixels == 0) continue;
    const planner::Piece& was = *earlier.at(piece.mark);
    const bool again = redone.contains(piece.mark);
    cost += again ? piece.cost : was.cost;
    pixels += piece.pixels;
    if (!again) continue;
    RedonePiece& of =
        made.redone.emplace_back(RedonePiece{piece.mark, {}, piece.cost / static_cast<double>(piece.pixels)});
    if (was.placement && was.pixels > 0) of.cost_before = was.cost / static_cast<double>(was.pixels);
  }
  made.cost_before = planner::cost_per_pixel(before);
  made.cost_per_pixel = pixels > 0 ? cost / static_cast<double>(pixels) : 0;
}

// With the recipe and machine of cut files, as sketches and advice estimate it. A plan is good without.
double cutting_seconds(const planner::Plan& plan) {
  std::chrono::duration<double> all{0};
  for (const planner::PlanPanel& panel : plan.panels) {
    const auto estimate = planner::quick_estimate(plan, panel);
    if (!estimate) return 0;
    all += *estimate;
  }
  return all.count();
}

// Of a square in any turn; a grid's patches are about square.
bool is_larger_than_every_panel(const planner::Artwork& artwork, const std::vector<planner::StockPanel>& stock,
                                const planner::PlanOptions& options) {
  const auto grid = planner::grid_size(artwork.width, artwork.height, options.patch);
  const Millimetres side = std::min(artwork.width / grid.columns, artwork.height / grid.rows);
  return std::ranges::none_of(stock, [&](const planner::StockPanel& panel) {
    return side <= std::min(panel.picture.width(), panel.picture.height());
  });
}

// Not of a plan that keeps some of an earlier one, which has its size and patches from there.
Result<planner::FoundSizes> sizes_that_fit(const MakePlan& order, const planner::Artwork& artwork,
                                           const std::vector<planner::StockPanel>& stock,
                                           const planner::PlanOptions& options, Duration planned,
                                           const TaskProgress& progress) {
  constexpr std::chrono::minutes kLongest(3);
  const SteadyClock clock;
  planner::FittingLimits limits;
  limits.time = std::max(limits.time, std::min<Duration>(planned, kLongest));
  if (order.limit_s > 0) {  // the answer, and reading the wood, take their time as well
    const auto left = std::chrono::duration<double>(order.limit_s) / 2 - planned;
    limits.time = std::min(limits.time, std::chrono::duration_cast<Duration>(left));
  }
  return planner::fitting_sizes(artwork, stock, options, limits, clock,
                                [&](double f, std::string_view text) { progress(0.88 + 0.1 * f, std::string(text)); });
}

// For a smaller picture other panels may be chosen than those on which its sizes were tried.
bool size_chooses_panels(const JobWood& wood) {
  return (wood.max_panels && *wood.max_panels < wood.panels.size()) || wood.remnants_first.value_or(false);
}

std::string remedy_of(const JobWood& wood, const std::vector<planner::FittingSize>& sizes) {
  return size_chooses_panels(wood)
             ? fmt::format("try it {}, for which other panels may be chosen", planner::words_of(sizes))
             : fmt::format("it fits {}, which was tried", planner::words_of(sizes));
}

// What is missing is told whatever comes of the search for something that fits.
Error refusal_of(const JobWood& wood, const planner::Shortage& shortage, std::size_t pieces,
                 const Result<planner::FoundSizes>& fitting) {
  const auto refused = [](const std::string& why) { return Error{ErrorCode::kRefused, "nothing is reserved: " + why}; };
  if (!fitting || fitting->tried == 0) return refused(planner::sentence_of(shortage, pieces));
  const std::string missing = planner::what_is_missing(shortage, pieces);
  if (fitting->sizes.empty())
    return refused(missing +
                   "; no smaller size or patches were found in which it fits, so add a panel, or see what "
                   "veneerctl job advise says");
  return refused(fmt::format("{}: {}; or add a panel", missing, remedy_of(wood, fitting->sizes)));
}

}  // namespace

Result<PlanMade> make_plan(const MakePlan& order, const std::filesystem::path& folder, const TaskProgress& progress) {
  auto read = read_artwork({order.picture, order.segmentation}, order.name, order.crop, order.size);
  if (!read) return read.error();
  planner::Artwork artwork = std::move(*read);
  if (const Status guided = guide(order, artwork); !guided) return guided.error();
  progress(0.02, "reading the stock");
  const auto stock = load_job_wood(order.wood, artwork.width * artwork.height);
  if (!stock) return stock.error();
  const auto earlier = earlier_of(order);
  if (!earlier) return earlier.error();
  const auto options = options_of(order, *earlier, *stock);
  if (!options) return options.error();

  const SteadyClock clock;
  const TimePoint begun = clock.now();
  auto plan = planner::make_plan({&artwork, 1}, *stock, *options, [&](double f, std::string_view text) {
    progress(0.05 + 0.83 * f, std::string(text));
  });
  const Duration planned = clock.now() - begun;
  if (!plan) {
    if (*earlier || plan.error().code != ErrorCode::kInvalidArgument ||
        !is_larger_than_every_panel(artwork, *stock, *options))
      return plan.error();
    const auto fitting = sizes_that_fit(order, artwork, *stock, *options, planned, progress);
    if (!fitting || fitting->sizes.empty()) return plan.error();
    return Error{plan.error().code, fmt::format("{}; {}", plan.error().message, remedy_of(order.wood, fitting->sizes))};
  }
  if (plan->shortage) {
    if (*earlier)
      return Error{ErrorCode::kRefused,
                   "nothing is reserved: " + planner::sentence_of(*plan->shortage, plan->pieces.size())};
    return refusal_of(order.wood, *plan->shortage, plan->pieces.size(),
                      sizes_that_fit(order, artwork, *stock, *options, planned, progress));
  }

  tell_marks_without_room(order, *plan);
  progress(0.9, "drawing the preview");
  const auto preview = planner::assemble_preview(*plan, 0, *stock, ScanResolution::from_dpi(order.preview_dpi));
  if (!preview) return preview.error();
  if (const Status written = write_stored_picture(preview->pixels, folder / kMadePreview); !written)
    return written.error();
  std::vector<db::PlannedPatch> pieces = pieces_of(*plan);
  const std::vector<std::string>& again = order.edits.replanned;
  if (order.edits.held)
    std::erase_if(pieces, [&](const auto& p) { return std::find(again.begin(), again.end(), p.mark) == again.end(); });
  const auto without_lead = add_leads(order, plan->kerf, *stock, pieces);
  if (!without_lead) return without_lead.error();
  if (const Status written = planner::write_text(nlohmann::json(pieces).dump(), folder / kMadePieces); !written)
    return written.error();
  if (const Status written = planner::write_plan(*plan, folder / kMadePlan); !written) return written.error();
  PlanMade made{plan->kerf,
                options->web,
                planner::cost_per_pixel(*plan),
                *without_lead,
                plan->warnings,
                plan->global,
                plan->fine,
                plan->refined,
                {},
                0,
                cutting_seconds(*plan)};
  if (order.edits.held) report_redone(**earlier, *plan, again, made);
  return made;
}

}  // namespace veneer::daemon
