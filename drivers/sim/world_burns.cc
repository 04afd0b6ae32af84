// What the beam does to the sheet on the bed.
#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/sim/world.h"

namespace veneer::sim {
namespace {

constexpr double kThicknessOfThreshold = 2.1;  // mm; the through-energy is given for this
constexpr double kSpot = 0.2;                  // mm; what a beam at rest heats
constexpr double kPauseEndsStroke = 0.05;      // s of darkness
constexpr double kPlentyOfEnergy = 3.5;        // times what just cuts through: there the kerf is as wide as drawn

double seconds(TimePoint t) { return std::chrono::duration<double>(t.time_since_epoch()).count(); }

}  // namespace

std::vector<Carriage::Place> World::follow_locked(const HeadPosition& from, const HeadPosition& to) {
  const TwinSettings::Bed& bed = truth_.settings.bed;
  MachineAxes axes = truth_.axes;
  axes.x_scale += drift_.x_scale, axes.y_scale += drift_.y_scale;
  return carriage_.follow(axes, {bed.width_mm + from.x_mm, bed.height_mm + from.y_mm},
                          {bed.width_mm + to.x_mm, bed.height_mm + to.y_mm});
}

void World::burn(const BurnSegment& commanded) {
  const std::lock_guard lock(mutex_);
  const std::vector<Carriage::Place> way = follow_locked(commanded.from, commanded.to);
  const double begin = seconds(commanded.start), lasts = seconds(commanded.end) - begin;
  // While an axis takes up its play the carriage may stand still: that heat goes into the bit that follows.
  double energy = 0, since = 0, lost = 0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    energy += (way[i].share - way[i - 1].share) * commanded.power_seconds, lost += way[i].lost_mm;
    if (i + 1 < way.size() && length(way[i].bed - way[i - 1].bed) < 1e-6) continue;
    mark_locked(way[i - 1].bed, way[i].bed, {energy, lost}, begin + since * lasts, begin + way[i].share * lasts);
    energy = 0, since = way[i].share, lost = 0;
  }
}

void World::moved(const HeadPosition& from, const HeadPosition& to) {
  const std::lock_guard lock(mutex_);
  follow_locked(from, to);
}

void World::homed() {
  const std::lock_guard lock(mutex_);
  carriage_.homed(++pictures_["homing"]);
  if (Status s = save_locked(); !s.ok()) log_->error("{}", s.error().message);
}

// Of one place along the way, power-seconds per mm. What the beam gives while the carriage lags behind its motors heats
// all of the spot, however short the way is that the carriage itself goes meanwhile.
double World::energy_at(const Heat& heat, double path) {
  const double driven = path + heat.lost_mm;
  if (driven <= 1e-6) return heat.power_seconds / kSpot;
  return heat.power_seconds / driven * (1 + heat.lost_mm / kSpot);
}

void World::mark_locked(Vec2 from, Vec2 to, const Heat& heat, double begin_s, double end_s) {
  if (!on_bed_) return;
  const std::shared_ptr<Sheet>& sheet = sheets_.at(on_bed_->sheet);
  const TwinSettings::Laser& laser = truth_.settings.laser;
  const double energy = energy_at(heat, length(to - from));
  if (energy < laser.engrave_energy) return;
  const bool through = energy >= laser.through_energy * sheet->thickness_mm / kThicknessOfThreshold;
  const BurnDepth depth = through ? BurnDepth::kThrough : BurnDepth::kEngrave;
  const Vec2 a = on_bed_->pose.back_to_sheet(from), b = on_bed_->pose.back_to_sheet(to);
  const auto off = [&](Vec2 p) {
    return p.x < -1 || p.y < -1 || p.x > sheet->width_mm + 1 || p.y > sheet->height_mm + 1;
  };
  if (off(a) && off(b)) return;
  if (stroke_) {
    TrueBurn& open = stroke_->burn;
    const bool goes_on = stroke_->sheet == sheet && open.depth == depth && begin_s - open.end_s < kPauseEndsStroke &&
                         length(open.points.back() - a) < 1e-3;
    if (!goes_on) end_stroke_locked();
  }
  if (!stroke_) {
    stroke_ = std::make_unique<OpenStroke>();
    stroke_->sheet = sheet;
    stroke_->burn = begin_burn(*sheet, depth, a, energy);
    stroke_->burn.begin_s = begin_s;
  }
  TrueBurn& open = stroke_->burn;
  open.end_s = end_s;
  // Joins what is straight: the last point goes when it lies within half a micrometre of the chord.
  if (open.points.size() >= 2) {
    const Vec2 base = open.points[open.points.size() - 2], d = b - base, q = open.points.back() - base;
    const double chord = length(d), along = chord > 0 ? (q.x * d.x + q.y * d.y) / chord : -1;
    if (along >= 0 && along <= chord && std::abs(d.x * q.y - d.y * q.x) < 5e-4 * chord) open.points.pop_back();
  }
  open.points.push_back(b);
}

// As wide as the beam burns there: it goes with the energy, and with how far the wood lies out of focus.
TrueBurn World::begin_burn(const Sheet& sheet, BurnDepth depth, Vec2 at, double energy) const {
  const Roughness& rough = truth_.settings.rough;
  const TwinSettings::Laser& laser = truth_.settings.laser;
  TrueBurn burn;
  burn.depth = depth, burn.face = on_bed_->face, burn.points = {at};
  const double defocus = std::abs(sheet.relief.lift(at.x / sheet.width_mm, at.y / sheet.height_mm, burn.face));
  if (depth == BurnDepth::kEngrave) {
    burn.width_mm = laser.engrave_width_mm + rough.kerf_by_focus * defocus;
    return burn;
  }
  const double strength = std::clamp(energy / (kPlentyOfEnergy * laser.through_energy), 0.5, 2.0);
  burn.width_mm = truth_.kerf_mm * std::pow(strength, rough.kerf_by_power) + rough.kerf_by_focus * defocus;
  burn.oval_mm = rough.spot_oval_mm, burn.taper_mm = rough.kerf_taper_mm, burn.soot_mm = rough.soot_mm;
  return burn;
}

void World::end_stroke_locked() {
  if (!stroke_) return;
  const std::unique_ptr<OpenStroke> stroke = std::move(stroke_);
  Sheet& sheet = *stroke->sheet;
  if (stroke->burn.depth == BurnDepth::kThrough) sheet.cut_since_lifted = true;
  burn_stroke(sheet, stroke->burn);
  if (Status s = append_burn(sheet.burns.back(), sheet_dir(sheet.name)); !s.ok()) log_->error("{}", s.error().message);
}

void World::flush_burns() {
  const std::lock_guard lock(mutex_);
  end_stroke_locked();
}

}  // namespace veneer::sim
