#include "daemon/unit/cell_health.h"

#include <utility>

#include "drivers/overdue.h"

namespace veneer::daemon {

CellHealth::CellHealth(const Clock& real_clock, Parts parts, Duration patience)
    : clock_(real_clock), parts_(std::move(parts)), patience_(patience), alive_(std::make_shared<bool>(true)) {}

CellHealth::~CellHealth() { *alive_ = false; }

void CellHealth::look() {
  const TimePoint now = clock_.now();
  sentence_.clear();
  if (asked_ && now - *asked_ > patience_)
    sentence_ = "the database does not answer: look at the disk of the data folder, then Clear";
  if (!asked_) {
    asked_ = now;
    parts_.ask_database([this, alive = alive_] {
      if (*alive) asked_.reset();
    });
  }
  if (!parts_.moving() || parts_.laser_link())
    link_lost_.reset();
  else if (!link_lost_)
    link_lost_ = now;
  else if (now - *link_lost_ > patience_)
    sentence_ = overdue_words("the laser's link does not answer", "Clear and Reset");
  if (!sentence_.empty() && parts_.moving()) parts_.stop(sentence_);
}

}  // namespace veneer::daemon
