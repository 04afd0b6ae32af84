#include "daemon/stock/mask_painter.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string_view>

#include "base/clock.h"
#include "base/hash.h"
#include "daemon/orders/panel_wood.h"
#include "daemon/stock/area_book.h"

namespace veneer::daemon {
namespace {

// As the mask itself keeps where nothing else is configured ([mask]): what a hand gives may be nearer than that.
constexpr Millimetres kFiducialMargin{1.5}, kEdgeMargin{0.5}, kHoleRadius{3};

Raster<PanelFrame> like(const Raster<PanelFrame>& mask, unsigned char value) {
  return {cv::Mat(mask.pixels.size(), CV_8UC1, cv::Scalar(value)), mask.resolution, mask.origin};
}

// The pixels that `area` may touch.
cv::Rect box_in(const Raster<PanelFrame>& whole, const Region<PanelFrame>& area) {
  constexpr int kBorder = 4;  // pixels: of lines that are drawn along outlines
  const auto box = area.box();
  double left = 0, top = 0, right = 0, bottom = 0;
  whole.to_pixels({box.min.x, box.max.y}, left, top);
  whole.to_pixels({box.max.x, box.min.y}, right, bottom);
  const cv::Point from(cvFloor(left) - kBorder, cvFloor(top) - kBorder),
      to(cvCeil(right) + kBorder, cvCeil(bottom) + kBorder);
  return cv::Rect(from, to) & cv::Rect({0, 0}, whole.pixels.size());
}

// Pixels that lie in `area` whole: all that is left where what lies beside it is taken away, border pixels too.
cv::Mat inside_of(const Raster<PanelFrame>& mask, const Region<PanelFrame>& area) {
  const Millimetres beyond(5);
  const auto left = mask.origin.x - beyond, low = mask.origin.y - beyond, right = mask.origin.x + mask.width() + beyond,
             high = mask.origin.y + mask.height() + beyond;
  const Region<PanelFrame> place(Ring<PanelFrame>{{left, low}, {right, low}, {right, high}, {left, high}});
  return free_wood(like(mask, 255), {subtract(place, area)}, Millimetres(0)).pixels;
}

// Of sides that follow each other only what they share is a corner, and is not counted.
int crossings_of(const Ring<PanelFrame>& ring, int most) {
  const auto side_of = [](const Point<PanelFrame>& a, const Point<PanelFrame>& b, const Point<PanelFrame>& p) {
    return (b.x - a.x).count() * (p.y - a.y).count() - (b.y - a.y).count() * (p.x - a.x).count();
  };
  const auto next = [&](std::size_t i) -> const Point<PanelFrame>& { return ring[(i + 1) % ring.size()]; };
  int crossings = 0;
  for (std::size_t i = 0; i < ring.size() && crossings <= most; ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (side_of(ring[i], next(i), ring[k]) * side_of(ring[i], next(i), next(k)) < 0 &&
          side_of(ring[k], next(k), ring[i]) * side_of(ring[k], next(k), next(i)) < 0)
        ++crossings;
  return crossings;
}

// What a mask is made of, as a name: the file, what is never given, and the edits, all but the last `without`.
std::string made_of(const std::string& seen_file, const MaskPaint& paint, std::size_t without) {
  std::string all = seen_file;
  const auto add = [&all](std::string_view kind, const Region<PanelFrame>& area) {
    all += kind;
    for (const auto& ring : area.micro_area().rings) {
      const auto bytes = std::as_bytes(std::span(ring));
      all += ';';
      all.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }
  };
  for (const auto& area : paint.spared) add("spared", area);
  for (const auto& area : paint.gone) add("gone", area);
  for (std::size_t i = 0; i + without < paint.edits.size(); ++i)
    add(paint.edits[i].give ? "give" : "withhold", paint.edits[i].shape);
  return sha256_hex(std::as_bytes(std::span(all)));
}

// Refused before anything is drawn.
Status check_bounds(const PanelId& panel, const std::vector<db::MaskEdit>& edits) {
  std::size_t corners = 0;
  for (const auto& edit : edits) corners += micro::corners_of(edit.shape.micro_area());
  if (edits.size() <= db::kMostMaskEdits && corners <= db::kMostMaskEditCorners) return Ok();
  const std::string bound = edits.size() > db::kMostMaskEdits
                                ? fmt::format("{} edits", db::kMostMaskEdits)
                                : fmt::format("edits of {} corners", db::kMostMaskEditCorners);
  return Error{ErrorCode::kConflict,
               fmt::format("the mask of panel {} takes {} in all, and with this one there would be more: take some "
                           "back (Painted by hand, or `veneerctl panel mask {} --list`), and paint their places with "
                           "fewer, wider strokes",
                           panel.value, bound, panel.value)};
}

struct Before {
  db::PanelRecord panel;
  std::vector<db::MaskRecord> masks;  // newest first
};

Result<Before> read_before(Repositories& r, const PanelId& id) {
  auto panel = r.panels.find(id);
  if (!panel) return panel.error();
  if (panel->retired)
    return Error{ErrorCode::kConflict,
                 fmt::format("panel {0} was retired ({1}): run `veneerctl panel restore {0}` first", id.value,
                             panel->retired->reason)};
  auto masks = r.panels.masks(id);
  if (!masks) return masks.error();
  return Before{std::move(*panel), std::move(*masks)};
}

// The mask that counts, made anew with this paint.
Result<db::MaskRecord> repainted(const PanelLibrary& library, const db::MaskRecord& seen, const PanelId& panel,
                                 const MaskPaint& paint) {
  const auto made = painted_mask(library, panel, seen.seen_file, paint);
  if (!made) return made.error();
  return db::MaskRecord{0, seen.map_file, made->file, seen.map_hash, utc_timestamp(), made->usable, seen.seen_file};
}

// Of rings that may cross themselves, as a hand draws them.
Region<PanelFrame> on_panel(const Region<PanelFrame>& shape, const db::PanelRecord& panel) {
  return intersect(unite(shape, {}), whole_panel(panel.width, panel.height));
}

Result<EditedMask> done(const PanelLibrary& library, const Before& before, const db::MaskRecord& made) {
  const auto usable = library.usable_area(before.panel);
  if (!usable) return usable.error();
  library.drop_mask(before.panel.id, before.panel.mask_file);
  library.make_small(made.map_file, made.mask_file);
  return EditedMask{{}, before.panel.mask_version + 1, *usable, made.usable.value_or(*usable), {}};
}

}  // namespace

Result<Region<PanelFrame>> outlined(const Ring<PanelFrame>& corners) {
  if (crossings_of(corners, kMostCrossings) > kMostCrossings)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("this outline crosses itself more than {} times: draw it in parts", kMostCrossings)};
  return Region<PanelFrame>(corners);
}

Region<PanelFrame> disc(const Point<PanelFrame>& centre, Millimetres radius) {
  const Millimetres half = radius * 0.1;  // of the side of a square that is grown
  const Region<PanelFrame> middle(Ring<PanelFrame>{{centre.x - half, centre.y - half},
                                                   {centre.x + half, centre.y - half},
                                                   {centre.x + half, centre.y + half},
                                                   {centre.x - half, centre.y + half}});
  return offset(middle, radius - half, Corners::kRound);
}

std::vector<Region<PanelFrame>> spared_by(const std::vector<db::FiducialRecord>& fiducials) {
  std::vector<Region<PanelFrame>> out;
  for (const auto& fiducial : fiducials) {
    // The other face's tags are in nobody's way.
    if (fiducial.kind == db::FiducialKind::kTag && fiducial.face == Face::kBack) continue;
    if (fiducial.kind == db::FiducialKind::kTag) {
      out.push_back(offset(unite(Region<PanelFrame>(fiducial.corners), {}), kFiducialMargin));
      continue;
    }
    // As far as a hole's margin always was.
    out.push_back(disc(fiducial.corners.front(), kHoleRadius * 1.1 + kFiducialMargin));
  }
  return out;
}

Result<MaskPaint> paint_of(Repositories& r, const PanelId& panel) {
  auto edits = r.masks.counting(panel);
  if (!edits) return edits.error();
  const auto fiducials = r.panels.fiducials(panel);
  if (!fiducials) return fiducials.error();
  MaskPaint out{std::move(*edits), spared_by(*fiducials), {}};
  const auto differences = r.differences.of(panel);
  if (!differences) return differences.error();
  for (const auto& difference : *differences)
    if (difference.gone && !difference.decision) out.gone.push_back(difference.shape);
  return out;
}

Raster<PanelFrame> painted(const Raster<PanelFrame>& seen, const MaskPaint& paint) {
  Raster<PanelFrame> out{seen.pixels.clone(), seen.resolution, seen.origin};
  std::vector<Region<PanelFrame>> never = paint.spared;
  for (const auto& gone : paint.gone) never.push_back(offset(gone, kEdgeMargin));
  cv::Mat allowed;  // of the whole: lines that were cut at a part's border would be drawn otherwise
  if (std::ranges::any_of(paint.edits, &db::MaskEdit::give))
    allowed = free_wood(like(seen, 255), never, Millimetres(0)).pixels;
  for (const db::MaskEdit& edit : paint.edits) {
    const cv::Rect where = box_in(out, edit.shape);
    if (where.empty()) continue;
    const Raster<PanelFrame> part{out.pixels(where), out.resolution, out.from_pixels(where.x, where.br().y)};
    if (edit.give)
      cv::bitwise_or(part.pixels, inside_of(part, edit.shape) & allowed(where), part.pixels);
    else
      free_wood(part, {edit.shape}, Millimetres(0)).pixels.copyTo(part.pixels);
  }
  return out;
}

Result<PanelLibrary::PaintedMask> painted_mask(const PanelLibrary& library, const PanelId& panel,
                                               const std::string& seen_file, const MaskPaint& paint) {
  const std::string name = made_of(seen_file, paint, 0);
  if (!paint.edits.empty())
    if (const auto known = library.painted_of(name)) return *known;
  const auto before = paint.edits.size() > 1 ? library.painted_of(made_of(seen_file, paint, 1)) : std::nullopt;
  auto mask = read_stored_raster(library.path_of(before ? before->file : seen_file));
  if (!mask) return mask.error();
  mask->pixels = mask->pixels != 0;
  if (paint.edits.empty()) return PanelLibrary::PaintedMask{seen_file, wood_area(*mask)};
  const auto made = painted(*mask, before ? MaskPaint{{paint.edits.back()}, paint.spared, paint.gone} : paint);
  const auto stored = library.store_picture(made.pixels, "panels/" + panel.value, "mask");
  if (!stored) return stored.error();
  const PanelLibrary::PaintedMask out{stored->file, wood_area(made)};
  library.remember_painted(name, out);
  return out;
}

Result<std::vector<db::PaintedEdit>> painted_edits(const PanelLibrary& library, const db::PanelRecord& panel,
                                                   const db::MaskRecord& scan, MaskPaint paint,
                                                   const std::vector<db::MaskEdit>& edits) {
  db::MaskRecord seen = scan;
  if (seen.seen_file.empty()) seen.seen_file = seen.mask_file;
  std::vector<db::PaintedEdit> out;
  for (db::MaskEdit edit : edits) {
    edit.shape = on_panel(edit.shape, panel);
    if (edit.shape.empty()) continue;
    paint.edits.push_back(edit);
    if (const Status bounded = check_bounds(panel.id, paint.edits); !bounded) return bounded.error();
    auto made = repainted(library, seen, panel.id, paint);
    if (!made) return made.error();
    out.push_back({std::move(edit), std::move(*made)});
  }
  return out;
}

Result<EditedMask> edit_mask(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                             const PanelId& panel, const db::MaskEdit& wanted, std::optional<int> painted_on) {
  const auto before = read_before(r, panel);
  if (!before) return before.error();
  if (painted_on && *painted_on != before->panel.mask_version)
    return Error{
        ErrorCode::kConflict,
        fmt::format("this was painted on version {} of the mask of panel {}, and version {} counts by now: look "
                    "whether it still fits, then save it again",
                    *painted_on, panel.value, before->panel.mask_version)};
  db::MaskEdit edit = wanted;
  edit.shape = on_panel(wanted.shape, before->panel);
  if (edit.shape.empty())
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the outline holds nothing of panel {}: give its corners in mm from the lower left corner "
                             "of the panel, three at least",
                             panel.value)};
  auto paint = paint_of(r, panel);
  if (!paint) return paint.error();
  paint->edits.push_back(edit);
  if (const Status bounded = check_bounds(panel, paint->edits); !bounded) return bounded.error();
  const auto made = repainted(library, before->masks.front(), panel, *paint);
  if (!made) return made.error();
  const auto id =
      database.call([&](Repositories& w) { return w.masks.add(panel, edit, *made, before->panel.mask_version); });
  if (!id) return id.error();
  auto out = done(library, *before, *made);
  if (!out) return out;
  out->edit = *id;
  if (edit.give) return out;
  auto live = r.ledger.live_allocations(panel);
  if (!live) return live.error();
  for (auto& allocation : *live)
    if (allocation.state == db::AllocationState::kReserved && overlaps(allocation.area, edit.shape))
      out->touched.push_back(std::move(allocation));
  return out;
}

