#include "drivers/sim/proof/assembly.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/sim/light.h"
#include "drivers/sim/proof/parallel.h"
#include "drivers/sim/proof/picture_proof.h"

namespace veneer::proof {
namespace {

constexpr double kQuarter = 1.5707963267948966;
// mm: shapes that fit this much worse than the best are still the same shape. True ones fit within 0.005 of each other;
// at 0.06 a piece of the demo (seed 5950615) lay with a half turn too much, beside gaps of 0.3 mm.
constexpr double kShapeSlack = 0.03;
constexpr double kFitsNowhere = 0.12;    // mm: worse than a cut's errors, so that other turns are tried
constexpr int kTurns = 24;               // a mark may be turned on its piece, in steps of 15 degrees
constexpr double kMirrorMargin = 0.3;    // in correlation
constexpr double kDustBlur = 0.15;       // mm around dust that the scanner's and the preview's pixels blur it over
const cv::Scalar kMissing(255, 0, 255);  // what a preview shows where no wood was found
const cv::Scalar kTable(40, 40, 40);     // seen through gaps
constexpr int kFiner = 4;                // joints are narrower than a pixel: edges are drawn this much finer

struct Fit {
  Rigid artwork_from_sheet;
  double rms = 0;
};

// Turns the contour onto the outline: point to line, a few steps from a start that is about right.
Fit fit_contour(const std::vector<Vec2>& contour, const Ring& outline, double angle) {
  Fit fit;
  fit.artwork_from_sheet = Rigid::turn(angle);
  fit.artwork_from_sheet.shift = ring_centroid(outline) - fit.artwork_from_sheet.turned(ring_centroid(contour));
  const std::size_t step = std::max<std::size_t>(1, contour.size() / 240);
  for (int round = 0; round < 12; ++round) {
    const Vec2 centre = fit.artwork_from_sheet(ring_centroid(contour));
    cv::Matx33d normal = cv::Matx33d::zeros();
    cv::Vec3d right(0, 0, 0);
    double squares = 0;
    double count = 0;
    for (std::size_t i = 0; i < contour.size(); i += step) {
      const Vec2 p = fit.artwork_from_sheet(contour[i]);
      const Nearest near = nearest_on_ring(outline, p);
      const Vec2 n{-near.along.y, near.along.x};
      const double off = (near.point.x - p.x) * n.x + (near.point.y - p.y) * n.y;
      const Vec2 arm = p - centre;
      const cv::Vec3d j(n.x, n.y, n.y * arm.x - n.x * arm.y);
      normal += j * j.t();
      right += j * off;
      squares += near.distance * near.distance;
      count += 1;
    }
    fit.rms = std::sqrt(squares / count);
    cv::Vec3d move;
    if (!cv::solve(normal, right, move, cv::DECOMP_CHOLESKY)) break;
    Rigid change = Rigid::turn(move[2]);
    change.shift = centre - change.turned(centre) + Vec2{move[0], move[1]};
    fit.artwork_from_sheet = change * fit.artwork_from_sheet;
    if (std::hypot(move[0], move[1]) < 1e-4 && std::abs(move[2]) < 1e-5) break;
  }
  return fit;
}

struct Laid {
  std::size_t as = 0;
  Fit fit;
  bool mirrored = false;
  cv::Rect box;      // on the canvas
  cv::Mat colour;    // BGR over the box, the wood as it grew
  cv::Mat burnt;     // the same with what the beam browned
  cv::Mat mask;      // 255 = the pixel's centre lies on this piece's wood
  cv::Mat cover;     // 0 to 255: the pixel's share of this piece's wood
  Vec2 centre_px{};  // of its place's outline
  Vec2 half_px{};
};

struct Canvas {
  double px_per_mm = 0, height_mm = 0;
  cv::Size size;

