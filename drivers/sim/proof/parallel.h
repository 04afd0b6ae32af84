// Work shared among a few threads; results go to places of their own, so their order never matters.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace veneer::proof {

// Calls work(index, worker) for every index once; worker is 0 to threads - 1.
template <class Work>
void parallel_for(std::size_t count, int threads, Work work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&](int worker) {
    for (std::size_t i = next++; i < count; i = next++) work(i, worker);
  };
  std::vector<std::jthread> others;
  const int wanted = static_cast<int>(std::min<std::size_t>(count, static_cast<std::size_t>(std::max(1, threads))));
  for (int worker = 1; worker < wanted; ++worker) others.emplace_back(run, worker);
  run(0);
}

}  // namespace veneer::proof
