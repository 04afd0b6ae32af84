// Planning: which piece of which panel rebuilds which patch of which artwork (paper, sections 3.2 and 3.3).
//
// make_plan is a pure function of its arguments: equal artworks, stock and options give equal plans, bit for bit, with
// any number of threads. Re-entrant. Symbols of the paper: I_T = Artwork::picture, I_S = StockPanel::picture,
// w_intens, w_edge, w_hist, n_rot = the options of like name; D (equation 4) = Piece::cost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "base/raster.h"
#include "base/result.h"
#include "planner/layout/layout_guides.h"
#include "planner/layout/partition.h"
#include "planner/stock.h"

namespace veneer::planner {

// A picture to rebuild in wood.
struct Artwork {
  std::string name;           // for people: usually the file's name
  std::string letter;         // "A", "B", ... unique within a plan; marks that tell places begin with it
  cv::Mat picture;            // CV_8UC3, BGR, upright, decoded (pictures.h)
  Millimetres width, height;  // of the finished artwork; the picture is stretched to it, so keep its aspect
  // CV_8UC1 of any size, stretched over the artwork: white = as important as can be, black = not at all. It multiplies
  // saliency and weighs costs where patches compete. Empty: all alike.
  cv::Mat importance{};
  // CV_8UC3 of any size, stretched over the artwork: areas of one colour are the patches of LayoutKind::kSegmentation.
  // Empty: there are none.
  cv::Mat segmentation{};
  // What a person says about LayoutKind::kMorph or kMosaic; in the other layouts it must be empty.
  LayoutGuides guides{};
  // Of LayoutKind::kMosaic: make its tiles with joints too (Plan::tilings). They change no piece.
  bool tiles_with_joints = false;
};

// The size that gives `picture` the shorter side `shorter`.
struct ArtworkSize {
  Millimetres width, height;
};
ArtworkSize artwork_size(const cv::Mat& picture, Millimetres shorter);
// "A", "B", ... "Z", "AA", ...: the letter of the artwork with this index.
std::string artwork_letter(std::size_t index);

// What pieces are marked with: kPlace, where they belong; kShort, as few signs as name them all (layout/piece_marks.h).
enum class MarkKind { kPlace, kShort };

enum class Priority { kSaliency, kCentre };
// kGlobal: greedy first, then all patches choose together (global_plan.h).
enum class Optimize { kGreedy, kGlobal };

// How an artwork is cut into patches: kGrid, into squares; kMorph, into the rows and columns of a grid whose lines
// follow the edges of the picture (morph/morphed_grid.h); kMosaic, into cells that follow them (layout/mosaic.h);
// kSegmentation, as Artwork::segmentation says.
enum class LayoutKind { kGrid, kMorph, kMosaic, kSegmentation };

// kDp: borders are cut by dynamic programming once wood is chosen (boundaries/refinement.h).
enum class Refine { kNone, kDp };
// Where curved borders' segments meet, and at crossings: kG0, they may turn; kG1, they go on in the same direction.
enum class Curves { kG0, kG1 };

// Where a piece's wood really comes from.
struct Placement {
  PanelId panel;
  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork;  // its pose: proper, show face to show face
};

// A piece of an earlier plan. Its patch stays as it is, and so does its wood where `placement` says so.
struct KeptPiece {
  std::string mark;                    // that tells its place, whatever it is marked with
  int cells = 1;                       // side in cells of the grid (Piece::cells)
  std::optional<Placement> placement;  // none: wood is looked for anew
  bool must = false;                   // an error when it cannot stay there; otherwise it is planned anew
  bool held = false;                   // its wood is taken for it already, or cut: it stays there, free or not
  Ring<ArtworkFrame> outline{};        // of a curved piece; empty: its layout's
  // Of a piece that a person moved, and where it was, if it had wood: this changes no choice, but is told where a limit
  // of wood is broken.
  bool moved = false;
  std::optional<Placement> moved_from{};
  std::string short_mark{};  // which its plan gave it, and which it keeps; empty: `mark`

