#include "calib/bed_pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "calib/bed_lift.h"
#include "calib/consensus_fit.h"
#include "calib/point_fit.h"
#include "calib/refused.h"

namespace veneer::calib {
namespace {

struct KnownTag {
  const PanelCandidate* candidate = nullptr;
  const PanelTag* tag = nullptr;
};

// The tags seen, sorted out by panel and face.
struct Sorted {
  std::map<std::pair<const PanelCandidate*, Face>, std::vector<std::pair<const Tag<CameraFrame>*, const PanelTag*>>>
      groups;
  std::vector<int> strange;  // of no candidate
  std::vector<int> twice;
};

Sorted sort_out(std::span<const Tag<CameraFrame>> seen, std::span<const PanelCandidate> candidates) {
  std::map<int, KnownTag> known;
  for (const auto& candidate : candidates) {
    for (const auto& tag : candidate.fiducials.tags) known[tag.id] = {&candidate, &tag};
  }
  Sorted out;
  std::set<int> met;
  for (const auto& tag : seen) {
    if (!met.insert(tag.id).second) out.twice.push_back(tag.id);
    const auto it = known.find(tag.id);
    if (it == known.end()) {
      out.strange.push_back(tag.id);
    } else {
      out.groups[{it->second.candidate, it->second.tag->face}].emplace_back(&tag, it->second.tag);
    }
  }
  return out;
}

std::string list(const std::vector<int>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size() && i < 6; ++i) text += (i == 0 ? "" : ", ") + std::to_string(ids[i]);
  return ids.size() > 6 ? text + ", ..." : text;
}

const char* face_words(Face face) { return face == Face::kShow ? "show face" : "back"; }

// What lies on the bed must be one panel, seen on one face, and nothing else.
Status one_panel_only(const Sorted& sorted, const BedPoseLimits& limits) {
  if (!sorted.twice.empty()) {
    return refused(
        fmt::format("tag {} is seen twice on the bed: take off what does not belong to the panel", list(sorted.twice)));
  }
  if (sorted.groups.empty()) {
    if (sorted.strange.empty()) {
      return Error{ErrorCode::kNotFound,
                   "the bed camera sees no tags: lay the panel on the bed, with light on it, and try again"};
    }
    return Error{ErrorCode::kNotFound,
                 fmt::format("the bed shows tags {} that belong to no known panel: scan this panel "
                             "first, or lay the right one on the bed",
                             list(sorted.strange))};
  }
  const auto& [first, first_tags] = *sorted.groups.begin();
  for (const auto& [key, tags] : sorted.groups) {
    if (key.first != first.first) {
      return refused(fmt::format("tags of panels {} and {} are both on the bed: leave only one panel there",
                                 first.first->panel.value, key.first->panel.value));
    }
    if (key.second != first.second) {
      return refused(
          fmt::format("tags of both faces of panel {} are seen at once: its registration is wrong, scan both "
                      "faces again",
                      first.first->panel.value));
    }
  }
  // One strange tag may be a misread patch of wood; several are another sheet.
  if (sorted.strange.size() > 1) {
    return refused(fmt::format("beside panel {} the bed shows tags {} that do not belong to it: take them off the bed",
                               first.first->panel.value, list(sorted.strange)));
  }
  if (static_cast<int>(first_tags.size()) < limits.min_tags) {
    return refused(
        fmt::format("only {} of panel {}'s tags are seen on its {}, {} are needed: clear what covers them and "
                    "see that the whole panel lies in the picture",
                    first_tags.size(), first.first->panel.value, face_words(first.second), limits.min_tags));
  }
  return Ok();
}

double spread_of(std::span<const Point<BedFrame>> points) {
  double x = 0, y = 0, sum = 0;
  for (const auto& p : points) x += p.x.count(), y += p.y.count();
  x /= static_cast<double>(points.size()), y /= static_cast<double>(points.size());
  for (const auto& p : points) sum += std::pow(p.x.count() - x, 2) + std::pow(p.y.count() - y, 2);
  return std::sqrt(sum);
}

struct Corners {
  std::vector<Point<BedFrame>> bed;
  std::vector<Point<PanelFrame>> panel;
  std::vector<int> tag;  // id, per corner
};

// Those of the tags that count, as rays.
std::vector<RayToSheet> rays_to(std::span<const std::pair<const Tag<CameraFrame>*, const PanelTag*>> tags,
                                const std::vector<int>& counting, const CameraModel& model, Millimetres height) {
  std::vector<RayToSheet> out;
  for (const auto& [seen, known] : tags) {
    if (!std::binary_search(counting.begin(), counting.end(), seen->id)) continue;
    for (std::size_t i = 0; i < 4; ++i)
      out.push_back({known->corners[i], model.bed_from_camera(seen->corners[i], height),
                     model.bed_from_camera(seen->corners[i], height + Millimetres(1))});
  }
  return out;
}

double rms_of(const Corners& corners, Handedness hand) {
  const std::span<const Point<BedFrame>> bed(corners.bed);
  const std::span<const Point<PanelFrame>> panel(corners.panel);
  return residual_of(fit_isometry<BedFrame, PanelFrame>(bed, panel, hand), bed, panel).rms;
}

// Takes the corners of tags that have moved out, and tells of all of them.
void leave_out_moved(Corners& corners, Handedness hand, const BedPoseLimits& limits, BedPose& pose) {
  std::vector<Landmark<BedFrame, PanelFrame>> tags;
  std::vector<FiducialOffset> offsets;
  for (std::size_t i = 0; i < corners.tag.size(); i += 4) {
    const auto first = static_cast<std::ptrdiff_t>(i);
    tags.push_back({{corners.bed.begin() + first, corners.bed.begin() + first + 4},
                    {corners.panel.begin() + first, corners.panel.begin() + first + 4}});
    offsets.push_back({corners.tag[i], corners.panel[i], Millimetres(0)});
  }
  const auto fit = fit_consensus<BedFrame, PanelFrame>(
      tags, hand, {limits.max_tag_offset, static_cast<std::size_t>(limits.min_tags)});
  Corners counted;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const bool known = fit.left_out[t].has_value();
    if (known) offsets[t].off = Millimetres(*fit.left_out[t]);
    if (std::find(fit.moved.begin(), fit.moved.end(), t) != fit.moved.end()) {
      pose.moved.push_back(offsets[t]);
      continue;
    }
    if (known) pose.left_out.push_back(offsets[t]);
    pose.tags.push_back(offsets[t].tag);
    counted.bed.insert(counted.bed.end(), tags[t].to.begin(), tags[t].to.end());
    counted.panel.insert(counted.panel.end(), tags[t].from.begin(), tags[t].from.end());
    counted.tag.insert(counted.tag.end(), 4, offsets[t].tag);
  }
  std::sort(pose.tags.begin(), pose.tags.end());
  corners = std::move(counted);
  if (fit.worst_left_out && Millimetres(*fit.worst_left_out) > limits.max_tag_offset)
    pose.disagreement = Millimetres(*fit.worst_left_out);
}

