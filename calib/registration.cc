#include "calib/registration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "calib/consensus_fit.h"
#include "calib/hole_tie.h"
#include "calib/point_fit.h"
#include "calib/refused.h"
#include "calib/sheet_outline.h"
#include "calib/sound_tiles.h"
#include "calib/spoiled_tags.h"
#include "calib/tile_join.h"

namespace veneer::calib {
namespace {

std::string list_of(const std::vector<int>& ids) {
  std::string out;
  for (std::size_t i = 0; i < ids.size() && i < 4; ++i) out += (i == 0 ? "" : ", ") + std::to_string(ids[i]);
  return ids.size() > 4 ? out + ", ..." : out;
}

Status check_residual(const Registration& found, const RegistrationOptions& options, const std::string& what) {
  if (!found.rms || (*found.rms <= options.max_rms && *found.max <= options.max_single)) return Ok();
  return refused(
      fmt::format("{} by {:.3f} mm rms, {:.3f} mm at worst ({:.2f} and {:.2f} are allowed): clean the "
                  "glass, lay the panel flat and scan again, or calibrate the scanner",
                  what, found.rms->count(), found.max->count(), options.max_rms.count(), options.max_single.count()));
}

// The tags' common upward direction, in JoinedFrame; the scan's own when they do not agree.
void upward(const Join& join, double& x, double& y) {
  double sum_x = 0, sum_y = 0, n = 0;
  for (const auto& [key, corner] : join.corners) {
    if (key % 4 != 0) continue;
    const Point<JoinedFrame>& above = join.corners.at(key + 3);
    const double length = distance(corner, above).count();
    sum_x += (above.x - corner.x).count() / length, sum_y += (above.y - corner.y).count() / length, n += 1;
  }
  const bool agree = n > 0 && std::hypot(sum_x, sum_y) > 0.6 * n;
  x = agree ? sum_x : 0, y = agree ? sum_y : 1;
}

template <class Map>
std::vector<PanelTag> tags_of(const Join& join, const Map& panel_from_joined, Face face) {
  std::vector<PanelTag> tags;
  for (const auto& [key, corner] : join.corners) {
    if (key % 4 == 0) tags.push_back({key / 4, face, {}});
    tags.back().corners[static_cast<std::size_t>(key % 4)] = panel_from_joined * corner;
  }
  return tags;
}

void sort_by_id(std::vector<PanelTag>& tags) {
  std::sort(tags.begin(), tags.end(), [](const PanelTag& a, const PanelTag& b) { return a.id < b.id; });
}

Box<PanelFrame> sheet_box(std::span<const TileView> tiles, const std::vector<ScanMap>& maps) {
  Box<PanelFrame> box;
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (const auto& p : tiles[t].outline) box.add(maps[t] * p);
  return box;
}

// Whether the rectangle is the sheet: all tags lie on it, and each of its sides was seen.
Status check_sheet(const SheetRectangle& sheet, const std::vector<PanelTag>& tags, const std::string& name) {
  constexpr double kSeen = 0.5;      // of each side
  const Millimetres tolerance{0.5};  // by which a tag may stick out
  bool inside = true;
  for (const PanelTag& tag : tags)
    for (const auto& corner : tag.corners)
      inside = inside && corner.x > -tolerance && corner.y > -tolerance && corner.x < sheet.width + tolerance &&
               corner.y < sheet.height + tolerance;
  if (inside && sheet.least_seen >= kSeen) return Ok();
  return refused(
      fmt::format("the sheet's border cannot be made out on {}: if the board is as bright as the lid, lay a dark sheet "
                  "of paper over it, close the lid and scan again",
                  name));
}

// A first look at the back: its tiles are joined by their own tags, then tied to the panel by the holes.
Result<Registration> tie_back(const std::vector<TileView>& tiles, const PanelFiducials& known,
                              const ScannerModel& scanner, const RegistrationOptions& options) {
  auto join = join_tiles(tiles, scanner, {options.max_offset});
  if (!join) return join.error();
  if (auto status = check_left(*join, options.min_tags); !status) return status.error();
  if (join->rms && (*join->rms > options.max_rms || *join->max > options.max_single)) {
    Registration disagreeing;
    disagreeing.rms = join->rms, disagreeing.max = join->max;
    return check_residual(disagreeing, options, "the back's tiles disagree").error();
  }
  std::vector<Point<PanelFrame>> frozen;
  std::vector<Point<JoinedFrame>> seen;
  for (const PanelHole& hole : known.holes) frozen.push_back(hole.centre);
  for (const auto& hole : join->holes) seen.push_back(hole.centre);
  const auto tie = match_holes<PanelFrame, JoinedFrame>(frozen, seen, {.min_points = options.min_holes});
  if (!tie) {
    if (tie.error().code == ErrorCode::kRefused)
      return refused(
          "the panel's through-holes look alike when turned or mirrored, so the faces cannot be tied: "
          "drill one more hole off the symmetry and scan both faces again");
    return refused(
        fmt::format("{} through-holes are seen on the back and {} on the show face, but fewer than {} match: "
                    "check that this is the back of the panel, and that its holes are free",
                    seen.size(), frozen.size(), options.min_holes));
  }
  if (tie->to_from.handedness() != Handedness::kImproper)
    return refused("the holes lie as on the show face, not mirrored: lay the panel with its back on the glass");

  Registration out;
  out.rms = Millimetres(tie->residual.rms), out.max = Millimetres(tie->residual.max);
  if (auto status = check_residual(out, options, "the holes of the two faces disagree"); !status) return status.error();
  for (std::size_t t = 0; t < tiles.size(); ++t)
    out.tiles.emplace_back(tie->to_from * join->tiles[t], scanner, tiles[t].nominal);
  out.fiducials = known;
  for (PanelTag& tag : tags_of(*join, tie->to_from, Face::kBack)) out.fiducials.tags.push_back(tag);
  sort_by_id(out.fiducials.tags);
  add_unlike(*join, tiles, out.tiles, Face::kBack, out.spoiled);
  out.sheet = sheet_box(tiles, out.tiles);
  return out;
}

struct TileFit {
  ScanMap map;
  double sum_of_squares = 0, max = 0;
  std::size_t points = 0;
  std::vector<FiducialOffset> moved, left_out;
  TileAgreement agreement;
};

using TileLandmark = Landmark<PanelFrame, GlassFrame>;

// The panel's own tags on the tile, and which they are.
std::vector<TileLandmark> known_tags(const TileView& tile, Face face, const PanelFiducials& known,
                                     const ScannerModel& scanner, std::vector<FiducialOffset>& which) {
  std::vector<TileLandmark> out;
  const auto corners = corners_on_glass(tile, scanner);
  for (const auto& tag : tile.tags) {
    const PanelTag* frozen = known.tag(tag.id);
    if (frozen == nullptr || frozen->face != face) continue;
    TileLandmark& landmark = out.emplace_back();
    landmark.to.assign(frozen->corners.begin(), frozen->corners.end());
    for (int i = 0; i < 4; ++i) landmark.from.push_back(corners.at(tag.id * 4 + i));
    which.push_back({tag.id, frozen->corners[0], Millimetres(0)});
  }
  return out;
}

// Holes that are seen near where they should be.
void add_known_holes(const TileView& tile, const PanelFiducials& known, const ScannerModel& scanner,
                     const Isometry2<PanelFrame, GlassFrame>& panel_from_glass, std::vector<TileLandmark>& landmarks,
                     std::vector<FiducialOffset>& which) {
  constexpr double kSamePlace = 0.4;  // mm
  for (const Hole& hole : tile.holes) {
    const Point<GlassFrame> seen = scanner.glass_from_scan(hole.centre, tile.nominal);
    for (const PanelHole& frozen : known.holes) {
      if (distance(panel_from_glass * seen, frozen.centre).count() >= kSamePlace) continue;
      landmarks.push_back({{frozen.centre}, {seen}});
      which.push_back({-1, frozen.centre, Millimetres(0)});
    }
  }
}

// One tile on the frozen fiducials of its face: tags, and holes near where they should be. What has moved is left out.
Result<TileFit> fit_tile(const TileView& tile, Face face, const PanelFiducials& known, const ScannerModel& scanner,
                         const RegistrationOptions& options) {
  std::vector<FiducialOffset> which;
  std::vector<TileLandmark> landmarks = known_tags(tile, face, known, scanner, which);
  if (landmarks.size() < 2)
    return refused(fmt::format("{} shows {} of the panel's tags, two are needed: lay more of the panel on the glass",
                               tile.name, landmarks.size()));
  const ConsensusLimits limits{options.max_offset};
  const auto fit = [&](Handedness hand) { return fit_consensus<PanelFrame, GlassFrame>(landmarks, hand, limits); };
  const auto rms = [&](const ConsensusFit<PanelFrame, GlassFrame>& found) {
    double sum = 0;
    std::size_t points = 0;
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      if (std::binary_search(found.moved.begin(), found.moved.end(), l)) continue;
      const double one = residual_of(found.to_from, std::span<const Point<PanelFrame>>(landmarks[l].to),
                                     std::span<const Point<GlassFrame>>(landmarks[l].from))
                             .rms;
      sum += one * one * static_cast<double>(landmarks[l].to.size()), points += landmarks[l].to.size();
    }
    return std::sqrt(sum / static_cast<double>(points));
  };
  const auto proper = fit(Handedness::kProper), improper = fit(Handedness::kImproper);
  const auto& measured = rms(proper) <= rms(improper) ? proper : improper;
  if ((measured.to_from.handedness() == Handedness::kImproper) != (face == Face::kBack))
    return refused(fmt::format("the tags on {} lie mirrored to what the {} face must show: scan the panel's {} face",
                               tile.name, to_string(face), to_string(face)));
  add_known_holes(tile, known, scanner, measured.to_from, landmarks, which);
  const auto found = fit(measured.to_from.handedness());
  TileFit out;
  out.map = ScanMap(found.to_from, scanner, tile.nominal);
  out.agreement.fiducials = landmarks.size() - found.moved.size();
  if (found.worst_left_out) out.agreement.worst = Millimetres(*found.worst_left_out);
  if (out.agreement.worst > options.max_disagreement)
    return refused(
        fmt::format("the panel's fiducials on {} do not lie as they were frozen, by up to {:.2f} mm ({:.2f} "
                    "are allowed), and too few are seen to tell which one has moved: lay the panel flat, "
                    "with more of it on the glass, wipe its tags clean and scan again, or calibrate the scanner",
                    tile.name, out.agreement.worst->count(), options.max_disagreement.count()));
  for (std::size_t l = 0; l < landmarks.size(); ++l) {
    const bool moved = std::binary_search(found.moved.begin(), found.moved.end(), l);
    if (found.left_out[l]) {
      which[l].off = Millimetres(*found.left_out[l]);
      out.agreement.offsets.push_back(which[l]);
      (moved ? out.moved : out.left_out).push_back(which[l]);
    }
    if (moved) continue;
    out.points += landmarks[l].to.size();
    for (std::size_t i = 0; i < landmarks[l].to.size(); ++i) {
      const double d = distance(found.to_from * landmarks[l].from[i], landmarks[l].to[i]).count();
      out.sum_of_squares += d * d, out.max = std::max(out.max, d);
    }
  }
  return out;
}

bool on_sheet(const PanelTag& tag, const Box<PanelFrame>& sheet) {
  const Millimetres tolerance{1};
  return std::all_of(tag.corners.begin(), tag.corners.end(), [&](const Point<PanelFrame>& p) {
    return p.x > sheet.min.x - tolerance && p.y > sheet.min.y - tolerance && p.x < sheet.max.x + tolerance &&
           p.y < sheet.max.y + tolerance;
  });
}

// Whether what the tile shows of the panel proves where it lies, so that a place on it can be frozen.
Status check_proven(const TileView& tile, const TileAgreement& agreement, const RegistrationOptions& options) {
  constexpr std::size_t kNeeded = 3;
  if (agreement.fiducials < kNeeded || !agreement.worst)
    return refused(
        fmt::format("{} of the panel's fiducials on {} still lie where they were, three are needed to tie new tags to: "
                    "lay the panel so that more of them are seen beside each new tag",
                    agreement.fiducials, tile.name));
  if (agreement.within(options.max_offset)) return Ok();
  return refused(fmt::format(
      "the panel's fiducials on {} disagree by {:.2f} mm, and new tags are tied to such as agree to {:.2f}: "
      "lay the panel flat, wipe its tags clean and scan again",
      tile.name, agreement.worst->count(), options.max_offset.count()));
}

// Tags that the panel never had become its own, where the map puts them.
Status retag(std::span<const TileView> tiles, Face face, const RegistrationOptions& options,
             Registration& registration) {
  std::map<int, std::vector<std::array<Point<PanelFrame>, 4>>> seen;
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (const auto& tag : tiles[t].tags) {
      if (registration.fiducials.tag(tag.id) != nullptr) continue;
      if (auto status = check_proven(tiles[t], registration.agreement[t], options); !status) return status.error();
      auto& corners = seen[tag.id].emplace_back();
      for (std::size_t i = 0; i < 4; ++i) corners[i] = registration.tiles[t] * tag.corners[i];
    }
  for (const auto& [id, views] : seen) {
    PanelTag tag{id, face, {}};
    for (std::size_t i = 0; i < 4; ++i) {
      double x = 0, y = 0;
      for (const auto& corners : views) x += corners[i].x.count(), y += corners[i].y.count();
      const auto n = static_cast<double>(views.size());
      tag.corners[i] = point<PanelFrame>(x / n, y / n);
    }
    if (!on_sheet(tag, registration.sheet))
      return refused(fmt::format("tag {} does not lie on the panel: lay only this panel on the glass", id));
    registration.fiducials.tags.push_back(tag);
    registration.new_tags.push_back(id);
  }
  sort_by_id(registration.fiducials.tags);
  return Ok();
}

// Whether the scan shows the panel, and the face that was asked for.
Status check_face(std::span<const TileView> tiles, Face face, const PanelFiducials& known, bool new_tags) {
  std::vector<int> other_face, strangers;
  std::size_t right = 0;
  for (const int id : seen_ids(tiles)) {
    const PanelTag* tag = known.tag(id);
    if (tag == nullptr) {
      strangers.push_back(id);
    } else if (tag->face == face) {
      ++right;
    } else {
      other_face.push_back(id);
    }
  }
  if (!other_face.empty())
    return refused(
        fmt::format("the panel's {} face lies on the glass (tag {}), the {} face is wanted: turn the panel "
                    "over",
                    to_string(other(face)), list_of(other_face), to_string(face)));
  if (!known.knows(face)) return Ok();
  if (right == 0)
    return refused(
        fmt::format("another panel lies on the glass (tags {}): lay the wanted panel on it", list_of(strangers)));
  if (!strangers.empty() && !new_tags)
    return refused(
        fmt::format("tag {} does not belong to this panel's {} face: lay only this panel on the glass, or "
                    "scan it with --retag when the tag was newly glued to it",
                    list_of(strangers), to_string(face)));
  return Ok();
}

}  // namespace

