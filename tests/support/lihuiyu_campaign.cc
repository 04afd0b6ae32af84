#include "tests/support/lihuiyu_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <span>

#include "tests/support/lihuiyu_cell.h"
#include "tests/support/lihuiyu_job.h"

namespace veneer::tests {
namespace {

constexpr int kBoardPieces = 3;

// A moment somewhere in the job, and how long or how often.
sim::BoardFault draw(sim::BoardFaultKind kind, std::mt19937_64& random, std::size_t packets, std::size_t statuses) {
  using K = sim::BoardFaultKind;
  const bool status = kind == K::kLoseStatus || kind == K::kRepeatStatus || kind == K::kGarbleStatus;
  sim::BoardFault fault{kind, 1 + random() % (status ? statuses : packets), 1};
  const auto between = [&](double low, double high) {
    return static_cast<int>(std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(random)));
  };
  if (kind == K::kRejectPacket) fault.value = between(1, 16);
  if (kind == K::kStall) fault.value = between(100, 60000);
  if (kind == K::kReplug) fault.value = between(50, 10000);
  if (kind == K::kBrownOut) fault.value = between(1, 5000);
  return fault;
}

class FaultedRun {
 public:
  FaultedRun(std::string_view kind, std::uint64_t seed)
      : cell_({.m3 = seed % 2 == 1}, options(seed), seed),
        job_(odd_job(kBoardPieces, seed % 2 == 1 ? 0.7 : 1, 3.5 + static_cast<double>(seed % 5) / 3)) {
    std::mt19937_64 random(seed * 2654435761U + std::hash<std::string_view>{}(kind));
    cell_.connect_and_home();
    cell_.on_step = [this] { look(); };
    // About as many as such a job needs.
    fault_ = draw(sim::board_fault_kind(kind).value(), random, 62, 220);
    cell_.board.inject(fault_);
  }

  BoardRun run() {
    cell_.start(job_);
    cell_.run(600, [this] { return cell_.over(); });
    out_.complete = cell_.has<laser_event::Done>();
    out_.aborted = cell_.has<laser_event::Aborted>();
    if (out_.complete == out_.aborted) complain(out_.broken, "the job has no one end");
    if (out_.aborted) after_abort();
    if (out_.complete) {
      cell_.run(5);
      if (cell_.board.beam_commanded()) complain(out_.broken, "the beam is on after the job");
      if (verified_ != kBoardPieces) complain(out_.wrong, "done, but not with all pieces");
      if (burnt_since() > 0) complain(out_.wrong, "burnt on after the last piece");
    }
    out_.longest_queue_s = cell_.board.log().longest_queued_motion_s;
    if (!cell_.board.complaints().empty() && out_.complete) complain(out_.broken, cell_.board.complaints().front());
    return out_;
  }

 private:
  static lihuiyu::LihuiyuOptions options(std::uint64_t seed) {
    lihuiyu::LihuiyuOptions options;
    options.board = seed % 2 == 1 ? lihuiyu::Board::kM3 : lihuiyu::Board::kM2;
    return options;
  }
  static void complain(std::string& where, const std::string& what) {
    if (where.empty()) where = what;
  }

  double burnt_since() const {
    double mm = 0;
    for (const sim::BurnSegment& burn : std::span(cell_.burns).subspan(counted_)) mm += burn.length_mm();
    return mm;
  }

  // Neither along the suspect piece nor within reach of where it is said to have strayed.
  bool burnt_outside(const laser_event::Aborted& aborted) const {
    std::vector<MmLeg> told;
    for (const PieceId piece : aborted.suspect)
      for (const MmLeg& leg : planned_legs(job_, piece)) told.push_back(leg);
    const auto burns = std::span(cell_.burns).subspan(counted_);
    for (const MmLeg& burnt : burnt_legs(burns)) {
      for (const auto& end : {std::pair(burnt.ax, burnt.ay), std::pair(burnt.bx, burnt.by)}) {
        const double x = end.first, y = end.second;
        const bool along =
            std::ranges::any_of(told, [&](const MmLeg& leg) { return distance_to(leg, x, y) <= kBurnTolerance; });
        const bool reached = std::ranges::any_of(aborted.stray_path, [&](const auto& p) {
          return std::hypot(p.x.count() - x, p.y.count() - y) <= aborted.stray_reach.count();
        });
        if (!along && !reached) return true;
      }
    }
    return false;
  }

