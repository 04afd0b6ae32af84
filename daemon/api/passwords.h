// Passwords, hashed with libsodium's argon2id on a thread of their own: one takes some 0.1 s and 64 MB, by purpose, and
// the reactor waits for none of it. One at a time, and few wait; some of the places where they wait are kept for those
// who are known here, so that a crowd of strangers keeps nobody else out.
//
// Bound to the reactor.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "daemon/threads/worker.h"

namespace veneer::daemon {

// libsodium's two numbers. kInteractive is meant for people who wait; kForTests protects nothing.
enum class PasswordCost { kInteractive, kForTests };

// Whose password it is said to be: of somebody who is signed in or sits where people have signed in before, or of
// anyone.
enum class Asker { kStranger, kKnown };

class Passwords {
 public:
  static constexpr std::size_t kMostWaiting = 8;  // while a stranger is let in
  static constexpr std::size_t kKept = 4;         // beyond these, for who is known

  // `reactor` outlives this.
  explicit Passwords(boost::asio::io_context& reactor, PasswordCost cost = PasswordCost::kInteractive,
                     std::size_t most_waiting = kMostWaiting);

  // "$argon2id$..." of it, on the reactor; kUnavailable when too many wait (then at once), or when memory is short.
  // Only who is signed in has a password hashed.
  void hash(std::string password, std::function<void(const Result<std::string>&)> then);
  // Is it this one? An empty `hash` belongs to nobody: it takes as long, and the answer is no.
  void verify(std::string hash, std::string password, Asker asker, std::function<void(const Result<bool>&)> then);

 private:
  template <class Answer, class Work>
  void run(Asker asker, Work work, std::function<void(const Result<Answer>&)> then);

  boost::asio::io_context& reactor_;
  const PasswordCost cost_;
  const std::size_t most_waiting_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);  // what comes back to the reactor holds it weakly
  Worker worker_{"passwords", 5};
};

}  // namespace veneer::daemon
