// What can be set on a scanner, as the device names it, and what it would take. Pure.
//
// A value is a text here, as people write it: "true", "300", "Color". SANE's fixed-point numbers have 16 bits behind
// the point.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::sane {

// Of an option's numbers.
struct OptionRange {
  double least = 0, most = 0, step = 0;  // step 0: any
};

struct ScannerOption {
  enum class Kind { kYesNo, kWhole, kNumber, kText, kOther };  // kOther: buttons, tables
  std::string name;                                            // "resolution"
  std::string title;                                           // for people
  std::string unit;                                            // "dpi", "mm", "px", "bit", "%", "us" or ""
  Kind kind = Kind::kOther;
  bool active = false;    // it counts as the others are set now
  bool settable = false;  // by a program
  std::optional<OptionRange> range;
  std::vector<double> numbers;     // nothing else is taken, unless empty
  std::vector<std::string> words;  // the same for texts
  std::string value;               // now; "" where it cannot be read
};

// 300, 0.5: no more digits than it needs.
std::string in_digits(double number);
// "75, 150, 300", "50 to 1200 in steps of 50": behind "the scanner takes". "" where it takes anything.
std::string what_it_takes(const ScannerOption& option);
// A text that the option takes, in the device's own spelling; kInvalidArgument names what it would take.
Result<std::string> fitting_value(const ScannerOption& option, const std::string& wanted, const std::string& scanner);

}  // namespace veneer::sane