  void look() {
    for (; seen_ < cell_.events.size(); ++seen_) {
      const auto* verified = std::get_if<laser_event::PieceVerified>(&cell_.events[seen_]);
      if (verified == nullptr) continue;
      ++verified_;
      const auto burns = std::span(cell_.burns).subspan(counted_);
      const std::string problem = wrong_piece(job_, verified->piece, burns, &out_.hausdorff_mm);
      if (!problem.empty()) complain(out_.wrong, fmt::format("piece {}: {}", verified->piece.value, problem));
      counted_ = cell_.burns.size();
    }
  }

  void after_abort() {
    const auto aborted = *cell_.first<laser_event::Aborted>();
    if (aborted.error.message.empty()) complain(out_.broken, "no sentence for the operator");
    out_.suspect = !aborted.suspect.empty();
    // What the board still holds it burns; all of that belongs to the suspect piece.
    cell_.run(1);
    out_.software_off = !cell_.board.beam_commanded();
    cell_.board.set_relay(false, cell_.now());
    if (burnt_since() > 0 && !out_.suspect) complain(out_.wrong, "burnt but not suspect");
    if (burnt_outside(aborted)) complain(out_.wrong, "burnt where nobody was told to look");
    for (const PieceId piece : aborted.suspect)
      if (piece.value != verified_ + 1) complain(out_.wrong, "the wrong piece is suspect");
    if (cell_.has<laser_event::PieceVerified>() && verified_ > kBoardPieces) complain(out_.wrong, "too many pieces");
    // A hang ends, the plug is put back, the lid is closed: nothing moves but what was queued before.
    cell_.run(65);
    if (cell_.board.beam_on()) complain(out_.broken, "the tube burns after an abort");
    cell_.board.set_consent(false);
    if (cell_.board.lid_open()) cell_.board.set_lid(false, cell_.now());
    cell_.board.plug();
    cell_.run(5);
    cell_.reconnect();
    cell_.run(5);
    if (cell_.core.status().homed) complain(out_.broken, "it believes in its position after an abort");
    out_.without_consent_mm = cell_.board.log().moved_without_consent_mm;
  }

  LihuiyuCell cell_;
  LaserJob job_;
  sim::BoardFault fault_{};
  BoardRun out_;
  std::size_t seen_ = 0, counted_ = 0;
  int verified_ = 0;
};

}  // namespace

BoardRun run_with_board_fault(std::string_view kind, std::uint64_t seed) { return FaultedRun(kind, seed).run(); }

BoardRow run_board_campaign(std::string_view kind, int runs, std::uint64_t first_seed) {
  BoardRow row;
  row.kind = kind;
  for (std::uint64_t seed = first_seed; seed < first_seed + static_cast<std::uint64_t>(runs); ++seed) {
    const BoardRun run = run_with_board_fault(kind, seed);
    ++row.runs;
    row.complete += run.complete ? 1 : 0;
    row.aborted += run.aborted ? 1 : 0;
    row.suspect += run.suspect ? 1 : 0;
    row.software_off += run.aborted && run.software_off ? 1 : 0;
    row.relay_off += run.aborted && !run.software_off ? 1 : 0;
    row.wrong += run.wrong.empty() ? 0 : 1;
    row.broken += run.broken.empty() ? 0 : 1;
    row.hausdorff_mm = std::max(row.hausdorff_mm, run.hausdorff_mm);
    row.longest_queue_s = std::max(row.longest_queue_s, run.longest_queue_s);
    row.without_consent_mm += run.without_consent_mm;
    for (const std::string& complaint : {run.wrong, run.broken})
      if (!complaint.empty()) row.complaints.push_back(fmt::format("{} seed {}: {}", kind, seed, complaint));
    if (run.without_consent_mm > 0)
      row.complaints.push_back(fmt::format("{} seed {}: moved {:.2f} mm unasked", kind, seed, run.without_consent_mm));
  }
  return row;
}

}  // namespace veneer::tests
