// Lines for systemd's journal, with what they are about in fields of their own: `journalctl VENEER_JOB=3` finds the
// lines of job 3, VENEER_PANEL=P-0001 those of a panel, VENEER_PIECE=A3-12 those of a piece, VENEER_WHO those of what
// somebody asked for.
//
// They go to the journal's socket in its native protocol (systemd.io/JOURNAL_NATIVE_PROTOCOL) and not through
// sd_journal_send(), which waits for a journal that stalls: here a line without room is dropped and counted, as log.h
// promises.
#pragma once

#include <string>

#include "base/log.h"

namespace veneer {

struct LogFields {
  std::string job = {}, panel = {}, piece = {}, who = {};  // "": not about one
};

// What the lines that this thread writes are about, until it goes. Of several the innermost counts.
class LogAbout {
 public:
  explicit LogAbout(LogFields fields);
  ~LogAbout();
  LogAbout(const LogAbout&) = delete;
  LogAbout& operator=(const LogAbout&) = delete;

 private:
  const LogFields fields_;
  const LogFields* const outer_;
};

// To the journal, or, where there is no such socket, to stderr with priorities (log.h).
Logger make_journal_logger(const char* name, const std::string& socket = "/run/systemd/journal/socket");

}  // namespace veneer