  const std::string& marked() const { return short_mark.empty() ? mark : short_mark; }
};

// No more of the pictures' area is of this wood.
struct MaterialLimit {
  std::string material;
  double share = 1;  // in [0, 1]
  friend bool operator==(const MaterialLimit&, const MaterialLimit&) = default;
};

// The layout of an earlier plan's artwork; faces in the order of its pieces.
struct KeptLayout {
  std::string letter;  // of the artwork
  Partition layout;
  bool is_free = false;  // its patches have no rows and columns
};

// What a stop request makes of a plan. kCancel: none, but kCancelled. kBestSoFar, once every patch has chosen in turn,
// and a run that goes on from a journal is where the earlier one was: the best that is whole by then (Plan::stopped);
// warnings name what was not done to the end.
enum class OnStop { kCancel, kBestSoFar };

// Defaults are the paper's Table 1.
struct PlanOptions {
  LayoutKind layout = LayoutKind::kGrid;
  // With kMorph, else of no effect: cells are cut in two along a diagonal where an edge of the picture runs
  // (morph/split_cells.h). Pieces then have no rows and columns.
  bool triangles = false;
  // With kMosaic, else of no effect: how many times as long as wide a cell is, along the picture's edges; in [1, 4].
  // Its area stays that of a patch.
  double cell_aspect = 1;
  bool flow_lines_only = false;  // cells heed LayoutGuides::flow_lines instead of the picture's edges, not beside them
  Millimetres patch{14};         // wished side of a patch; the grid has max(1, round(side / patch)) patches per axis
  int rotations = 15;            // n_rot: turns by k * 360 / n_rot degrees
  double w_intensity = 0.5, w_edge = 0.5, w_hist = 0.5;  // in [0, 1]
  // Further channels of the filter bank (features.h), in [0, 1]; not all of the channels' weights are 0.
  double w_colour = 0, w_texture = 0;
  // Before tones are mapped: how far they are stretched over the wood's whole range, and how much what is a patch or
  // two wide is set off from what surrounds it (tone_mapping.h); in [0, 1].
  double w_range = 0, w_detail = 0;
  // How far the picture's colours are mapped to the wood's (wood_colours.h), in [0, 1]; of use with w_colour.
  double w_gamut = 0;
  // With Optimize::kGlobal: how much places count whose grain runs along the picture (grain/grain_pull.h), in [0, 1].
  double w_grain = 0;
  Millimetres edge{0};     // pictures are smoothed by this (standard deviation) before edges are taken; 0: not at all
  double dpi = 300;        // working resolution: panels and artworks are resampled to it
  Millimetres kerf{0.15};  // k, the full width burnt away: outlines keep 2k from each other, k from wood that is gone
  Millimetres position_margin{0};  // kept from wood that is not free, on top of the kerf (across runs: 0.2 mm)
  // What of the wood stays standing around each piece's kerf, between two pieces as towards wood that is not free: it
  // holds the skeleton together, so that nothing but pieces falls out (docs/KERF.md). 0: kerfs may touch.
  Millimetres web{0};
  // n_adaptive and w_adaptive: a patch may have 2^levels times the wished side, and stays that large where its cost per
  // pixel is at most `factor` times that of four smaller ones.
  int adaptive_levels = 0;
  double adaptive_factor = 1.2;
  Priority priority = Priority::kSaliency;
  bool interleave = false;  // one queue for the patches of all artworks; otherwise artwork after artwork
  // Without interleaving: this share of every artwork's patches, the most urgent, choose before all others, so that the
  // first artworks' backgrounds do not use up the rare wood that the last ones' faces need.
  double reserve = 0;
  // Patches that choose in turn have a wood until it is used up to its share, and those that choose together keep to it
  // too. Each wood once; with adaptive levels or refined borders none. Kept pieces count, alternatives do not.
  std::vector<MaterialLimit> material_limits{};
  bool exact = false;  // choose the cheapest place by proof, several times slower
  // Without `exact`: how long the lists of places are that are looked at, as a share of the usual; in (0, 1]. Shorter
  // ones are quicker and miss more: for sketches.
  double thoroughness = 1;
  // How many pixels wide a patch is where a layout that follows the picture is made, as a share of the usual; in (0,
  // 1]. With fewer it is made sooner and comes out rougher: for sketches.
  double layout_fineness = 1;
  // At last turn and shift each new piece continuously (fine_rotation.h): rotations are then no multiples of
  // 360 / n_rot degrees any more. Kept pieces stay as they are.
  bool fine_rotation = false;
  Refine refine = Refine::kNone;
  Curves curves = Curves::kG0;
  Millimetres overlap{0};      // how far refined pieces grow over their borders; 0: three eighths of a patch
  Millimetres min_width{1.5};  // of any part of a piece that is no plain square (fabrication.h)
  // Pieces are as large as a square of this side (the paper: below 5 mm they get lost). Layouts keep to it where
  // patches are larger (problem/free_layout.h); smaller pieces that are asked for all the same are named. 0: nobody
  // asks.
  Millimetres min_size{0};
  int rematch = 0;  // how often at most wood is chosen again for refined shapes, which are then cut again
  Optimize optimize = Optimize::kGreedy;
  // Optimize::kGlobal stops early after so many seconds (0: never) or iterations (0: when done); the plan of a run that
  // the clock stopped is repeated by the iterations that it reports.
  double optimize_seconds = 0;
  std::uint64_t optimize_iterations = 0;
  // A directory in which indexes of panels are kept from plan to plan (index_cache.h): some half a gigabyte for every
  // square metre of wood at 300 dpi and size of patches. Empty: none. Plans do not depend on it.
  std::string index_cache{};
  // All pieces that an earlier plan has of some of these artworks, in the same grid; with adaptive levels their sizes
  // are those of that plan. Empty: nothing is kept.
  std::vector<KeptPiece> kept{};
  std::vector<KeptLayout> kept_layouts{};  // of kept pieces that are curved
  std::size_t alternatives = 0;            // listed for each piece, at most
  MarkKind marks = MarkKind::kPlace;
  std::uint64_t seed = 1;
  int threads = 0;  // 0: as many as the machine has

