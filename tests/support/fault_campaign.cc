#include "tests/support/fault_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "tests/support/burn_check.h"
#include "tests/support/fault_link.h"
#include "tests/support/grbl_cell.h"

namespace veneer::tests {
namespace {

constexpr int kPieces = 3;
constexpr double kQueued = 1.0;      // seconds of motion the controller may hold
constexpr double kHausdorff = 0.02;  // mm, beyond what a motor step cannot express
constexpr double kResolution = 0.0089;

struct Extent {
  std::size_t bytes, answer_bytes, lines;
};

// How much a job without faults sends and gets.
const Extent& extent_of_job() {
  static const Extent kExtent = [] {
    FaultLink link(1);
    link.connect_and_home();
    const std::size_t before = link.bytes_sent();
    link.core.start(square_job(kPieces, 6), link.now());
    link.exchange();
    link.run(300, [&] { return link.over(); });
    return Extent{link.bytes_sent() - before, 2000, 180};
  }();
  return kExtent;
}

double distance_to(const Leg& leg, double x, double y) {
  const double l2 = (leg.bx - leg.ax) * (leg.bx - leg.ax) + (leg.by - leg.ay) * (leg.by - leg.ay);
  const double t =
      l2 > 0 ? std::clamp(((x - leg.ax) * (leg.bx - leg.ax) + (y - leg.ay) * (leg.by - leg.ay)) / l2, 0.0, 1.0) : 0;
  return std::hypot(x - leg.ax - t * (leg.bx - leg.ax), y - leg.ay - t * (leg.by - leg.ay));
}

// The farthest any point of `from` lies from `to`.
double one_way(std::span<const Leg> from, std::span<const Leg> to) {
  constexpr double kStep = 0.1;
  double worst = 0;
  for (const Leg& leg : from) {
    const int steps = std::max(1, static_cast<int>(std::ceil(length(leg) / kStep)));
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      double nearest = 1e9;
      for (const Leg& other : to)
        nearest = std::min(nearest, distance_to(other, leg.ax + t * (leg.bx - leg.ax), leg.ay + t * (leg.by - leg.ay)));
      worst = std::max(worst, nearest);
    }
  }
  return worst;
}

std::vector<Leg> legs_of(std::span<const sim::BurnSegment> burns) {
  std::vector<Leg> legs;
  for (const sim::BurnSegment& burn : burns)
    legs.push_back(
        {burn.from.x_mm + 520, burn.from.y_mm + 380, burn.to.x_mm + 520, burn.to.y_mm + 380, burn.energy_per_mm()});
  return legs;
}

double total(std::span<const Leg> legs) {
  double sum = 0;
  for (const Leg& leg : legs) sum += length(leg);
  return sum;
}

// Watches one job: what was burnt when a piece was reported, and what the machine did after the end.
class Judge {
 public:
  Judge(FaultLink& link, LaserJob job) : link_(link), job_(std::move(job)) {}

  void look() {
    for (; seen_ < link_.events.size(); ++seen_)
      if (const auto* verified = std::get_if<laser_event::PieceVerified>(&link_.events[seen_])) check(verified->piece);
  }

  FaultRun finish() {
    look();
    const auto aborted = link_.all<laser_event::Aborted>();
    const auto done = link_.all<laser_event::Done>();
    const auto complain = [this](const std::string& what) {
      if (run_.broken.empty()) run_.broken = what;
    };
    if (!done.empty()) {
      run_.ending = FaultRun::Ending::kComplete;
      if (verified_ != kPieces) complain("done, but not with all pieces");
    } else if (aborted.empty()) {
      run_.ending = FaultRun::Ending::kHeld;
      if (link_.all<laser_event::Held>().empty()) complain("neither done nor aborted nor held");
    }
    if (done.size() + aborted.size() > 1) complain("ended more than once");
    for (const auto& end : aborted) {
      run_.suspect = !end.suspect.empty();
      if (end.error.message.empty()) complain("aborted without a sentence");
      const bool named = end.suspect.size() == 1 && end.suspect.front().value == verified_ + 1;
      if (!end.suspect.empty() && !named) complain("the wrong piece is suspect");
      if (link_.bench.burns.size() > counted_ && !named) run_.wrong = "burnt, but not suspect";
      look_for_stray_wood(end);
    }
    if (link_.bench.controller.beam_on()) complain("the beam is on");
    const sim::BeamLog& log = link_.bench.controller.beam_log();
    run_.beam_at_rest_s = log.beam_at_rest_s;
    if (log.burnt_unhomed_mm > 0) complain("burnt at an unknown position");
    run_.longest_queue_s = log.longest_queued_motion_s;
    if (link_.longest_queue_s > kQueued) complain("the driver queued more motion than it may");
    run_.without_consent_mm = log.moved_without_consent_mm;
    return run_;
  }

