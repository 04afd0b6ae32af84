#include "planner/edits/kept_pieces.h"

#include <fmt/format.h>

#include <iterator>
#include <map>
#include <opencv2/imgproc.hpp>
#include <string>

#include "planner/cancelled.h"

namespace veneer::planner {
namespace {

// Blocks the pixels that an allocation covers, so that no index looks there; FreeWood itself knows the exact border.
void block(Raster<PanelFrame>& free, const std::vector<Ring<PanelFrame>>& allocation) {
  std::vector<std::vector<cv::Point>> rings;
  cv::Rect box;
  for (const Ring<PanelFrame>& ring : allocation) {
    std::vector<cv::Point>& corners = rings.emplace_back();
    for (const auto& p : ring) {
      double column = 0, row = 0;
      free.to_pixels(p, column, row);
      corners.emplace_back(cvFloor(column), cvFloor(row));
    }
    box |= cv::boundingRect(corners);
  }
  box &= cv::Rect({0, 0}, free.pixels.size());
  if (box.empty()) return;
  cv::Mat inside(box.size(), CV_8UC1, cv::Scalar(0));
  cv::fillPoly(inside, rings, cv::Scalar(255), cv::LINE_8, 0, -box.tl());
  // Pixels at the border are covered only in part: a neighbour may touch them.
  cv::erode(inside, inside, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  free.pixels(box).setTo(0, inside);
}

class Keeper {
 public:
  Keeper(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options,
         Problem& problem)
      : stock_(stock), options_(options), problem_(problem) {
    for (std::size_t i = 0; i < problem.queue.size(); ++i) {
      const Problem::Task& task = problem.queue[i];
      patches_[mark_of(artworks[task.artwork].letter, problem.artworks[task.artwork].patches[task.patch])] = i;
    }
  }

  Result<KeptPatches> run(const std::stop_token& stop) {
    PatchPlacements placements(problem_.queue.size());
    // First those that must stay.
    for (const bool must : {true, false}) {
      for (const KeptPiece& piece : options_.kept) {
        if (stop.stop_requested()) return cancelled();
        if (piece.must != must) continue;
        const auto patch = patches_.find(piece.mark);
        if (patch == patches_.end() || mark_of_task(patch->second) != piece.marked())
          return Error{
              ErrorCode::kInvalidArgument,
              fmt::format("there is no piece {} to keep: plan the same pictures in the same patches", piece.marked())};
        if (!piece.placement) continue;
        placements[patch->second] = kept(piece, problem_.queue[patch->second].match);
        if (must && !placements[patch->second])
          return Error{
              ErrorCode::kInvalidArgument,
              fmt::format("piece {} cannot be cut there, because that wood is not free: plan it anew", piece.marked())};
      }
    }
    take_wood(placements);
    return split(std::move(placements));
  }

 private:
  std::string mark_of_task(std::size_t i) const {
    const Problem::Task& task = problem_.queue[i];
    return problem_.marks.of(task.artwork, problem_.artworks[task.artwork].patches[task.patch]);
  }

  std::optional<PatchPlacement> kept(const KeptPiece& piece, const MatchPatch& match) {
    const Placement& placement = *piece.placement;
    for (std::size_t p = 0; p < stock_.size(); ++p) {
      if (!(stock_[p].id == placement.panel)) continue;
      FreeWood& wood = problem_.panels[p].wood;
      const Ring<PanelFrame> there = placement.panel_from_artwork * match.outline;
      if (!piece.held && !wood.admits_again(there)) return std::nullopt;
      wood.allocate(there);
      return PatchPlacement{static_cast<int>(p), placement.panel_from_artwork,
                            placement_cost(*match.features, match.grid, match.pixels, problem_.panels[p].features,
                                           placement.panel_from_artwork)};
    }
    return std::nullopt;
  }

  void take_wood(const PatchPlacements& placements) {
    for (std::size_t p = 0; p < problem_.panels.size(); ++p) {
      FreeWood& wood = problem_.panels[p].wood;
      Raster<PanelFrame> free = wood.raster();
      free.pixels = free.pixels.clone();
      std::vector<Ring<PanelFrame>> outlines;
      for (std::size_t i = 0; i < placements.size(); ++i)
        if (placements[i] && placements[i]->panel == static_cast<int>(p))
          outlines.push_back(placements[i]->panel_from_artwork * problem_.queue[i].match.outline);
      const bool some_is_held = !stock_[p].open.pixels.empty();
      if (outlines.empty() && !some_is_held) continue;
      if (some_is_held) cv::bitwise_and(free.pixels, stock_[p].open.pixels, free.pixels);
      for (const Ring<PanelFrame>& outline : outlines) block(free, grown_rings(outline, wood.kerf()));
      wood = FreeWood(free, options_.kerf_and_web(), options_.margin_and_web());
      for (const Ring<PanelFrame>& outline : outlines) wood.allocate(outline);
      wood.settle();
    }
  }

  // Where squares choose their sizes, patches of fixed sizes choose with them, and first.
  void queue_as_squares() {
    std::vector<TaskTree> squares;
    for (Problem::Task& task : problem_.queue) squares.push_back({std::move(task), {}});
    std::move(problem_.squares.begin(), problem_.squares.end(), std::back_inserter(squares));
    problem_.squares = std::move(squares);
    problem_.queue.clear();
  }

  KeptPatches split(PatchPlacements placements) {
    KeptPatches out;
    std::vector<Problem::Task> queue;
    for (std::size_t i = 0; i < placements.size(); ++i) {
      if (!placements[i]) {
        queue.push_back(std::move(problem_.queue[i]));
        continue;
      }
      out.tasks.push_back(std::move(problem_.queue[i]));
      out.placements.push_back(placements[i]);
    }
    problem_.queue = std::move(queue);
    if (!problem_.squares.empty()) queue_as_squares();
    return out;
  }

  std::span<const StockPanel> stock_;
  const PlanOptions& options_;
  Problem& problem_;
  std::map<std::string, std::size_t> patches_;  // places in the queue
};

}  // namespace

Result<KeptPatches> keep_pieces(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                                const PlanOptions& options, Problem& problem, const std::stop_token& stop) {
  if (options.kept.empty()) return KeptPatches{};
  return Keeper(artworks, stock, options, problem).run(stop);
}

}  // namespace veneer::planner