  // What FreeWood is to know of the web: half of it is each piece's, the other half its neighbour's or the margin's.
  Millimetres kerf_and_web() const { return kerf + web / 2; }
  Millimetres margin_and_web() const { return position_margin + web / 2; }
};

// Where else a piece could be cut from, of wood that the plan leaves free.
struct Alternative {
  Placement placement;
  double cost = 0;
};

struct Piece {
  // "A3-12": letter, row, column, both counted from 1 at the upper left; "A312": letter, place in reading order, where
  // a layout has no rows; or with MarkKind::kShort a short mark, "7K". Unique within the plan.
  std::string mark;
  std::size_t artwork = 0;
  static constexpr int kNoRow = -1;
  int row = 0, column = 0;  // from 0 at the upper left; of its upper left cell when it has several; or kNoRow
  int cells = 1;            // side in cells of the grid; more than 1 only with adaptive levels
  Ring<ArtworkFrame> artwork_outline;  // counter-clockwise
  std::optional<Placement> placement;  // none: no wood was left for it
  double cost = 0;                     // docs/FILES.md; measured on what is placed; 0 when unfilled
  std::int64_t pixels = 0;             // at the working resolution, centres inside the outline
  // The cheapest first, no two alike (matcher.h); each can be taken as long as no other piece moves.
  std::vector<Alternative> alternatives{};