ScanMap::ScanMap(const Isometry2<PanelFrame, GlassFrame>& panel_from_glass, ScannerModel scanner,
                 ScanResolution nominal)
    : panel_from_glass_(panel_from_glass),
      glass_from_panel_(panel_from_glass.inverse()),
      scanner_(std::move(scanner)),
      nominal_(nominal) {}

Point<PanelFrame> ScanMap::operator*(const Point<ScanFrame>& p) const {
  return panel_from_glass_ * scanner_.glass_from_scan(p, nominal_);
}

Point<ScanFrame> ScanMap::inverse(const Point<PanelFrame>& p) const {
  return scanner_.scan_from_glass(glass_from_panel_ * p, nominal_);
}

TileView view_tile(const cv::Mat& picture, ScanResolution nominal, const std::string& name,
                   const HoleOptions& hole_options) {
  TileView view;
  view.name = name;
  // At 300 dpi a 14 mm tag is 165 px wide: it is found four times coarser, and refined at full resolution.
  view.tags = detect_tags<ScanFrame>(picture, {.decimate = nominal.dpi() > 200 ? 4.0 : 2.0});
  view.nominal = nominal;
  view.width_px = picture.cols, view.height_px = picture.rows;
  for (Hole& hole : detect_holes(picture, nominal, hole_options)) {
    // White cells inside a tag may look round.
    const bool in_tag = std::any_of(view.tags.begin(), view.tags.end(), [&](const Tag<ScanFrame>& tag) {
      return distance(tag.centre, hole.centre) < 0.75 * distance(tag.corners[0], tag.corners[1]);
    });
    if (!in_tag) view.holes.push_back(hole);
  }
  view.outline = find_outline(picture, nominal, view.tags);
  return view;
}

