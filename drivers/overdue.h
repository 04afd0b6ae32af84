// What is said of a machine that did not do in time what it was told. From here nobody can tell whether its controller,
// the cable or this computer is the cause, so each is named.
#pragma once

#include <string>

namespace veneer {

// `what` is what did not come, as in "the laser did not finish homing in time"; `then` what a person does when the
// cause is gone, as in "Clear and Reset".
inline std::string overdue_words(const std::string& what, const std::string& then) {
  return what +
         ", as if its controller hung or was busy with something else, the cable had lost a byte or this computer was "
         "too loaded to hear it: see that the head is free, check cable and supply, end other heavy programs, then " +
         then;
}

}  // namespace veneer