  Vec2 pixel(Vec2 mm) const { return {mm.x * px_per_mm, (height_mm - mm.y) * px_per_mm}; }
};

void box_of(const std::vector<Vec2>& points, Vec2& low, Vec2& high) {
  low = high = points.front();
  for (const Vec2& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
}

// Paints the piece's true front as it lies.
void paint(const FoundPiece& piece, const Canvas& canvas, Laid& laid) {
  std::vector<Vec2> edge;
  edge.reserve(piece.cut->contour.size());
  for (const Vec2& p : piece.cut->contour) edge.push_back(canvas.pixel(laid.fit.artwork_from_sheet(p)));
  Vec2 low;
  Vec2 high;
  box_of(edge, low, high);
  laid.box = cv::Rect(static_cast<int>(std::floor(low.x)) - 1, static_cast<int>(std::floor(low.y)) - 1,
                      static_cast<int>(high.x - low.x) + 4, static_cast<int>(high.y - low.y) + 4);
  laid.mask = cv::Mat(laid.box.size(), CV_8UC1, cv::Scalar(0));
  for (Vec2& p : edge) p = p - Vec2{static_cast<double>(laid.box.x), static_cast<double>(laid.box.y)};
  fill_ring(laid.mask, edge, 255);
  for (Vec2& p : edge) p = p * kFiner;
  cv::Mat finer(laid.box.size() * kFiner, CV_8UC1, cv::Scalar(0));
  fill_ring(finer, edge, 255);
  cv::resize(finer, laid.cover, laid.box.size(), 0, 0, cv::INTER_AREA);
  // box pixel (centres from 0, as warpAffine counts) -> artwork -> sheet -> the sheet's raster
  const Rigid back = laid.fit.artwork_from_sheet.inverse();
  const auto raster = [&](double column, double row) {
    const Vec2 artwork{(laid.box.x + column + 0.5) / canvas.px_per_mm,
                       canvas.height_mm - (laid.box.y + row + 0.5) / canvas.px_per_mm};
    return piece.sheet->pixel(back(artwork)) - Vec2{0.5, 0.5};
  };
  const Vec2 o = raster(0, 0);
  const Vec2 u = raster(1, 0) - o;
  const Vec2 v = raster(0, 1) - o;
  const cv::Matx23d map(u.x, v.x, o.x, u.y, v.y, o.y);
  const auto as_it_lies = [&](const cv::Mat& face) {
    cv::Mat out;
    cv::warpAffine(face, out, map, laid.box.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    return out;
  };
  laid.colour = as_it_lies(piece.sheet->front);
  laid.burnt = laid.colour.clone();
  const cv::Mat browned = as_it_lies(piece.sheet->engraved_front);
  laid.burnt.forEach<cv::Vec3b>([&](cv::Vec3b& wood, const int* at) {
    if (const unsigned char how_much = browned.at<unsigned char>(at); how_much > 0)
      wood = cv::Vec3b(sim::burnt_colour(wood, how_much));
  });
}

cv::Mat colour_integral(const cv::Mat& colour, const cv::Mat& mask) {
  cv::Mat inside = colour.clone();
  inside.setTo(cv::Scalar(0, 0, 0), mask == 0);
  cv::Mat table;
  cv::integral(inside, table, CV_64F);
  return table;
}

struct Place {
  Vec2 centre_px{}, half_px{};
};

Place place_of(const ClaimedPiece& piece, const Canvas& canvas) {
  Vec2 low;
  Vec2 high;
  box_of(piece.artwork_outline, low, high);
  return {canvas.pixel((low + high) * 0.5), (high - low) * (canvas.px_per_mm / 2)};
}

// Takes the dust that lay on the piece's wood out of `mask`, whose first pixel is the canvas's `corner`; whether any
// did.
bool without_dust(const ClaimedPiece& piece, const DustOnPanels& dust, const Canvas& canvas, Vec2 corner,
                  cv::Mat& mask) {
  const auto on_panel = dust.find(piece.panel);
  if (on_panel == dust.end()) return false;
  const auto artwork_from_panel = fit_rigid(piece.panel_outline, piece.artwork_outline);
  if (!artwork_from_panel) return false;
  const int before = cv::countNonZero(mask);
  for (const PanelDust& grain : on_panel->second) {
    const auto pixel = [&](Vec2 p) { return canvas.pixel((*artwork_from_panel)(p)) - corner; };
    for (std::size_t i = 0; i < grain.line.size(); ++i)
      fill_capsule(mask, pixel(grain.line[i == 0 ? 0 : i - 1]), pixel(grain.line[i]),
                   (grain.radius_mm + kDustBlur) * canvas.px_per_mm, 0);
  }
  return cv::countNonZero(mask) < before;
}

BlockMeans blocks_of(const Laid& laid, const cv::Mat& mask, const Canvas& canvas) {
  cv::Mat inside;
  cv::integral(mask, inside, CV_64F);
  const Vec2 centre = laid.centre_px - Vec2{static_cast<double>(laid.box.x), static_cast<double>(laid.box.y)};
  return {colour_integral(laid.colour, mask), inside / 255.0, centre, laid.half_px, canvas.px_per_mm};
}
BlockMeans blocks_of(const Laid& laid, const Canvas& canvas) { return blocks_of(laid, laid.mask, canvas); }

// But for what dust hides of its place's preview.
BlockMeans blocks_seen_of(const Laid& laid, const ClaimedPiece& place, const DustOnPanels& dust, const Canvas& canvas) {
  cv::Mat mask = laid.mask.clone();
  without_dust(place, dust, canvas, {static_cast<double>(laid.box.x), static_cast<double>(laid.box.y)}, mask);
  return blocks_of(laid, mask, canvas);
}

struct PlannedLook {
  BlockMeans blocks;
  bool under_dust = false;
};

// The piece's part of the preview: what lies within its outline and shows wood.
PlannedLook preview_of(const ClaimedPiece& piece, const Canvas& canvas, const cv::Mat& preview,
                       const DustOnPanels& dust) {
  const Place place = place_of(piece, canvas);
  const Vec2 low = place.centre_px - place.half_px, high = place.centre_px + place.half_px;
  const cv::Rect box = cv::Rect(static_cast<int>(std::floor(low.x)) - 1, static_cast<int>(std::floor(low.y)) - 1,
                                static_cast<int>(high.x - low.x) + 4, static_cast<int>(high.y - low.y) + 4) &
                       cv::Rect({}, preview.size());
  const Vec2 corner{static_cast<double>(box.x), static_cast<double>(box.y)};
  std::vector<Vec2> ring;
  for (const Vec2& p : piece.artwork_outline) ring.push_back(canvas.pixel(p) - corner);
  cv::Mat mask(box.size(), CV_8UC1, cv::Scalar(0)), inside;
  fill_ring(mask, ring, 255);
  const bool under_dust = without_dust(piece, dust, canvas, corner, mask);
  cv::integral(mask, inside, CV_64F);
  return {
      {colour_integral(preview(box), mask), inside / 255.0, place.centre_px - corner, place.half_px, canvas.px_per_mm},
      under_dust};
}

std::vector<Vec2> flipped(std::vector<Vec2> ring) {
  for (Vec2& p : ring) p.x = -p.x;
  std::reverse(ring.begin(), ring.end());
  return ring;
}

// The mark's up, seen on the back, is the artwork's up; on the back x runs the other way.
double upright_turn(const ReadMark& mark) {
  const Vec2 up{-mark.up.x, mark.up.y};
  return std::atan2(1.0, 0.0) - std::atan2(up.y, up.x);
}

Laid lay(const FoundPiece& piece, const ClaimedJob& job, const Canvas& canvas, const cv::Mat& preview,
         const DustOnPanels& dust) {
  Laid laid;
  laid.as = *piece.laid_as;
  const ClaimedPiece& patch = job.pieces[laid.as];
  const double upright = upright_turn(*piece.mark);
  std::vector<Fit> fits;
  double best_rms = 1e9;
  const auto try_turn = [&](int turn) {
    fits.push_back(fit_contour(piece.cut->contour, patch.artwork_outline, upright + turn * 4 * kQuarter / kTurns));
    best_rms = std::min(best_rms, fits.back().rms);
  };
  for (int turn = 0; turn < kTurns; turn += kTurns / 4) try_turn(turn);
  for (int turn = 0; turn < kTurns && best_rms > kFitsNowhere; ++turn)
    if (turn % (kTurns / 4) != 0) try_turn(turn);
  laid.fit = fits[0];
  const Place place = place_of(patch, canvas);
  laid.centre_px = place.centre_px;
  laid.half_px = place.half_px;
  if (canvas.px_per_mm > 0) paint(piece, canvas, laid);
  if (fits[0].rms > best_rms + kShapeSlack) {
    double best = -2;
    for (const Fit& fit : fits) {
      if (fit.rms > best_rms + kShapeSlack) continue;
      Laid other = laid;
      other.fit = fit;
      double agreement = 0;
      if (canvas.px_per_mm > 0) {
        paint(piece, canvas, other);
        agreement = blocks_seen_of(other, patch, dust, canvas)
                        .with(preview_of(patch, canvas, preview, dust).blocks)
                        .correlation;
      }
      if (agreement <= best) continue;
      best = agreement;
      laid = std::move(other);
    }
  }
  const double mirror_rms =
      fit_contour(flipped(piece.cut->contour), patch.artwork_outline,
                  -std::atan2(laid.fit.artwork_from_sheet.sine, laid.fit.artwork_from_sheet.cosine))
          .rms;
  laid.mirrored = piece.mark->mirrored || (laid.fit.rms > 0.4 && mirror_rms < laid.fit.rms / 2);
  return laid;
}

// Judges the pictures of the laid pieces against the preview.
void judge_pictures(const ClaimedJob& job, const Canvas& canvas, const cv::Mat& preview, const DustOnPanels& dust,
                    std::vector<Laid>& laid, int threads, JobProof& proof) {
  std::vector<BlockMeans> places;
  for (const ClaimedPiece& piece : job.pieces) {
    PlannedLook look = preview_of(piece, canvas, preview, dust);
    places.push_back(std::move(look.blocks));
    if (look.under_dust) ++proof.pieces_under_dust;
  }
  std::vector<int> looks_like(laid.size(), -1);
  std::vector<char> greyly_elsewhere(laid.size(), 0), beyond_chance(laid.size(), 0);  // threads write side by side
  parallel_for(laid.size(), threads, [&](std::size_t i, int) {
    const BlockMeans mine = blocks_of(laid[i], canvas);
    const BlockMeans seen = blocks_seen_of(laid[i], job.pieces[laid[i].as], dust, canvas);
    const BlockMeans& place = places[laid[i].as];
    auto best = seen.with(place);
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (k == laid[i].as || job.pieces[k].panel.empty()) continue;
      const auto rivals = mine.rivals(places[k], place, seen);
      if (!rivals) continue;
      if (rivals->other.correlation > rivals->own.correlation) greyly_elsewhere[i] = 1;
      if (rivals->other_is_nearer_than_by_chance()) beyond_chance[i] = 1;
      if (!rivals->other_is_nearer() || (looks_like[i] >= 0 && rivals->other.in_colour <= best.in_colour)) continue;
      best = rivals->other;
      looks_like[i] = static_cast<int>(k);
    }
    const auto turned_over = mine.rather(place.mirrored(), place, seen);
    if (!turned_over) return;
    const auto& [own, mirror] = *turned_over;
    const bool clear = mirror.correlation > std::max(own.correlation + kMirrorMargin, best.correlation);
    if (clear && mirror.difference < best.difference) laid[i].mirrored = true;
  });
  proof.wrong_by_correlation = static_cast<std::size_t>(std::ranges::count(greyly_elsewhere, 1));
  for (std::size_t i = 0; i < laid.size(); ++i) {
    if (looks_like[i] < 0 || laid[i].mirrored) continue;
    ++proof.wrong_pieces;
    if (beyond_chance[i] != 0) ++proof.wrong_beyond_chance;
    proof.notes.push_back("piece " + job.pieces[laid[i].as].mark + " looks like " +
                          job.pieces[static_cast<std::size_t>(looks_like[i])].mark +
                          (beyond_chance[i] != 0 ? "" : ", but may do so by chance"));
  }
}

// Adds `colour` times its share of each pixel.
void lay_on(cv::Mat picture, cv::Mat cover, const cv::Mat& colour, const cv::Mat& share) {
  cv::Mat shares, part;
  cv::cvtColor(share, shares, cv::COLOR_GRAY2BGR);
  cv::multiply(colour, shares, part, 1 / 255.0);
  picture += part;
  cover += share;
}

Assembled assemble(const ClaimedJob& job, const Canvas& canvas, const std::vector<Laid>& laid) {
  Assembled out{cv::Mat(canvas.size, CV_8UC3, cv::Scalar::all(0)), cv::Mat(canvas.size, CV_8UC1, cv::Scalar(0))};
  for (const ClaimedPiece& piece : job.pieces) {
    if (!piece.panel.empty()) continue;
    cv::Mat patch(canvas.size, CV_8UC1, cv::Scalar(0));
    std::vector<Vec2> ring;
    for (const Vec2& p : piece.artwork_outline) ring.push_back(canvas.pixel(p));
    fill_ring(patch, ring, 255);
    lay_on(out.picture, out.cover, cv::Mat(canvas.size, CV_8UC3, kMissing), patch);
  }
  for (const Laid& piece : laid) {
    const cv::Rect visible = piece.box & cv::Rect({}, canvas.size);
    if (visible.empty()) continue;
    const cv::Rect part(visible.x - piece.box.x, visible.y - piece.box.y, visible.width, visible.height);
    lay_on(out.picture(visible), out.cover(visible), piece.burnt(part), piece.cover(part));
  }
  cv::Mat nothing = out.cover.clone();
  lay_on(out.picture, nothing, cv::Mat(canvas.size, CV_8UC3, kTable), 255 - out.cover);
  return out;
}

// Distances of the true edge from the planned one, on the panel.
ResidualSum edge_errors(const FoundPiece& piece, const ClaimedPiece& claimed) {
  ResidualSum sum;
  for (const Vec2& p : piece.cut->contour)
    sum.add(nearest_on_ring(claimed.panel_outline, piece.panel_from_sheet(p)).distance);
  return sum;
}

Residual edge_of_all(const ClaimedJob& job, const std::vector<FoundPiece>& found, int threads) {
  std::vector<ResidualSum> edges(found.size());
  parallel_for(found.size(), threads,
               [&](std::size_t i, int) { edges[i] = edge_errors(found[i], job.pieces[found[i].cut_as]); });
  ResidualSum edge;
  for (const ResidualSum& e : edges) edge.add(e);
  return edge.result();
}

// Whether a hole of the sheet lies within this outline: a rim that grazes it by less than edges err is none.
bool holds(const std::vector<Vec2>& outline, Vec2 centre, double diameter) {
  constexpr double kGrazed = 0.05;  // mm
  std::vector<cv::Point2f> edge;
  edge.reserve(outline.size());
  for (const Vec2& p : outline) edge.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y));
  const cv::Point2f at(static_cast<float>(centre.x), static_cast<float>(centre.y));
  return cv::pointPolygonTest(edge, at, true) > kGrazed - diameter / 2;
}

// A hole through the sheet that bites a piece's edge is a part of the cut-out's edge: the claimed one tells of it.
bool is_holed(const FoundPiece& piece, const ClaimedPiece& claimed) {
  return std::ranges::any_of(
             piece.sheet->screw_holes,
             [&](const sim::TrueHole& hole) { return holds(piece.cut->contour, hole.centre, hole.diameter_mm); }) ||
         std::ranges::any_of(piece.sheet->holes, [&](const sim::TrueHole& hole) {
           return holds(claimed.panel_outline, piece.panel_from_sheet(hole.centre), hole.diameter_mm);
         });
}

void count_holed(const ClaimedJob& job, const std::vector<FoundPiece>& found, JobProof& proof) {
  for (const FoundPiece& piece : found) {
    if (!is_holed(piece, job.pieces[piece.cut_as])) continue;
    ++proof.holed_pieces;
    proof.notes.push_back("the piece cut as " + job.pieces[piece.cut_as].mark + " has a hole of the panel in it");
  }
}

// The pieces whose mark names a patch; the others are entered as unreadable.
std::vector<std::size_t> readable_pieces(const ClaimedJob& job, const std::vector<FoundPiece>& found, JobProof& proof) {
  std::vector<std::size_t> readable;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].laid_as) {
      readable.push_back(i);
      continue;
    }
    ++proof.unreadable_ids;
    proof.notes.push_back("the piece cut as " + job.pieces[found[i].cut_as].mark + " bears " +
                          (found[i].mark ? "'" + found[i].mark->text + "'" : "no readable mark"));
  }
  return readable;
}

}  // namespace

