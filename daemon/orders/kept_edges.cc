#include "daemon/orders/kept_edges.h"

#include <fmt/format.h>

#include <functional>
#include <opencv2/core.hpp>
#include <span>

#include "base/hash.h"
#include "planner/matching/index_cache.h"

namespace veneer::daemon {
namespace {

constexpr const char* kOwner = "edges";  // of the entries, as a panel is of its own

std::span<std::byte> bytes_of(cv::Mat& picture) {
  return {reinterpret_cast<std::byte*>(picture.data), picture.total() * picture.elemSize()};
}

// Of all that they depend on: whoever has another program or library finds them anew.
std::string key_of(cv::Mat& pixels, double spacing) {
  return fmt::format("edges {} {} {} {} {:a} {}", planner::kEdgeFilters, cv::getVersionString(), pixels.cols,
                     pixels.rows, spacing, sha256_hex(bytes_of(pixels)));
}

}  // namespace

planner::EdgeFinder kept_edges(const std::string& folder, planner::GridEffort effort, const planner::EdgeFinder& from) {
  return [folder, effort, from](const cv::Mat& bgr, double spacing, int threads) {
    const auto cache = planner::IndexCache::open(folder);
    if (!cache) return from(bgr, spacing, threads);
    cv::Mat pixels = bgr.isContinuous() ? bgr : bgr.clone();
    const std::string key = key_of(pixels, spacing);
    const std::size_t slot = std::hash<std::string>{}(key) % (kKeptEdges / 2);
    const std::string name = planner::IndexCache::entry_name(kOwner, slot, static_cast<int>(effort));
    cv::Mat edges(bgr.size(), CV_8UC1);
    if (const auto found = cache->load(name, key, {bytes_of(edges)}); found && *found) return edges;
    edges = from(bgr, spacing, threads);
    cache->keep_only({kOwner});  // what a killed one has left goes first: it may be what fills the disk
    static_cast<void>(cache->store(name, key, {bytes_of(edges)}));  // what cannot be written is found again
    return edges;
  };
}

}  // namespace veneer::daemon
