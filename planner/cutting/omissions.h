// What a toolpath has to leave out, gathered: hundreds of small pieces make one sentence, not hundreds.
#pragma once

#include <string>
#include <vector>

#include "base/units.h"

namespace veneer::planner {

struct Omissions {
  std::vector<std::string> marks;    // that found no room
  std::vector<std::string> bridges;  // marks of pieces without the bridge they should have
  std::vector<std::string> others;   // a sentence each
};

// `mark_height` is the least that was tried.
std::vector<std::string> sentences_of(const Omissions& omissions, Millimetres mark_height);

}  // namespace veneer::planner
