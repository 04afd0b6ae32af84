// What each identity may have under way at once. Whoever asks for more than their share gets 429, and takes no room
// that belongs to others; who finds the cell's own room taken gets 503.
//
// An identity is a user of the Unix socket, a console link, or all the anonymous ones together. Bound to the reactor.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "daemon/api/api_message.h"

namespace veneer::daemon {

struct ClientShareLimits {
  std::size_t requests = 24;    // of one identity, that wait for their reply
  std::size_t uploads = 2;      // of one identity: bodies of more than kSmallBody, until their reply
  std::size_t all_uploads = 4;  // of everybody: each may be 64 MiB of memory
  // Bytes of replies on their way to those who read slowly, besides the first of them.
  std::size_t reply_bytes = 64 * 1024 * 1024;       // to one identity
  std::size_t all_reply_bytes = 256 * 1024 * 1024;  // to everybody
};

class ClientShares {
 public:
  explicit ClientShares(ClientShareLimits limits) : limits_(limits), counts_(std::make_shared<Counts>()) {}

  // Given back when it is destroyed, which may be after the shares are gone.
  class Share {
   public:
    Share() = default;
    Share(Share&&) noexcept = default;
    Share& operator=(Share&&) noexcept = default;

   private:
    friend class ClientShares;
    explicit Share(std::shared_ptr<void> back) : back_(std::move(back)) {}
    std::shared_ptr<void> back_;
  };

  // The refusal when there is no room: 429 or 503. Else `share` holds it.
  std::optional<ApiReply> begin_request(const std::string& who, Share& share);
  std::optional<ApiReply> begin_upload(const std::string& who, Share& share);
  std::optional<ApiReply> begin_reply(const std::string& who, std::size_t bytes, Share& share);

  std::size_t requests() const;
  std::size_t uploads() const;

 private:
  using Count = std::map<std::string, std::size_t>;  // by identity; what is 0 is not in it
  struct Counts {
    Count requests, uploads, reply_bytes;
  };
  Share take(Count Counts::*of, const std::string& who, std::size_t number = 1);

  const ClientShareLimits limits_;
  std::shared_ptr<Counts> counts_;
};

}  // namespace veneer::daemon
