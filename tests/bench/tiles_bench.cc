#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/pictures/tile_pyramid.h"
#include "tests/bench/goals.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

// Lines along x with a scan's noise, of a panel of `wide` x `high` mm at 300 dpi.
cv::Mat grain(double wide, double high) {
  constexpr double kPxPerMm = 300 / 25.4;
  cv::Mat picture(cvRound(high * kPxPerMm), cvRound(wide * kPxPerMm), CV_8UC3), lines(picture.rows, 1, CV_8UC3);
  cv::RNG random(3);
  random.fill(picture, cv::RNG::NORMAL, cv::Scalar(70, 100, 140), cv::Scalar::all(4));
  random.fill(lines, cv::RNG::UNIFORM, 0, 40);
  for (int c = 0; c < picture.cols; ++c) cv::add(picture.col(c), lines, picture.col(c));
  return picture;
}

class Tiles : public benchmark::Fixture {
 public:
  void SetUp(const benchmark::State& state) override {
    map_ = grain(static_cast<double>(state.range(0)), static_cast<double>(state.range(1)));
    if (!write_tile_pyramid(map_, file_).ok()) std::abort();
  }
  void TearDown(const benchmark::State&) override { map_.release(); }

 protected:
  testing::TempDirectory dir_;
  std::filesystem::path file_ = dir_.path() / "map-tiles.tif";
  cv::Mat map_;
};

// Once for each map, as it enters.
BENCHMARK_DEFINE_F(Tiles, are_made)(benchmark::State& state) {
  for (auto _ : state)
    if (!write_tile_pyramid(map_, file_).ok()) std::abort();
  state.counters["Mpx"] = static_cast<double>(map_.total()) / 1e6;
  state.counters["MB"] = static_cast<double>(std::filesystem::file_size(file_)) / 1e6;
}
// For each that is looked at.
BENCHMARK_DEFINE_F(Tiles, is_read)(benchmark::State& state) {
  int column = 0;
  for (auto _ : state) {
    const auto jpeg = read_pyramid_tile(file_, 0, column, 1);
    if (!jpeg) std::abort();
    column = (column + 1) % (map_.cols / kTileSide);
  }
}
// A map of 209 Mpx opens at once: a screen shows some 8 tiles of it, which are read by two threads and drawn as they
// come, and it is made while the scan enters.
const bool kWanted = bench::Goals::all().add(
    {{"Tiles/is_read/1500/1000", "time", 20'000, "us"}, {"Tiles/are_made/1500/1000", "time", 10'000, "ms"}});

BENCHMARK_REGISTER_F(Tiles, are_made)->Args({264, 174})->Args({1500, 1000})->Unit(benchmark::kMillisecond);
BENCHMARK_REGISTER_F(Tiles, is_read)->Args({264, 174})->Args({1500, 1000})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace veneer::planner