int worst_tag(const Corners& corners, const Isometry2<BedFrame, PanelFrame>& bed_from_panel) {
  double worst = -1;
  int id = -1;
  for (std::size_t i = 0; i < corners.bed.size(); ++i) {
    const double d = distance(bed_from_panel * corners.panel[i], corners.bed[i]).count();
    if (d > worst) worst = d, id = corners.tag[i];
  }
  return id;
}

Status within_limits(const BedPose& pose, const Corners& corners, const BedPoseLimits& limits) {
  if (std::abs(pose.scale - 1) > limits.max_scale_error) {
    return refused(
        fmt::format("panel {} looks {:.2f} % too {} for the height given: check its thickness, that it lies "
                    "flat, and the camera's calibration",
                    pose.panel.value, std::abs(pose.scale - 1) * 100, pose.scale > 1 ? "large" : "small"));
  }
  if (pose.disagreement > limits.max_disagreement) {
    return refused(fmt::format(
        "panel {}'s tags {} do not lie as they were scanned, by up to {:.2f} mm ({:.2f} are allowed), and too few are "
        "seen to tell which one has moved: press the panel flat, clear what covers the other tags, or scan it again",
        pose.panel.value, list(pose.tags), pose.disagreement->count(), limits.max_disagreement.count()));
  }
  if (pose.rms > limits.max_rms || pose.max > limits.max_single) {
    return refused(
        fmt::format("panel {}'s tags fit to {:.2f} mm rms, {:.2f} mm at worst (tag {}); {:.2f} rms and {:.2f} "
                    "are allowed: press the panel flat, check that tag, or calibrate the camera again",
                    pose.panel.value, pose.rms.count(), pose.max.count(), worst_tag(corners, pose.bed_from_panel),
                    limits.max_rms.count(), limits.max_single.count()));
  }
  if (pose.other_hand_rms < limits.min_other_hand_rms || pose.other_hand_rms < pose.rms * limits.min_hand_ratio) {
    return refused(
        fmt::format("the tags seen of panel {} do not tell which way up it lies ({:.2f} mm against {:.2f}): "
                    "clear what covers the other tags",
                    pose.panel.value, pose.rms.count(), pose.other_hand_rms.count()));
  }
  const bool back_up = pose.face_up == Face::kBack;
  if (back_up != (pose.bed_from_panel.handedness() == Handedness::kImproper)) {
    return refused(
        fmt::format("panel {} shows the tags of its {}, but they lie the other way round: its registration is "
                    "wrong, scan both faces again",
                    pose.panel.value, face_words(pose.face_up)));
  }
  return Ok();
}

}  // namespace

