// A small cell, calibrated, with one panel in stock and a planned job of 16 pieces: made once for all tests (by
// prepare_test.cc where ctest runs them, else by each process for itself), then copied for each, so that every test
// begins from the same wood, certificates and reservation.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/demo/story.h"
#include "tests/support/simulated_cell.h"
#include "tests/support/temp_directory.h"

namespace veneer::tests {

class PreparedCell : public ::testing::Test {
 protected:
  static void SetUpTestSuite();
  void SetUp() override;
  void TearDown() override;
  // Device time per real time. The job takes 80 s of device time: a test that acts in the middle of it asks for less.
  virtual double time_scale() const { return 40; }

  // Of the cell of each test; how the base is made stays the same.
  virtual SimulatedCellOptions options() const { return {dir_, bin_dir(), 7, time_scale()}; }

  // The twin signals `pid` in the middle of a stroke, once so much more was burnt. A piece burns 48 mm and its mark.
  void signal_at_burn(pid_t pid, int number, double more_mm) const;
  // The daemon's disk is full there, until set_disk_full(false).
  void fill_disk_at_burn(double more_mm) const;
  // The twin presses STOP there, at the daemon's socket.
  void stop_at_burn(double more_mm) const;
  // Unsuspend, and on in the middle of the stroke with which so much more is burnt: what a test does then, it does
  // there, however slow its machine is to ask how far the cut is.
  void unsuspend_and_hear_of(double more_mm) const;

  // The rest of the story: cut, reconcile, prove. Failures of the first two are no failure of the test.
  void cut_and_prove();
  nlohmann::json get(const std::string& target) const;
  // The picture of the prepared job, as a file's bytes.
  static std::string target();
  // Runs SQL on the daemon's database while it is stopped, which it would notice; triggers named in `without` dropped
  // first.
  void tamper(const std::vector<std::string>& without, const std::string& sql) const;

  static std::filesystem::path bin_dir();
  // Where prepare_test.cc makes the cell; "" = this process makes its own.
  static std::filesystem::path made_before();
  // Makes the cell in a folder that holds nothing.
  static void prepare(const std::filesystem::path& base);
  static constexpr std::int64_t kJob = 1;
  static constexpr const char* kPanel = "P-0001";

  std::filesystem::path dir_;
  QuietNarrator narrator_;
  std::unique_ptr<SimulatedCell> cell_;
  std::unique_ptr<Story> story_;

 private:
  void at_burn(nlohmann::json command, double more_mm) const;

  static std::filesystem::path base_;                    // the cell that is copied
  static std::optional<testing::TempDirectory> folder_;  // of the copies
};

}  // namespace veneer::tests