 private:
  void check(PieceId piece) {
    ++verified_;
    const auto planned = tests::legs_of(job_, piece);
    const auto burnt = legs_of(std::span(link_.bench.burns).subspan(counted_));
    counted_ = link_.bench.burns.size();
    const double hausdorff = burnt.empty() ? 1e9 : std::max(one_way(burnt, planned), one_way(planned, burnt));
    run_.hausdorff_mm = std::max(run_.hausdorff_mm, hausdorff);
    if (hausdorff > kHausdorff + kResolution || std::abs(total(burnt) - total(planned)) > 0.1)
      run_.wrong = fmt::format("piece {} is reported verified, but lies {:.3f} mm off, {:.2f} of {:.2f} mm burnt",
                               piece.value, hausdorff, total(burnt), total(planned));
    for (const Leg& burn : burnt) {
      if (length(burn) < 0.02) continue;
      // An arc's chord may begin on one leg and end on the next.
      const auto fits_at = [&](double x, double y) {
        return std::any_of(planned.begin(), planned.end(), [&](const Leg& leg) {
          return std::abs(burn.energy / leg.energy - 1) < 0.05 && on_leg(leg, x, y);
        });
      };
      const bool fits = fits_at(burn.ax, burn.ay) && fits_at(burn.bx, burn.by) &&
                        fits_at((burn.ax + burn.bx) / 2, (burn.ay + burn.by) / 2);
      if (!fits) run_.wrong_energy = fmt::format("piece {} was burnt with another feed or power", piece.value);
    }
  }

  // Burnt off the way of the piece under way, and not where the driver says that the beam may have been.
  void look_for_stray_wood(const laser_event::Aborted& end) {
    const auto planned = tests::legs_of(job_, PieceId{verified_ + 1});
    std::vector<Leg> doubted;
    for (std::size_t i = 0; i < end.stray_path.size(); ++i) {
      const auto &a = end.stray_path[i > 0 ? i - 1 : 0], &b = end.stray_path[i];
      doubted.push_back({a.x.count(), a.y.count(), b.x.count(), b.y.count(), 0});
    }
    for (const Leg& burn : legs_of(std::span(link_.bench.burns).subspan(counted_))) {
      const double off = one_way({&burn, 1}, planned);
      if (off <= kHausdorff + kResolution) continue;
      const double beyond = doubted.empty() ? off : one_way({&burn, 1}, doubted) - end.stray_reach.count();
      if (beyond <= kHausdorff + kResolution) continue;
      run_.unaccused_mm = std::max(run_.unaccused_mm, std::min(off, beyond));
      run_.unaccused = end.error.message;
    }
  }

  FaultLink& link_;
  LaserJob job_;
  std::size_t seen_ = 0, counted_ = 0;
  int verified_ = 0;
  FaultRun run_;
};

void inject(FaultLink& link, WireFault kind, std::mt19937_64& random) {
  const Extent& extent = extent_of_job();
  const auto up_to = [&](std::size_t most) { return 1 + random() % most; };
  sim::GrblController& controller = link.bench.controller;
  switch (kind) {
    case WireFault::kDropOk:
      return controller.inject({sim::FaultKind::kDropOk, up_to(extent.lines)});
    case WireFault::kDuplicateOk:
      return controller.inject({sim::FaultKind::kDuplicateOk, up_to(extent.lines)});
    case WireFault::kFirmwareHang:
      return controller.inject({sim::FaultKind::kStall, up_to(extent.lines)});
    case WireFault::kBanner:
      return controller.inject({sim::FaultKind::kBanner, up_to(extent.lines)});
    case WireFault::kError:
      return controller.inject({sim::FaultKind::kError, up_to(extent.lines), static_cast<int>(up_to(38))});
    case WireFault::kAlarm:
      return controller.inject({sim::FaultKind::kAlarm, up_to(extent.lines), static_cast<int>(up_to(10))});
    case WireFault::kLidOpen:
      return;
    case WireFault::kGarbledAnswer:
      return link.arm(kind, up_to(extent.answer_bytes));
    default:
      return link.arm(kind, up_to(extent.bytes));
  }
}

// An operator who closes the lid and resumes, most of the time.
void operate(FaultLink& link, WireFault kind, std::mt19937_64& random) {
  if (kind == WireFault::kLidOpen) {
    link.run(static_cast<double>(random() % 9000) * 1e-3, [&] { return link.over(); });
    link.bench.controller.set_lid(true, link.now());
    link.exchange();
    link.run(3);
    link.bench.controller.set_lid(false, link.now());
    link.exchange();
    link.run(1);
  }
  const bool leaves_it_held = kind == WireFault::kLidOpen && random() % 8 == 0;
  for (int holds = 0; holds < 4; ++holds) {
    const std::size_t held = link.all<laser_event::Held>().size() - (holds == 0 && kind == WireFault::kLidOpen ? 1 : 0);
    link.run(200, [&] { return link.over() || link.all<laser_event::Held>().size() > held; });
    if (link.over() || leaves_it_held) return;
    link.run(0.5);
    link.core.resume(link.now());
    link.exchange();
  }
}

}  // namespace

