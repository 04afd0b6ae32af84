// What makes somebody look before a scan becomes stock. Pure; thread-safe.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "calib/exposure.h"
#include "calib/reconcile.h"
#include "calib/registration.h"
#include "calib/tag_sharpness.h"
#include "calib/veneer_mask.h"

namespace veneer::daemon {

// `name` is unique in its scan: who accepts the scan all the same says it ("size", "strip-2").
struct ScanWarning {
  std::string name, text;
  friend bool operator==(const ScanWarning&, const ScanWarning&) = default;
};

// Does taking the scan all the same leave out of use what is in doubt, and no more? Such warnings are of every day, and
// an operator answers them. The others would admit wood, or where it lies, against a doubt, or take away what may be
// there.
bool leaves_out_what_is_in_doubt(std::string_view name);

// dpi: the scan's file says another resolution than the configuration (0.2 %). What says nothing, or what programs
// write that know nothing (72 and 96), is no doubt. kRefused where the two are not the same setting at all (5 %).
Result<std::vector<ScanWarning>> doubts_of_resolution(const std::string& scan, double dpi_x, double dpi_y,
                                                      ScanResolution configured);

// blurred-tag-212, ...: the scan shows the rim of its tag 212 less sharply than the scanners that were tried do of a
// sheet that lies on their glass (0.2 mm, or 1.2 pixels where they are larger). Of several such tags the worst one.
std::vector<ScanWarning> doubts_of_sharpness(const std::string& scan, const std::vector<calib::TagSharpness>& tags,
                                             ScanResolution nominal);
bool is_of_sharpness(std::string_view name);

// overexposed, underexposed: more than 2 % of the wood is too light, or too dark, for its grain to be told.
std::vector<ScanWarning> doubts_of_exposure(const calib::Exposure& exposure);
bool is_of_exposure(std::string_view name);

// strip-1, strip-2, ...: what the mask withholds because it is in doubt; places from the sheet's lower left corner.
std::vector<ScanWarning> doubts_of_mask(const calib::VeneerMask& mask);

// Of any scan:
//   spoiled-tag-212, ...  it measures otherwise than it was printed and most others do not, or the tiles of a first
//                         scan do not show it alike and agree in all else; it counts for nothing
std::vector<ScanWarning> doubts_of_tags(const calib::Registration& registration);

// Of a later scan of a face:
//   moved-tag-212, moved-hole-1, ...  fiducials that no longer lie where the panel's first scans saw them, by what the
//                                     others say; they count for nothing, so that the scan is as good without them
//   disagree-1, ...                   those on tile 1 disagree (0.05 mm), and nobody can tell which one has moved
//   unproven-1, ...                   so few are seen on tile 1 that nobody could tell whether one has moved: somebody
//                                     looks first
std::vector<ScanWarning> doubts_of_fiducials(const std::vector<calib::TileView>& views,
                                             const calib::Registration& registration);
bool is_unproven(const ScanWarning& warning);

// Of a later scan of a show face, for which a picture that was kept is lost: it is not there, cannot be read, or is of
// another size.
//   lost-map       the oldest map: a later one shows what was gone by then as if it had never been there
//   lost-mask      a mask that says what was wood: all of the sheet is asked after
//   unproven-mask  the mask or map until now: whatever the scan calls wood may be what was known to be none, so that
//                  somebody looks first
ScanWarning doubt_of_lost_map(const std::filesystem::path& file);
bool is_lost_map(const ScanWarning& warning);
ScanWarning doubt_of_lost_mask(const std::filesystem::path& file);
ScanWarning doubt_of_lost_look(const std::filesystem::path& file);

// Of a later scan of a show face:
//   light  it differs from the panel's first map by more than any lamp makes of it
std::vector<ScanWarning> doubts_of_comparison(const calib::Reconciliation& compared);
// What such a scan tells of pieces in doubt is no sighting.
bool is_unfit_light(const ScanWarning& warning);

// Of a first scan, which defines the panel's frame:
//   scales        the printed tags came out longer along one of the scanner's axes than along the other (0.4 %)
//   tag-size      or all of them longer or shorter than they were printed (0.5 %)
//   size          the sheet is not as wide and as high as sheets are cut (whole 5 mm, by 0.6 mm), and its scale or its
//                 edge is in doubt: the tags are longer or shorter than printed (0.2 %) or do not tell, the sheet
//                 runs off the picture, or the wood reaches the edge
//   strip-missing bare board as wide as a strip lies between two strips
std::vector<ScanWarning> doubts_of_first_scan(const std::vector<calib::TileView>& views,
                                              const calib::Registration& registration, const calib::VeneerMask& mask);
// Of a first scan that is not doubted for its size: that this is not round.
std::optional<std::string> remark_on_size(Millimetres width, Millimetres height);

}  // namespace veneer::daemon
