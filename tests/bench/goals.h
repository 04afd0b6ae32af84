// What is wanted of figures that benchmarks measure. The run prints each beside its goal, and fails where one is
// missed.
#pragma once

#include <benchmark/benchmark.h>

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::bench {

struct Goal {
  std::string benchmark;  // its name, with "/" and its argument where it has one
  std::string figure;     // a counter of it, or "time": by the clock, in its unit
  double most;
  std::string unit;
};

// As the benchmarks of a file say at the program's start. Each figure that is measured has to keep within its goal.
class Goals {
 public:
  static Goals& all();
  bool add(std::vector<Goal> goals);
  const std::vector<Goal>& list() const { return goals_; }

 private:
  std::vector<Goal> goals_;
};

// Shows what google benchmark shows, and judges it.
class Judge final : public benchmark::BenchmarkReporter {
 public:
  // `shown` outlives it.
  Judge(benchmark::BenchmarkReporter& shown, const std::vector<Goal>& goals) : shown_(shown), goals_(goals) {}
  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override { shown_.Finalize(); }

  // All benchmarks were to run whose name begins so: a goal of theirs that none measured is missed.
  void expect_all(std::string_view beginning = {});
  // A line for each figure that has a goal; "" where none was measured.
  std::string told() const { return told_; }
  bool any_missed() const { return missed_ > 0; }

 private:
  void judge(const Run& run, const Goal& goal);
  void miss(const Goal& goal);

  benchmark::BenchmarkReporter& shown_;
  const std::vector<Goal>& goals_;
  std::set<const Goal*> judged_;
  std::string told_;
  int missed_ = 0;
};

}  // namespace veneer::bench