std::string_view name_of(WireFault kind) {
  static constexpr std::array<std::string_view, kWireFaults> kNames = {
      "ok lost",        "ok twice",          "byte garbled", "noise",          "answer garbled", "byte lost",
      "line truncated", "lines fused",       "fused, valid", "partial writes", "link stalls",    "firmware hangs",
      "I/O error",      "unplug and replug", "reset banner", "error:N",        "ALARM:N",        "lid open"};
  return kNames.at(static_cast<std::size_t>(kind));
}

bool changes_lines(WireFault kind) {
  switch (kind) {
    case WireFault::kGarbledByte:
    case WireFault::kNoise:
    case WireFault::kDroppedByte:
    case WireFault::kTruncatedLine:
    case WireFault::kFusedLines:
    case WireFault::kFusedValid:
      return true;
    default:
      return false;
  }
}

FaultRun run_with_fault(WireFault kind, std::uint64_t seed) {
  std::mt19937_64 random(seed * 1000003 + static_cast<std::uint64_t>(kind));
  FaultLink link(random());
  link.connect_and_home();
  const LaserJob job = square_job(kPieces, 6);
  Judge judge(link, job);
  link.on_step = [&] { judge.look(); };
  inject(link, kind, random);
  link.core.start(job, link.now());
  link.exchange();
  operate(link, kind, random);

  // What was queued may still end; from then on nothing moves without an operator's word, whatever comes over the wire
  // and however often the host connects.
  link.run(kQueued);
  link.bench.controller.set_consent(false);
  link.run(70);
  const auto aborted = link.all<laser_event::Aborted>();
  if (!aborted.empty() && aborted.front().error.code == ErrorCode::kDisconnected) {
    link.plug();
    link.core.connect(link.now());
    link.exchange();
    link.run(6);
    link.core.start(job, link.now());  // refused: the position is not known
    link.exchange();
    link.run(3);
  }
  return judge.finish();
}

FaultRow run_campaign(WireFault kind, int runs, std::uint64_t first_seed) {
  FaultRow row;
  row.kind = kind;
  for (int i = 0; i < runs; ++i) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    FaultRun run = run_with_fault(kind, seed);
    ++row.runs;
    row.complete += run.ending == FaultRun::Ending::kComplete ? 1 : 0;
    row.held += run.ending == FaultRun::Ending::kHeld ? 1 : 0;
    row.aborted += run.ending == FaultRun::Ending::kAborted ? 1 : 0;
    row.suspect += run.suspect ? 1 : 0;
    row.wrong += run.wrong.empty() ? 0 : 1;
    row.wrong_energy += run.wrong_energy.empty() ? 0 : 1;
    const bool stood = run.beam_at_rest_s > 0;
    row.standing += stood ? 1 : 0;
    // Nobody can take back a changed letter, but it must be noticed, and soon.
    if (stood && run.broken.empty() && !(changes_lines(kind) && run.suspect && run.beam_at_rest_s < 1.5))
      run.broken = fmt::format("the beam was on at rest for {:.3f} s", run.beam_at_rest_s);
    if (changes_lines(kind) && run.longest_queue_s > kQueued) {
      ++row.lengthened;
      row.notes.push_back(fmt::format("{}, seed {}: a changed line was in the controller for {:.3f} s", name_of(kind),
                                      seed, run.longest_queue_s));
    }
    if (!changes_lines(kind) && run.longest_queue_s > kQueued && run.broken.empty())
      run.broken = fmt::format("{:.3f} s of motion queued", run.longest_queue_s);
    row.broken += run.broken.empty() ? 0 : 1;
    row.hausdorff_mm = std::max(row.hausdorff_mm, run.hausdorff_mm);
    row.longest_queue_s = std::max(row.longest_queue_s, run.longest_queue_s);
    row.without_consent_mm += run.without_consent_mm;
    if (run.unaccused_mm > 0) {
      ++row.unaccused;
      row.unaccused_mm = std::max(row.unaccused_mm, run.unaccused_mm);
      row.notes.push_back(fmt::format("{}, seed {}: {:.2f} mm off the path and told to nobody: {}", name_of(kind), seed,
                                      run.unaccused_mm, run.unaccused));
    }
    for (const std::string* what : {&run.wrong, &run.wrong_energy, &run.broken})
      if (!what->empty()) row.complaints.push_back(fmt::format("{}, seed {}: {}", name_of(kind), seed, *what));
    if (run.without_consent_mm > 0)
      row.complaints.push_back(
          fmt::format("{}, seed {}: moved {:.2f} mm without consent", name_of(kind), seed, run.without_consent_mm));
  }
  return row;
}

}  // namespace veneer::tests
