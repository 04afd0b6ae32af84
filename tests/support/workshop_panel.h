// Panels as shops glue them, drawn from a seed and independent of both the twin and the eyes: strips of photographed
// wood (the twin's grown wood where the developer's data set is not there) on boards of many kinds, with screws, holes,
// cracks, knots, tags, dust, uneven light and JPEG; and what truly lies at every place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "base/frames.h"
#include "calib/fiducials.h"

namespace veneer::workshop {

// What lies at a place of the sheet.
enum class Matter : std::uint8_t { kLid, kBoard, kWood, kScrew, kHole, kCrack, kTag };

struct Strip {
  std::string wood;
  std::vector<cv::Point2d> outline;  // sheet mm, y up
};

struct Fault {
  Matter matter = Matter::kScrew;
  std::string kind;
  int strip = 0;  // from 1
  cv::Point2d centre;
  double size = 0;  // diameter, or a crack's width, mm
};

struct Panel {
  std::string board;
  double width = 0, height = 0;  // mm
  std::vector<Strip> strips;
  std::vector<Fault> faults;
  int hairs = 0;  // on the glass, see `hair`
  cv::Mat scan;   // CV_8UC3, the show face on the glass
  ScanResolution resolution;
  calib::PanelFiducials fiducials;  // where tags and through-holes truly are, sheet mm
  // Sheet frame: mm, origin at the sheet's lower left corner, y up. Pixels have their centres at +0.5.
  cv::Matx23d scan_from_sheet;
  // The sheet in its own frame at `truth_px_per_mm`, row 0 at the top.
  double truth_px_per_mm = 0;
  cv::Mat matter;  // CV_8UC1, Matter
  cv::Mat strip;   // CV_8UC1, the number of the strip that the place belongs to, faults included; 0 = none
  cv::Mat fault;   // CV_16UC1, 1 + index into faults; 0 = none
  cv::Mat hair;    // CV_8UC1, as large as the scan: 255 where a hair on the glass hides half of a pixel or more
};

// What was done to a sheet since it was glued.
enum class DeedKind : std::uint8_t {
  kCut,      // the laser cut it out, and it fell: the lid is seen
  kHanging,  // the laser cut around it, and it hangs in its place still
  kTorn,     // its veneer came off: the bare board is seen
};
struct Deed {
  DeedKind kind = DeedKind::kCut;
  std::vector<cv::Point2d> outline;  // sheet mm; of what is cut with its kerf
};

enum class Lid : std::uint8_t { kWhite, kGrey, kBlack };

// Every board and wood comes round; an index beyond their number begins again.
constexpr int kBoards = 8;

struct Order {
  std::uint64_t seed = 1;
  int board = 0;     // modulo kBoards
  double dpi = 300;  // 150 to 300
  double width = 200, height = 140;
  bool faults = true;  // screws, holes, cracks, knots
  int hairs = 0;       // that lie on the scanner's glass, 8 to 40 mm long
  Lid lid = Lid::kWhite;
  // The same sheet, seen again by another scan (0: the first), with all that was done to it.
  std::uint64_t rescan = 0;
  std::vector<Deed> deeds;
  std::filesystem::path woods;  // folder of the data set's wood pictures; empty: grown wood
};
Panel compose(const Order& order);

}  // namespace veneer::workshop
