#include "planner/problem/material_shares.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "planner/layout/grid.h"

namespace veneer::planner {
namespace {

// A piece that a person moved: the limits that it is under now, and was before.
struct MovedPiece {
  std::string mark;
  SquareMillimetres area;
  LimitSet now, before;
};

std::vector<MovedPiece> moved_pieces(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                     const Problem& problem, const PlanOptions& options,
                                     const PatchPlacements& patches) {
  std::map<std::string, const Placement*> before;
  for (const KeptPiece& piece : options.kept)
    if (piece.moved_from) before.emplace(piece.mark, &*piece.moved_from);
  std::vector<MovedPiece> out;
  for (std::size_t i = 0; i < patches.size() && !before.empty(); ++i) {
    const Problem::Task& task = problem.queue[i];
    const auto found =
        before.find(mark_of(artworks[task.artwork].letter, problem.artworks[task.artwork].patches[task.patch]));
    if (found == before.end() || !patches[i]) continue;
    const Point<ArtworkFrame> middle = middle_of(task.match.outline);
    const auto under = [&](int panel, const Isometry2<PanelFrame, ArtworkFrame>& map) {
      return problem.limits.at(panel, map * middle);
    };
    MovedPiece& piece = out.emplace_back(MovedPiece{found->first, area_of(task.match.outline), {}, {}});
    piece.now = under(patches[i]->panel, patches[i]->panel_from_artwork);
    const auto panel = std::ranges::find(stock, found->second->panel, &StockPanel::id);
    if (panel != stock.end())
      piece.before = under(static_cast<int>(panel - stock.begin()), found->second->panel_from_artwork);
  }
  // In the order of their marks, whatever the queue's.
  std::ranges::sort(out, {}, &MovedPiece::mark);
  return out;
}

// Why a limit is broken, and what can be done about it.
std::string why_exceeded(const std::vector<MovedPiece>& moved, std::size_t number, const MaterialUse& use) {
  constexpr std::size_t kNamed = 8;
  MaterialUse before = use;
  LimitSet only;
  only.add(number);
  std::vector<std::string> came;
  for (const MovedPiece& piece : moved) {
    if (piece.now.has(number) && !piece.before.has(number)) came.push_back(piece.mark), before.remove(only, piece.area);
    if (!piece.now.has(number) && piece.before.has(number)) before.add(only, piece.area);
  }
  const char* verb = came.size() == 1 ? "was" : "were";
  const std::size_t more = came.size() > kNamed ? came.size() - kNamed : 0;
  came.resize(came.size() - more);
  const std::string names = fmt::format("{}{} {} moved to it", fmt::join(came, ", "),
                                        more > 0 ? fmt::format(" and {} more", more) : "", verb);
  if (came.empty()) return "pieces that stay are of it: let go of some of them";
  if (before.is_exceeded(number)) return "pieces that stay are of it, and " + names + ": let go of some of them";
  return fmt::format("{}: move {} to other wood", names, came.size() == 1 ? "it" : "them");
}

}  // namespace

void note_material_shares(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const Problem& problem,
                          const PlanOptions& options, const PatchPlacements& patches, LimitSet refused, Plan& plan) {
  if (problem.limits.empty()) return;
  MaterialUse use(problem.limits);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!patches[i]) continue;
    const Ring<ArtworkFrame>& outline = problem.queue[i].match.outline;
    use.add(problem.limits.at(patches[i]->panel, patches[i]->panel_from_artwork * middle_of(outline)),
            area_of(outline));
  }
  const std::vector<MovedPiece> moved = moved_pieces(artworks, stock, problem, options, patches);
  const bool is_missing = plan.shortage && plan.shortage->behind_limits > 0;
  for (std::size_t i = 0; i < problem.limits.size(); ++i) {
    const MaterialLimit& limit = problem.limits.limit(i);
    const double share = use.used(i) / problem.limits.whole();
    plan.material_shares.push_back({limit, share, refused.has(i)});
    if (use.is_exceeded(i)) {
      plan.warnings.push_back(
          fmt::format("{} is {:.1f} % of the pictures, more than it may be ({:g} %), because {}, or raise its limit "
                      "(--material-limit)",
                      limit.material, 100 * share, 100 * limit.share, why_exceeded(moved, i, use)));
    } else if (refused.has(i)) {
      plan.warnings.push_back(fmt::format(
          "{} is {:.1f} % of the pictures, as much as it may be ({:g} %): {}", limit.material, 100 * share,
          100 * limit.share,
          is_missing ? fmt::format("raise its limit (--material-limit), since {} pieces have no wood", unfilled(plan))
                     : "other wood stands where more of it would have been chosen"));
    }
  }
}

}  // namespace veneer::planner
