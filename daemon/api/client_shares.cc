#include "daemon/api/client_shares.h"

#include <numeric>
#include <utility>

namespace veneer::daemon {
namespace {

std::size_t held(const std::map<std::string, std::size_t>& count, const std::string& who) {
  const auto found = count.find(who);
  return found == count.end() ? 0 : found->second;
}

std::size_t sum(const std::map<std::string, std::size_t>& count) {
  return std::accumulate(count.begin(), count.end(), std::size_t{0},
                         [](std::size_t so_far, const auto& one) { return so_far + one.second; });
}

}  // namespace

std::optional<ApiReply> ClientShares::begin_request(const std::string& who, Share& share) {
  if (held(counts_->requests, who) >= limits_.requests)
    return ApiReply::too_many("you have " + std::to_string(limits_.requests) + " requests waiting already");
  share = take(&Counts::requests, who);
  return std::nullopt;
}

std::optional<ApiReply> ClientShares::begin_upload(const std::string& who, Share& share) {
  if (held(counts_->uploads, who) >= limits_.uploads)
    return ApiReply::too_many("you are sending " + std::to_string(limits_.uploads) + " large files already");
  if (uploads() >= limits_.all_uploads) return ApiReply::busy("too many large files are being sent");
  share = take(&Counts::uploads, who);
  return std::nullopt;
}

std::optional<ApiReply> ClientShares::begin_reply(const std::string& who, std::size_t bytes, Share& share) {
  const std::size_t to_them = held(counts_->reply_bytes, who), to_all = sum(counts_->reply_bytes);
  if (to_them > 0 && to_them + bytes > limits_.reply_bytes)
    return ApiReply::too_many("large replies that you have not read yet are on their way to you");
  if (to_all > 0 && to_all + bytes > limits_.all_reply_bytes)
    return ApiReply::busy("too many large replies are on their way");
  share = take(&Counts::reply_bytes, who, bytes);
  return std::nullopt;
}

std::size_t ClientShares::requests() const { return sum(counts_->requests); }
std::size_t ClientShares::uploads() const { return sum(counts_->uploads); }

ClientShares::Share ClientShares::take(Count Counts::*of, const std::string& who, std::size_t number) {
  ((*counts_).*of)[who] += number;
  return Share(std::shared_ptr<void>(nullptr, [counts = counts_, of, who, number](void*) {
    Count& count = (*counts).*of;
    const auto found = count.find(who);
    found->second -= number;
    if (found->second == 0) count.erase(found);
  }));
}

}  // namespace veneer::daemon
