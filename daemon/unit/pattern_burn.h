// Strokes that belong to no job: a test pattern, a calibration pattern, a test card, a drawing. They burn scrap: with a
// panel of the stock in the camera's sight they are refused, for nobody would book its wood. When one may lie there
// unseen (BedView::stock_in_sight) a person has to say that it is scrap.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/unit/activity.h"
#include "daemon/unit/pattern_commands.h"

namespace veneer::daemon {

// What is confirmed by this name.
inline constexpr const char* kScrapOnTheBed = "scrap on the bed";

class PatternBurn final : public Activity {
 public:
  // `confirmed` is what the operator confirmed by name; `wanted` is asked before the first stroke, when
  // the camera has looked where it looks, and at each Unhold.
  PatternBurn(ActivityHost& host, Pattern pattern, Reply reply, const std::vector<std::string>& confirmed,
              std::function<Status()> wanted);

  std::string recorded() const override;
  bool needs_look() const override { return burns_; }
  void look(Reply reply) override;
  bool proves_pose() const override { return false; }
  bool ends_unproven() const override { return false; }
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string& remark) override;
  Status still_wanted() const override;
  // Scrap is nobody's.
  std::optional<BrokenRun> broken_off(const std::string&, std::string&) override { return std::nullopt; }
  void over(const Status& status) override { reply_(status); }

 private:
  ActivityHost& host_;
  Pattern pattern_;
  Reply reply_;
  const bool burns_;  // not all of it is dark
  const std::vector<std::string> confirmed_;
  const std::function<Status()> wanted_;
  bool begun_ = false;
};

// kRefused, saying what to do, where what was seen on the bed speaks for wood of the stock; as the look itself where it
// failed. `confirmed` as above.
Status judge_stock(const Result<StockSight>& seen, const std::vector<std::string>& confirmed);

// Is the beam on in any of them?
bool has_beam(const LaserJob& strokes);

}  // namespace veneer::daemon
