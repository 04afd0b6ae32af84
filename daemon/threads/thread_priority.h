// Which thread gets a processor when there are fewer than want one. Linux keeps the priority per thread; threads and
// processes begin with that of whoever starts them.
#pragma once

namespace veneer::daemon {

// How far the loop that owns the laser goes before everything else: a STOP must not wait until a plan, a query and
// sixty clients have each had their turn.
inline constexpr int kLoopNice = -10;

// Gives the calling thread this nice value, 19 (last) to -20 (first). False when it may not have it, and then nothing
// has changed: values below the present one want RLIMIT_NICE (LimitNICE= in the unit) or CAP_SYS_NICE.
bool set_thread_nice(int nice) noexcept;

}  // namespace veneer::daemon
