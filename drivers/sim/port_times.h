// How often the simulated controllers' ports wake and write their state, the same for both families.
#pragma once

#include <chrono>

namespace veneer::sim {

constexpr std::chrono::microseconds kShortestWait{200};  // between two looks at a machine in motion
constexpr std::chrono::milliseconds kFlushEvery{250};    // what was burnt reaches the disk

}  // namespace veneer::sim