Result<EditedMask> remove_mask_edit(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                                    const PanelId& panel, db::MaskEditId edit, const std::string& who) {
  const auto before = read_before(r, panel);
  if (!before) return before.error();
  auto paint = paint_of(r, panel);
  if (!paint) return paint.error();
  std::erase_if(paint->edits, [&](const db::MaskEdit& one) { return one.id == edit; });
  const auto made = repainted(library, before->masks.front(), panel, *paint);
  if (!made) return made.error();
  const Status removed = database.call([&](Repositories& w) {
    return w.masks.remove(panel, edit, who, utc_timestamp(), *made, before->panel.mask_version);
  });
  if (!removed) return removed.error();
  return done(library, *before, *made);
}

Result<EditedMask> revert_mask(Repositories& r, DatabaseThread& database, const PanelLibrary& library,
                               const PanelId& panel, std::optional<int> version, const std::string& who) {
  const auto before = r.panels.find(panel);
  if (!before) return before.error();
  const auto masks = r.panels.masks(panel);
  if (!masks) return masks.error();
  int wanted = version.value_or(0);
  if (!version) {
    // Of what counts now the first time it was seen, and the scan before that: going back twice goes back further.
    const db::MaskRecord& now = masks->front();
    for (const auto& mask : *masks)
      if (mask.map_file == now.map_file && mask.seen_file == now.seen_file) wanted = mask.version - 1;
    if (wanted == 0)
      return Error{
          ErrorCode::kConflict,
          fmt::format("panel {} counts as its first scan saw it: there is nothing to go back to", panel.value)};
  }
  auto paint = paint_of(r, panel);
  if (!paint) return paint.error();
  std::optional<db::Panels::Painted> with_edits;
  const auto target = std::ranges::find(*masks, wanted, &db::MaskRecord::version);
  if (target != masks->end() && !paint->edits.empty()) {
    // What later scans found gone is not open any more then.
    const auto open = r.differences.open_after(panel, wanted);
    if (!open) return open.error();
    paint->gone.clear();
    for (const auto& difference : *open)
      if (difference.gone) paint->gone.push_back(difference.shape);
    auto made = repainted(library, *target, panel, *paint);
    if (!made) return made.error();
    with_edits = db::Panels::Painted{std::move(*made), before->mask_version};
  }
  const auto now = database.call(
      [&](Repositories& w) { return w.panels.revert_mask(panel, wanted, utc_timestamp(), who, with_edits); });
  if (!now) return now.error();
  library.drop_index(panel);
  const auto after = database.call([&](Repositories& w) { return w.panels.find(panel); });
  if (!after) return after.error();
  const auto usable = library.usable_area(*after);
  const auto was = library.usable_area(*before);
  return EditedMask{{}, *now, was ? *was : SquareMillimetres(0), usable ? *usable : SquareMillimetres(0), {}};
}

}  // namespace veneer::daemon
