// One physical sheet: a veneer panel, the AprilGrid sheet, or a plain board, with all that was ever done to it.
//
// Rasters lie in the sheet frame (plane.h): pixel (c, r) has its centre at x = (c + 0.5) / px_per_mm,
// y = height_mm - (r + 0.5) / px_per_mm. The back's raster lies in the same frame, so looking at it shows the back
// mirrored; flip it left-right to see what a viewer of the back sees.
//
// Threading: a Sheet is guarded by its World; snapshots are free to read.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/sim/plane.h"
#include "drivers/sim/relief.h"

namespace veneer::sim {

enum class SheetKind { kPanel, kGrid, kBoard };
enum class SheetFace { kShow, kBack };
enum class BurnDepth { kEngrave, kThrough };

const char* to_string(SheetKind kind);
const char* to_string(SheetFace face);
const char* to_string(BurnDepth depth);

// A printed tag where it truly sits. Corners of the black square in sheet mm, in the order lower left, lower right,
// upper right, upper left of the tag's own upright picture as its own face shows it.
struct TrueTag {
  int id = 0;
  SheetFace face = SheetFace::kShow;
  std::array<Vec2, 4> corners{};
};

struct TrueHole {
  Vec2 centre;
  double diameter_mm = 0;
};

// A strip of one species; outline in sheet mm.
struct SpeciesZone {
  std::string species;
  std::vector<Vec2> outline;
};

// One stroke as burnt, in sheet mm. Width is what is burnt away (through) or darkened (engrave). By hand: a bridge that
// somebody cut through with a knife, which browns nothing. A cut along y is wider by `oval_mm` than one along x,
// narrower by `taper_mm` where it leaves the wood (that is what is open), and has soot beside it.
struct TrueBurn {
  BurnDepth depth = BurnDepth::kEngrave;
  SheetFace face = SheetFace::kShow;  // which face the beam met
  double width_mm = 0;
  double begin_s = 0, end_s = 0;  // device time of the controller
  std::vector<Vec2> points;
  bool by_hand = false;
  double oval_mm = 0, taper_mm = 0, soot_mm = 0;
};

// A part that was cut loose and fell out when the sheet was lifted. `mask` (255 = wood) covers `box` of the sheet's
// rasters; chips below 4 mm2 are not kept.
struct TruePiece {
  int number = 0;
  cv::Rect box;
  cv::Mat mask;
  double area_mm2 = 0;
};

struct Sheet {
  std::string name;
  SheetKind kind = SheetKind::kPanel;
  double width_mm = 0, height_mm = 0, thickness_mm = 0;
  double px_per_mm = 0;
  cv::Mat front, back;                    // CV_8UC3, unburnt; change only where a tag slips
  cv::Mat material;                       // CV_8UC1, coverage: 255 = wood, 0 = nothing (holes, kerf, fallen pieces)
  cv::Mat engraved_front, engraved_back;  // CV_8UC1, darkening by engraving (and the browned edge of kerf)
  std::vector<TrueTag> tags;
  std::vector<TrueHole> holes;        // through-holes
  std::vector<TrueHole> screw_holes;  // dark, not through
  std::vector<SpeciesZone> zones;
  std::vector<TrueBurn> burns;
  std::vector<TruePiece> pieces;
  bool cut_since_lifted = false;  // there may be loose pieces lying in place
  Relief relief;                  // on the bed; on the glass it is pressed flat
  // Whether a tag of the show face, of the back has moved. `tags` stay where they were glued, as a scan saw them.
  std::array<bool, 2> slipped{};

  Vec2 pixel(Vec2 mm) const { return {mm.x * px_per_mm, (height_mm - mm.y) * px_per_mm}; }
  Vec2 mm(Vec2 px) const { return {px.x / px_per_mm, height_mm - px.y / px_per_mm}; }
  const cv::Mat& face(SheetFace f) const { return f == SheetFace::kShow ? front : back; }
  const cv::Mat& engraved(SheetFace f) const { return f == SheetFace::kShow ? engraved_front : engraved_back; }
};

// Marks the rasters with one stroke and keeps it in `burns`.
void burn_stroke(Sheet& sheet, TrueBurn stroke);

// Takes out every part that no longer hangs together with the largest one. Returns how many pieces fell.
int drop_loose_pieces(Sheet& sheet);

// `dir` is truth/sheets/NAME. save_sheet writes everything; append_burn and save_pieces what changed.
Status save_sheet(const Sheet& sheet, const std::filesystem::path& dir);
Status append_burn(const TrueBurn& burn, const std::filesystem::path& dir);
Status save_pieces(const Sheet& sheet, const std::filesystem::path& dir);
Result<std::shared_ptr<Sheet>> load_sheet(const std::filesystem::path& dir);

}  // namespace veneer::sim