Result<BedPose> locate_panel(std::span<const Tag<CameraFrame>> seen, const CameraModel& model, Millimetres height,
                             std::span<const PanelCandidate> candidates, const BedPoseLimits& limits) {
  const Sorted sorted = sort_out(seen, candidates);
  if (const Status one = one_panel_only(sorted, limits); !one.ok()) return one.error();

  const auto& [key, tags] = *sorted.groups.begin();
  BedPose pose;
  pose.panel = key.first->panel, pose.face_up = key.second;
  Corners corners;
  for (const auto& [picture_tag, panel_tag] : tags) {
    for (std::size_t i = 0; i < 4; ++i) {
      corners.bed.push_back(model.bed_from_camera(picture_tag->corners[i], height));
      corners.panel.push_back(panel_tag->corners[i]);
      corners.tag.push_back(panel_tag->id);
    }
  }
  Handedness hand = Handedness::kProper;
  if (rms_of(corners, Handedness::kImproper) < rms_of(corners, hand)) hand = Handedness::kImproper;
  leave_out_moved(corners, hand, limits, pose);

  const std::span<const Point<BedFrame>> bed(corners.bed);
  const std::span<const Point<PanelFrame>> panel(corners.panel);
  const auto fitted = [&](Handedness h) { return fit_isometry<BedFrame, PanelFrame>(bed, panel, h); };
  pose.bed_from_panel = fitted(hand);
  const FitResidual best = residual_of(pose.bed_from_panel, bed, panel);
  const FitResidual other =
      residual_of(fitted(hand == Handedness::kProper ? Handedness::kImproper : Handedness::kProper), bed, panel);
  pose.rms = Millimetres(best.rms), pose.max = Millimetres(best.max), pose.other_hand_rms = Millimetres(other.rms);
  pose.scale = spread_of(bed) / spread_of(pose.bed_from_panel * corners.panel);
  // Judged as a flat sheet of the height given; then laid as it really is.
  if (const Status good = within_limits(pose, corners, limits); !good.ok()) return good.error();
  pose.bed_from_panel = fit_lifted(rays_to(tags, pose.tags, model, height), pose.bed_from_panel);
  return pose;
}

std::string moved_tags_text(const BedPose& pose) {
  std::string tags;
  for (const FiducialOffset& tag : pose.moved)
    tags += fmt::format("{}{} ({:.2f} mm off)", tags.empty() ? "" : " and ", name_of(tag), tag.off.count());
  std::string unsure = !pose.disagreement
                           ? ""
                           : fmt::format(
                                 "panel {}'s tags {} do not lie as they were scanned, by up to {:.2f} mm, and "
                                 "nobody can tell which one has moved: press the panel flat, and clear what "
                                 "covers its other tags",
                                 pose.panel.value, list(pose.tags), pose.disagreement->count());
  if (tags.empty()) return unsure;
  const bool one = pose.moved.size() == 1;
  return (unsure.empty() ? unsure : unsure + "; and ") +
         fmt::format(
             "panel {}'s {} {} not seen where the scans saw {}, and count{} for nothing: wipe {} clean; what came "
             "loose is "
             "replaced by a tag with a new number, scanned with --retag",
             pose.panel.value, tags, one ? "is" : "are", one ? "it" : "them", one ? "s" : "", one ? "it" : "them");
}

}  // namespace veneer::calib
