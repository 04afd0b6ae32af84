// The logger arrives by constructor; there is no default one.
//
// Levels: error = an operator must act; warn = something was refused or repaired; info = one line per thing an operator
// did or the cell finished; debug = for the one who hunts a fault.
// Thread-safe. Under systemd lines carry the <n> priority prefix that journald understands.
#pragma once

#include <spdlog/logger.h>

#include <memory>

namespace veneer {

using Logger = std::shared_ptr<spdlog::logger>;

// Writes to stderr. With `journal` each line starts with its syslog priority instead of time and level.
Logger make_stderr_logger(const char* name, bool journal);
// Swallows everything; for tests.
Logger make_null_logger();

}  // namespace veneer