DustOnPanels dust_on_panels(const std::vector<Tie>& ties, const Truth& truth) {
  DustOnPanels out;
  for (const Tie& tie : ties)
    for (const ClaimedLattice& lattice : tie.panel->registration) {
      const auto capture = truth.captures.find(lattice.capture);
      if (capture == truth.captures.end()) continue;
      const sim::ScanTruth& scan = capture->second;
      if (scan.sheet != tie.sheet->name || scan.face != sim::SheetFace::kShow) continue;
      for (const sim::Dust& grain : scan.dust) {
        PanelDust& on_panel = out[tie.panel->id].emplace_back();
        on_panel.radius_mm = grain.radius_px / scan.px_per_mm;
        for (const Vec2& p : grain.line) on_panel.line.push_back(tie.panel_from_sheet(scan.sheet_mm(p)));
      }
    }
  return out;
}

JobProof prove_job(const ClaimedJob& job, const std::vector<FoundPiece>& found, const DustOnPanels& dust, int threads) {
  JobProof proof;
  proof.cut = found.size();
  for (const ClaimedPiece& piece : job.pieces) {
    if (!piece.panel.empty()) ++proof.pieces;
    if (piece.state == "suspect") ++proof.suspect;
  }
  proof.edge = edge_of_all(job, found, threads);
  count_holed(job, found, proof);

  Canvas canvas;
  if (!job.preview_file.empty()) {
    proof.preview = cv::imread(job.preview_file.string(), cv::IMREAD_COLOR);
    if (proof.preview.empty()) proof.notes.push_back("there is no preview " + job.preview_file.string());
  }
  if (!proof.preview.empty()) {
    // It covers the artwork but for what whole pixels leave over, up to half a one: told of the resolution, pieces at
    // the far end lie where the preview shows them. What is told has to be its own.
    const auto rounds_to = [&](double mm, int pixels) {
      return std::abs(job.preview_px_per_mm * mm - pixels) <= 0.5 + 1e-6;
    };
    const bool told = rounds_to(job.width_mm, proof.preview.cols) && rounds_to(job.height_mm, proof.preview.rows);
    canvas.px_per_mm = told ? job.preview_px_per_mm : proof.preview.cols / job.width_mm;
    canvas.height_mm = job.height_mm;
    canvas.size = proof.preview.size();
  }

  const std::vector<std::size_t> readable = readable_pieces(job, found, proof);
  std::vector<Laid> laid(readable.size());
  parallel_for(readable.size(), threads,
               [&](std::size_t i, int) { laid[i] = lay(found[readable[i]], job, canvas, proof.preview, dust); });
  if (!proof.preview.empty()) {
    judge_pictures(job, canvas, proof.preview, dust, laid, threads, proof);
    const Assembled assembled = assemble(job, canvas, laid);
    proof.assembled = assembled.picture;
    proof.picture_ssim = picture_ssim(assembled.picture, proof.preview, job.width_mm, job.height_mm);
    proof.picture_ssim_joints_filled =
        picture_ssim_joints_filled(assembled, kTable, proof.preview, job.width_mm, job.height_mm);
  }
  for (const Laid& piece : laid) {
    if (!piece.mirrored) continue;
    ++proof.mirrored_pieces;
    proof.notes.push_back("piece " + job.pieces[piece.as].mark + " is mirrored");
  }
  return proof;
}

}  // namespace veneer::proof
