#include "planner/problem/material_shares.h"

#include <algorithm>
#include <map>
#include <optional>
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

// Those that are in the plan, in the order of its pieces.
std::vector<MovedPiece> moved_pieces(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                     const Problem& problem, const PlanOptions& options, const PatchPlacements& patches,
                                     const Plan& plan) {
  std::map<std::string, const KeptPiece*> asked;
  for (const KeptPiece& piece : options.kept)
    if (piece.moved) asked.emplace(piece.mark, &piece);
  if (asked.empty()) return {};
  std::map<std::string, MovedPiece> found;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Problem::Task& task = problem.queue[i];
    const auto piece =
        asked.find(mark_of(artworks[task.artwork].letter, problem.artworks[task.artwork].patches[task.patch]));
    if (piece == asked.end() || !patches[i]) continue;
    const Ring<ArtworkFrame>& outline = task.match.outline;
    const std::string& mark = piece->second->marked();
    MovedPiece& moved = found.emplace(mark, MovedPiece{mark, area_of(outline), {}, {}}).first->second;
    moved.now = problem.limits.of(outline, patches[i]->panel, patches[i]->panel_from_artwork);
    const std::optional<Placement>& from = piece->second->moved_from;
    if (!from) continue;
    const auto panel = std::ranges::find(stock, from->panel, &StockPanel::id);
    if (panel != stock.end())
      moved.before = problem.limits.of(outline, static_cast<int>(panel - stock.begin()), from->panel_from_artwork);
  }
  std::vector<MovedPiece> out;
  for (const Piece& piece : plan.pieces)
    if (const auto moved = found.find(piece.mark); moved != found.end()) out.push_back(moved->second);
  return out;
}

// Why a limit is broken, and what can be done about it but raising the limit.
std::string why_exceeded(const std::vector<MovedPiece>& moved, std::size_t number, const std::string& material,
                         const MaterialUse& use) {
  constexpr std::size_t kNamed = 8;
  MaterialUse before = use;
  LimitSet only;
  only.add(number);
  std::vector<std::string> came;
  for (const MovedPiece& piece : moved) {
    if (piece.now.has(number) && !piece.before.has(number)) came.push_back(piece.mark), before.remove(only, piece.area);
    if (!piece.now.has(number) && piece.before.has(number)) before.add(only, piece.area);
  }
  if (came.empty()) return fmt::format("pieces of {} stay: plan some of them anew", material);
  const bool is_one = came.size() == 1;
  const std::size_t more = came.size() - std::min(came.size(), kNamed);
  came.resize(came.size() - more);
  const std::string names = fmt::format("{}{} {} moved", fmt::join(came, ", "),
                                        more > 0 ? fmt::format(" and {} more", more) : "", is_one ? "was" : "were");
  if (before.is_exceeded(number))
    return fmt::format("pieces of {} stay, and {} to it as well: plan some of these anew", material, names);
  return fmt::format("{} to such wood: give {} other wood", names, is_one ? came.front() : "some of them");
}

}  // namespace

void note_material_shares(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const Problem& problem,
                          const PlanOptions& options, const PatchPlacements& patches, LimitSet refused, Plan& plan) {
  if (problem.limits.empty()) return;
  MaterialUse use(problem.limits);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!patches[i]) continue;
    const Ring<ArtworkFrame>& outline = problem.queue[i].match.outline;
    use.add(problem.limits.of(outline, patches[i]->panel, patches[i]->panel_from_artwork), area_of(outline));
  }
  const std::vector<MovedPiece> moved = moved_pieces(artworks, stock, problem, options, patches, plan);
  const bool is_missing = plan.shortage && plan.shortage->behind_limits > 0;
  for (std::size_t i = 0; i < problem.limits.size(); ++i) {
    const MaterialLimit& limit = problem.limits.limit(i);
    const double share = use.used(i) / problem.limits.whole();
    plan.material_shares.push_back({limit, share, refused.has(i)});
    if (use.is_exceeded(i)) {
      plan.warnings.push_back(fmt::format(
          "{0} is {1:.1f} % of the pictures, more than it may be ({2:g} %), because {3}, or raise the limit "
          "of {0} (--material-limit)",
          limit.material, 100 * share, 100 * limit.share, why_exceeded(moved, i, limit.material, use)));
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
