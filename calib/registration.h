// Where a scan lies on its panel: panel_from_scan, with residuals in millimetres.
//
// A panel's first accepted show scan (one tile or several) defines PanelFrame: origin = lower left corner of the sheet,
// +x along its lower edge, where "lower" is how most of the tags stand (if they do not agree, how the first tile lay).
// Its fiducials are then frozen; later scans are fitted to them and move nothing. A back scan is tied to the show face
// by at least three asymmetric through-holes; its handedness is measured from them. Printed tag size is only a check.
// What has moved since it was frozen is found by what the other fiducials say, named, and left out; so is a tag that
// measures otherwise than it was printed, or that tiles do not show alike.
// Thread-safe.
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "calib/fiducial_plan.h"
#include "calib/fiducials.h"
#include "calib/hole_detector.h"
#include "calib/scanner_model.h"
#include "calib/tag_detector.h"

namespace veneer::calib {

// panel_from_scan of one tile: the scanner's map, then a rigid motion (improper for the back face).
class ScanMap {
 public:
  ScanMap() = default;
  ScanMap(const Isometry2<PanelFrame, GlassFrame>& panel_from_glass, ScannerModel scanner, ScanResolution nominal);

  Point<PanelFrame> operator*(const Point<ScanFrame>& p) const;
  Point<ScanFrame> inverse(const Point<PanelFrame>& p) const;
  const Isometry2<PanelFrame, GlassFrame>& panel_from_glass() const { return panel_from_glass_; }
  const ScannerModel& scanner() const { return scanner_; }
  ScanResolution nominal() const { return nominal_; }

 private:
  Isometry2<PanelFrame, GlassFrame> panel_from_glass_;
  Isometry2<GlassFrame, PanelFrame> glass_from_panel_;
  ScannerModel scanner_;
  ScanResolution nominal_;
};

// What the detectors see on one raw scan.
struct TileView {
  std::string name;  // for messages: "scan 12"
  std::vector<Tag<ScanFrame>> tags;
  std::vector<Hole> holes;
  std::vector<Point<ScanFrame>> outline;  // convex hull of the sheet against the lid
  ScanResolution nominal;
  int width_px = 0, height_px = 0;
};
TileView view_tile(const cv::Mat& picture, ScanResolution nominal, const std::string& name,
                   const HoleOptions& holes = {});

struct RegistrationOptions {
  Millimetres tag_size{kPanelTagSize};
  double tag_size_tolerance = 0.01;
  Millimetres max_rms{0.05};
  Millimetres max_single{0.10};
  // A frozen fiducial that lies farther from where the others put it has moved, and is dropped when the rest agree.
  Millimetres max_offset{0.05};
  // Where nobody can tell which one it is, the fiducials on one tile may disagree by so much.
  Millimetres max_disagreement{0.16};
  std::size_t min_tags = 3;   // on the face, all tiles together
  std::size_t min_holes = 3;  // that tie the back to the show face
  // A later scan of a known face: tags that the panel never had become its own, tied to the map by three fiducials or
  // more on the same tile that stayed where they were, and agree to within max_offset. Those that moved stay frozen
  // where they were, and count no more.
  bool retag = false;
  // Ids of tags that belong to other panels (and to the AprilGrid sheet): seeing one is an error.
  std::set<int> foreign_tags;
};

// How well the frozen fiducials that count agree on one tile.
struct TileAgreement {
  std::size_t fiducials = 0;
  std::optional<Millimetres> worst;  // from where the others put it; nothing with fewer than three: nobody can tell
  // Of each that is seen on the tile and of which that can be told, those that have moved included.
  std::vector<FiducialOffset> offsets;
  // Whether it is proven where the tile lies.
  bool within(Millimetres limit) const { return worst && *worst <= limit; }
};

// A tag of another size than it was printed with, where most others have theirs, or that two tiles do not show alike,
// where all else agrees: something lies on its rim, or it curls.
struct SpoiledTag {
  PanelTag tag;                      // where it lies
  Millimetres side{0};               // as it measures
  std::string tile;                  // its name
  std::optional<Millimetres> apart;  // how far the tiles show its corners from each other, rms, if that is why
};

struct Registration {
  std::vector<ScanMap> tiles;  // in the order given
  // Disagreement. First show scan: between tiles at shared corners (null with one tile). Later show scans: with the
  // frozen fiducials. First back scan: of the holes that tie the faces; later ones: with the frozen back tags.
  std::optional<Millimetres> rms, max;
  PanelFiducials fiducials;  // all that is known after this scan: what was frozen before, and what is new
  // Of a later scan of a face: fiducials that no longer lie where they were frozen, by what the others say; they count
  // for nothing else here. How far the others lie from where the rest puts them, as far as anybody can tell.
  std::vector<FiducialOffset> moved, left_out;
  std::vector<SpoiledTag> spoiled;       // they count for nothing, and are not among a first scan's fiducials
  std::vector<TileAgreement> agreement;  // of each tile of a later scan
  std::vector<int> new_tags;             // ids that became the panel's by `retag`, ascending
  Box<PanelFrame> sheet;                 // the sheet's bounding box; its min is (0, 0) on a first scan
};

// kNotFound: no tags. kRefused: too few, too large a residual, a foreign tag, tiles that share too little.
Result<Registration> register_first_scan(std::span<const TileView> tiles, const ScannerModel& scanner,
                                         const RegistrationOptions& options = {});

// A later scan of a known panel, `face` being the one the operator says is on the glass. A first look at the back
// needs `known` to hold the show face's holes, and adds the back's tags. kRefused as above, and when the other face
// or another panel lies on the glass.
Result<Registration> register_scan(std::span<const TileView> tiles, Face face, const PanelFiducials& known,
                                   const ScannerModel& scanner, const RegistrationOptions& options = {});

}  // namespace veneer::calib
