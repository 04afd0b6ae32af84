// The benchmarks' main: google benchmark's, plus the version of what it writes, and a judgement of figures that have a
// goal: it exits with 1 where one was missed.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <string>

#include "tests/bench/goals.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::AddCustomContext("schema_version", "1");
  veneer::bench::Judge judge(*benchmark::CreateDefaultDisplayReporter(), veneer::bench::Goals::all().list());
  const auto ran = benchmark::RunSpecifiedBenchmarks(&judge);
  const std::string filter = benchmark::GetBenchmarkFilter();
  if (filter.empty() || filter == "." || filter == "all") judge.expect_all();
  for (const char* all_of : {"stock", "borders", "odd_shapes"})
    if (filter == all_of) judge.expect_all(all_of);
  benchmark::Shutdown();
  if (!judge.told().empty()) std::fprintf(stderr, "\n%s", judge.told().c_str());
  return ran > 0 && !judge.any_missed() ? 0 : 1;
}