Result<Registration> register_first_scan(std::span<const TileView> seen, const ScannerModel& scanner,
                                         const RegistrationOptions& options) {
  auto sound = check_tags(seen, scanner, options);
  if (!sound) return sound.error();
  const std::vector<TileView>& tiles = sound->tiles;
  auto join = join_tiles(tiles, scanner, {options.max_offset});
  if (!join) return join.error();
  if (auto status = check_left(*join, options.min_tags); !status) return status.error();

  Registration out;
  out.rms = join->rms, out.max = join->max;
  if (auto status = check_residual(out, options, fmt::format("the tiles disagree, most at tag {},", join->worst_tag));
      !status)
    return status.error();

  std::vector<Point<JoinedFrame>> border;
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (const auto& p : tiles[t].outline)
      border.push_back(join->tiles[t] * scanner.glass_from_scan(p, tiles[t].nominal));
  if (border.size() < 8)
    return Error{ErrorCode::kNotFound, fmt::format("no sheet is seen on {}: lay the panel on the glass, close the lid "
                                                   "and scan again",
                                                   tiles[0].name)};
  double up_x = 0, up_y = 1;
  upward(*join, up_x, up_y);
  const SheetRectangle sheet = fit_rectangle(border, up_x, up_y);
  for (std::size_t t = 0; t < tiles.size(); ++t)
    out.tiles.emplace_back(sheet.panel_from_joined * join->tiles[t], scanner, tiles[t].nominal);
  out.fiducials.tags = tags_of(*join, sheet.panel_from_joined, Face::kShow);
  out.spoiled = place_spoiled(sound->spoiled, tiles, out.tiles, Face::kShow);
  add_unlike(*join, tiles, out.tiles, Face::kShow, out.spoiled);
  if (auto status = check_sheet(sheet, out.fiducials.tags, tiles[0].name); !status) return status.error();
  for (const auto& hole : join->holes)
    out.fiducials.holes.push_back({sheet.panel_from_joined * hole.centre, hole.diameter});
  out.sheet.add(point<PanelFrame>(0, 0));
  out.sheet.add({sheet.width, sheet.height});
  return out;
}

