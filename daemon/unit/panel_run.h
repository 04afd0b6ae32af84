// One panel of a job being cut, from the proven pose to the last booked piece.
//
// The way of one piece: `cutting` is on the disk before its first stroke is sent; the laser burns engraving and cut,
// ends dark, drains and compares its own position with the expected one; only then the piece is booked `cut`. A kill at
// any moment therefore leaves at most one piece in doubt, and recovery calls that one suspect. One piece is one
// LaserJob, so nothing of the next piece can be burning while this one is in doubt.
//
// A verified piece says what the head did, not what lay under it. That is said by the next look that proves the pose;
// when it sees the panel gone or moved, the pieces since the look before are suspect. A run that is over before such a
// look owes it (owed_proof.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/unit/activity.h"
#include "daemon/unit/kept_cuts.h"

namespace veneer::daemon {

class PanelRun final : public Activity {
 public:
  // `who` gives the word; `shown` is what he saw when he gave it; `more`: another panel is to be loaded after this one.
  PanelRun(ActivityHost& host, JobId job, std::string who, const ProvenPose& shown, std::vector<db::PieceRecord> pieces,
           bool more, KeptCuts& kept);

  std::string recorded() const override { return {}; }  // the run is, with each piece that it begins
  bool needs_look() const override { return true; }
  void look(Reply reply) override;
  bool proves_pose() const override { return true; }
  void prepare(const Reply& ready) override;
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string& remark) override;
  bool not_begun() override;
  bool ends_unproven() const override { return !since_proof_.empty() && !ends_as_it_is_; }
  bool end_early(bool at_rest, const std::string& who) override;
  std::optional<BrokenRun> broken_off(const std::string& who, std::string& remark) override;

 private:
  enum class Noted { kNo, kUnderWay, kYes };

  void judge(const Result<ProvenPose>& look, const Reply& reply);
  void tell_moved_tags(const ProvenPose& look);
  void doubt(const Error& why, const Reply& reply);
  void start_run(db::RunFacts facts, Reply ready);
  void note();
  void end();
  const PieceBurn* begun() const;
  std::vector<PieceId> booked_since_proof() const;
  db::RunRecord run_record() const;
  bool ends() const { return stop_ || next_ == burns_.size(); }
  double seconds_left() const;

  ActivityHost& host_;
  JobId job_;
  const std::string who_;
  ProvenPose pose_;
  std::vector<db::PieceRecord> pieces_;
  const bool more_;
  KeptCuts& kept_;
  KeptCuts::Basis basis_;
  std::optional<db::RunId> run_;  // in the database
  std::vector<PieceBurn> burns_;
  std::size_t next_ = 0;             // index of the piece to burn next
  Noted noted_ = Noted::kNo;         // is it `cutting` in the database? No stroke of it was sent yet
  bool at_laser_ = false;            // the piece before `next_`
  std::optional<PieceId> unbooked_;  // burnt and proven, not booked yet
  // Booked since the pose was proven last, and what the camera said since.
  std::vector<const PieceBurn*> since_proof_;
  std::vector<PieceId> doubted_;  // of them, and not written yet
  int suspects_ = 0;              // written
  bool look_failed_ = false;      // since then
  std::string told_;              // ProvenPose::moved_tags as a person saw it last
  bool ends_as_it_is_ = false;    // the operator ends it without another look
  bool stop_ = false;             // asked by the operator: end after the piece under way
  std::string stopped_by_;        // who asked that first
  // Who broke it off. Outlives it: what was being written of its beginning then is ended in that name.
  const std::shared_ptr<std::string> broken_by_ = std::make_shared<std::string>();
};

}  // namespace veneer::daemon
