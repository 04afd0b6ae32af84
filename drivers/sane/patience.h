// Calls into foreign code that should return at once, and sometimes never do.
#pragma once

#include <chrono>
#include <functional>

namespace veneer::sane {

// Does `call` return within `time`? If not, its thread is left behind with it, for the process to end with both: what
// `call` refers to must then stay where it is. `call` must not throw.
bool returns_within(std::chrono::milliseconds time, std::function<void()> call);

}  // namespace veneer::sane
