// What the simulated laser has done, as the twin alone tells it: its controller's beam and the length it burnt, and
// what it burnt into a sheet. Nothing here is the daemon's word, and nothing shares code with the daemon or its driver.
//
// Single-threaded; every call waits for the twin.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::tests {

class TwinWitness {
 public:
  using Ask = std::function<Result<nlohmann::json>(const nlohmann::json& command)>;
  TwinWitness(Ask ask, std::filesystem::path twin_dir) : ask_(std::move(ask)), twin_dir_(std::move(twin_dir)) {}

  struct Beam {
    bool on = true;       // what does not answer is not dark
    double burnt_mm = 0;  // since the twin began, by the controller's own count
  };
  Result<Beam> beam() const;

  // Cut through a sheet, in its own millimetres.
  struct Cuts {
    double length_mm = 0;
    std::vector<std::array<double, 2>> points;  // of the strokes' middles, kStepMm apart
  };
  static constexpr double kStepMm = 0.05;
  // What was cut into it since this was asked last, once the twin has it on disk.
  Result<Cuts> new_cuts(const std::string& sheet);

 private:
  Ask ask_;
  std::filesystem::path twin_dir_;
  std::size_t read_ = 0;   // lines of the sheet's burns
  double through_mm_ = 0;  // of them
};

// The largest distance from a place of `a` to the nearest of `b`, in mm; 1000 where one has none.
double farthest(const TwinWitness::Cuts& a, const TwinWitness::Cuts& b);

}  // namespace veneer::tests
