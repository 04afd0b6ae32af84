// The logger arrives by constructor; there is no default one.
//
// Levels: error = an operator must act; warn = something was refused or repaired; info = one line per thing an operator
// did or the cell finished; debug = for the one who hunts a fault.
// Nobody waits for a line: one that cannot be written at once (a journal that stalls, a pipe that nobody reads) is
// dropped, and the next one that can says how many were lost. A line ends after 4096 bytes.
// Thread-safe. Under systemd lines carry the <n> priority prefix that journald understands.
#pragma once

#include <spdlog/logger.h>

#include <memory>

namespace veneer {

using Logger = std::shared_ptr<spdlog::logger>;

// Writes to stderr. With `journal` each line starts with its syslog priority instead of time and level.
Logger make_stderr_logger(const char* name, bool journal);
// The same to a descriptor, which stays the caller's and outlives the logger.
Logger make_logger(const char* name, bool journal, int descriptor);
// Swallows everything; for tests.
Logger make_null_logger();

}  // namespace veneer
