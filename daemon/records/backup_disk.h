// When the newest backup was made, as the disk says that backups lie on: asked now and then, on a thread that nothing
// waits for, not even the daemon's end. That disk may be another machine's, and hang for good.
//
// Bound to one thread, that of the reactor.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"

namespace veneer::daemon {

// What the disk said last.
struct BackupsSeen {
  std::optional<std::chrono::system_clock::time_point> newest_at;  // of the newest that can be read
};

class BackupDisk {
 public:
  // A healthy disk that has to wake up answers sooner.
  static constexpr std::chrono::seconds kSilent{60};

  // `clock` outlives this.
  BackupDisk(std::filesystem::path folder, const Clock& clock);

  // Asks it, unless it is still to answer: a disk that hangs is not asked again and again.
  void look();
  // Nothing before its first answer.
  std::optional<BackupsSeen> seen() const;
  // What it means that it has not answered for kSilent, and what to do, in one sentence; "" while it answers.
  std::string silence() const;

 private:
  struct Answer;
  std::filesystem::path folder_;
  const Clock& clock_;
  TimePoint asked_at_{};
  std::shared_ptr<Answer> answer_;  // shared with the thread that asks
};

}  // namespace veneer::daemon
