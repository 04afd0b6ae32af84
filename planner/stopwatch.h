// Wall-clock seconds since it was made. For reports and limits of time; no plan depends on it.
#pragma once

#include <chrono>

namespace veneer::planner {

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace veneer::planner