Result<Registration> register_scan(std::span<const TileView> seen, Face face, const PanelFiducials& known,
                                   const ScannerModel& scanner, const RegistrationOptions& options) {
  auto sound = check_tags(seen, scanner, options);
  if (!sound) return sound.error();
  const std::vector<TileView>& tiles = sound->tiles;
  if (auto status = check_face(tiles, face, known, options.retag); !status) return status.error();
  if (!known.knows(face)) {
    if (face == Face::kShow)
      return Error{ErrorCode::kInvalidArgument, "the panel's show face was never scanned: scan it first"};
    auto back = tie_back(tiles, known, scanner, options);
    if (back)
      for (SpoiledTag& spoiled : place_spoiled(sound->spoiled, tiles, back->tiles, face))
        back->spoiled.push_back(std::move(spoiled));
    return back;
  }
  Registration out;
  double sum = 0, max = 0;
  std::size_t points = 0;
  for (const TileView& tile : tiles) {
    auto fit = fit_tile(tile, face, known, scanner, options);
    if (!fit) return fit.error();
    out.moved.insert(out.moved.end(), fit->moved.begin(), fit->moved.end());
    out.left_out.insert(out.left_out.end(), fit->left_out.begin(), fit->left_out.end());
    out.agreement.push_back(fit->agreement);
    sum += fit->sum_of_squares, max = std::max(max, fit->max), points += fit->points;
    out.tiles.push_back(std::move(fit->map));
  }
  out.rms = Millimetres(std::sqrt(sum / static_cast<double>(points)));
  out.max = Millimetres(max);
  if (auto status = check_residual(out, options, "the scan misses the panel's known fiducials"); !status)
    return status.error();
  out.fiducials = known;
  out.spoiled = place_spoiled(sound->spoiled, tiles, out.tiles, face);
  out.sheet = sheet_box(tiles, out.tiles);
  if (options.retag)
    if (auto status = retag(tiles, face, options, out); !status) return status.error();
  return out;
}

}  // namespace veneer::calib