  // The outline on its panel, without kerf: the same vertices in the same order. Only for a piece that has wood.
  Ring<PanelFrame> panel_outline() const { return placement->panel_from_artwork * artwork_outline; }
};

struct PlanArtwork {
  std::string name, letter;
  Millimetres width, height;
};

struct PlanPanel {
  PanelId id;
  Millimetres width, height;
  double dpi = 0;  // of the panel's picture
};

// Wall-clock seconds of the parts of make_plan; not part of what a plan is.
struct PlanSeconds {
  double features = 0, match = 0, refine = 0;
};

// What was missing when wood ran out.
struct Shortage {
  std::size_t unfilled = 0;                    // patches without wood
  SquareMillimetres area{};                    // of them together
  std::array<SquareMillimetres, 8> missing{};  // the tones they look for (after gamut mapping), from dark to pale
  // Free wood that no patch of the plan's sizes can use, without wood that limits close; none: not known.
  std::optional<SquareMillimetres> left;
  std::size_t behind_limits = 0;  // at least so many patches would fit in wood that limits close
  bool limited = false;           // limits refused wood to patches
  struct Smaller {
    Millimetres side;
    std::size_t count = 0;  // at least so many squares of that side still fit
  };
  // The largest smaller patch of which enough fit for the area; if there is none, the smallest that was tried.
  std::optional<Smaller> smaller;
};

// A tile of a mosaic with joints (layout/disjoint_tiles.h).
struct MosaicTile {
  Point<ArtworkFrame> middle;
  Radians angle;  // of its length, from +x towards +y
  Millimetres length, width;
};
// Those of an artwork.
struct MosaicTiling {
  std::size_t artwork = 0;
  std::vector<MosaicTile> tiles;
};

// A mosaic's tiles with joints between them: how they come out (layout/disjoint_tiles.h); over all artworks the least
// coverage, of the other figures the largest.
struct TilesReport {
  double coverage = 1, overlap = 0, deviation_deg = 0, straddling = 0;
};

// How the cells of a mosaic came out, over all artworks that are cut into one.
struct MosaicReport {
  std::size_t tiles = 0;          // that were wished for
  int iterations = 0;             // of Lloyd's method, the most of an artwork
  double mean_move_px = 0;        // in the last of them, the farthest
  double deviation_deg = 0;       // how far the direction field turns within tiles, the worst median
  double cell_deviation_deg = 0;  // between the sides of cells and the direction field, the worst median
  double straddling = 0;          // share of the tiles that an edge of the picture runs through, the largest
  // Cells that cannot follow the direction field, because it turns too fast for them (layout/mosaic.h,
  // turning_cells()).
  struct Turning {
    std::size_t artwork = 0;
    std::string where;  // which ninth of the picture, as it follows "at the": "upper left", "middle"
    std::size_t cells = 0;
  };
  std::vector<Turning> turning{};            // by artworks, and in each where most are first
  std::optional<TilesReport> with_joints{};  // where Artwork::tiles_with_joints asks for them
  double seconds = 0;                        // not part of what a plan is
};

// What became of areas that somebody drew, over all artworks that have some.
struct SegmentationReport {
  // An area that is no piece: too small or too thin to be one, it went to its neighbours.
  struct Merged {
    std::size_t artwork = 0;
    Point<ArtworkFrame> at;  // within it
    SquareMillimetres area{};
  };
  std::size_t areas = 0;       // that hang together
  std::vector<Merged> merged;  // the largest first
};

// How morphed grids came out, over all artworks.
struct MorphReport {
  Millimetres mean_move{0}, most_move{0};    // of a grid's vertices from the straight grid's; the largest mean
  double edges_before = 0, edges_after = 0;  // share of the picture's edges within a pixel of a border; the least after
  std::size_t relaxed = 0;                   // cells that were drawn back towards the grid, to be fabricable
  std::size_t split = 0;                     // cells that are two triangles
  double seconds = 0;                        // not part of what a plan is
};

// What `Optimize::kGlobal` gained over the greedy plan it started from.
struct GlobalReport {
  double greedy_cost = 0, cost = 0;  // with the grain's, weighed by importance where these count
  std::size_t greedy_unfilled = 0, unfilled = 0;
  std::uint64_t iterations = 0, budget = 0;  // made, and those of a whole run
  bool stopped = false;                      // before the whole run: the best so far
  double seconds = 0;                        // on top of greedy's; not part of what a plan is
};

// What became of a limit on a wood.
struct MaterialShare {
  MaterialLimit limit;
  double share = 0;    // of the pictures' area, that pieces of this wood have
  bool binds = false;  // a patch was refused wood of it for the limit's sake, and has other wood or none
};

// What `PlanOptions::fine_rotation` gained, over all pieces that are not kept.
struct FineReport {
  double cost_before = 0, cost = 0;
  std::size_t moved = 0;  // pieces
  bool stopped = false;   // before all were turned: the others lie where they lay
};

// What `PlanOptions::refine` gained.
struct RefineReport {
  double cost_before = 0;   // with straight borders
  double cost_refined = 0;  // with refined ones, on the same wood
  double cost = 0;          // in the end
  struct Round {
    double cost = 0;
    std::size_t moved = 0;  // pieces that took other wood
  };
  std::vector<Round> rounds;  // of choosing wood again
  bool stopped = false;       // before all was done: as it was after the last step
  // How far borders lie beside the pixels' cheapest cut, along lines that are cut so, measured straight across them:
  // they are smoothed for curves' sake, and drawn back where a piece could not be made.
  struct PixelCut {
    Millimetres mean{0}, most{0};
  };
  std::optional<PixelCut> pixel_cut;  // none: borders are no lines (boundaries/edge_cuts.h), or none was moved
  std::size_t segments = 0;           // cubic curves of all borders between pieces
  Millimetres length{0};              // of these borders
  double seconds = 0;                 // not part of what a plan is
};

// A piece that is planned as it was asked for, but can hardly be cut or handled.
struct UnfitPiece {
  std::string mark;
  std::string why;  // as it follows the mark: "is too small to be handled"
};

// Pieces in reading order: artwork by artwork, row by row.
struct Plan {
  std::vector<PlanArtwork> artworks;
  std::vector<PlanPanel> panels;
  std::vector<Piece> pieces;
  double dpi = 0;
  Millimetres kerf;
  // Of each artwork, with a face for each of its pieces, in their order. Empty: all are grids with straight borders.
  std::vector<Partition> layouts;
  // Not part of what a plan is, and not in its file:
  PlanSeconds seconds;
  std::vector<cv::Mat> targets;  // weighted features that each artwork looks for (features.h), as make_plan saw them
  std::optional<Shortage> shortage;
  std::optional<MosaicReport> mosaic;
  std::vector<MosaicTiling> tilings;  // of mosaics whose tiles are to be made
  std::optional<SegmentationReport> segmentation;
  std::optional<MorphReport> morph;
  std::vector<MaterialShare> material_shares;  // in the order of PlanOptions::material_limits
  std::optional<GlobalReport> global;
  std::optional<FineReport> fine;
  std::optional<RefineReport> refined;
  std::vector<UnfitPiece> unfit;      // in the order of the pieces
  std::vector<std::string> warnings;  // one sentence each
  bool stopped = false;               // by a stop request, before all was done (OnStop::kBestSoFar)
};

double cost_total(const Plan& plan);
// Over the pixels of filled pieces; 0 when there are none.
double cost_per_pixel(const Plan& plan);
std::size_t unfilled(const Plan& plan);

// Called on the thread that called make_plan, whenever something else begins and otherwise at most some ten times a
// second. `text` is one short phrase.
using Progress = std::function<void(double fraction, std::string_view text)>;

class PlanJournal;  // plan_journal.h
class SharedWork;   // shared_work.h

// Greedy (section 3.3): patches in order of priority, each on the best free place over all panels, positions (1 pixel
// apart at the working resolution) and rotations; no wood twice. With `exact` the best place is what an exhaustive
// search would find, else one that is nearly always as cheap (docs/PLANNER.md has the figures). When wood runs out the
// rest stays unfilled and the plan is still a success.
//
// kStorage: options.index_cache cannot be used. kInvalidArgument: a picture, size, weight or panel is unusable, a patch
// is larger than every panel, or a piece that must be kept cannot stay. kCancelled: within 100 ms of the stop request,
// unless `on_stop` asks for the best so far and there is a plan.
//
// `journal`, opened for the plan_key() of these arguments, remembers what is placed, chosen together and turned, and
// lets a later run go on there. Until it is where that one was, a stop request gives kCancelled whatever `on_stop` is.
// `shared` spares several plans of the same wood and pictures the same work.
Result<Plan> make_plan(std::span<const Artwork> artworks, std::span<const StockPanel> stock, const PlanOptions& options,
                       const Progress& progress = {}, const std::stop_token& stop = {}, PlanJournal* journal = nullptr,
                       SharedWork* shared = nullptr, OnStop on_stop = OnStop::kCancel);

}  // namespace veneer::planner
