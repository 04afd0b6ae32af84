#include "daemon/api/passwords.h"

#include <sodium.h>

#include <array>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstdlib>
#include <utility>

namespace veneer::daemon {
namespace {

Error short_of_memory() {
  return Error{ErrorCode::kUnavailable, "memory is too short to look at a password: try again"};
}

Result<std::string> hash_now(const std::string& password, PasswordCost cost) {
  const bool cheap = cost == PasswordCost::kForTests;
  std::array<char, crypto_pwhash_STRBYTES> hash{};
  if (crypto_pwhash_str_alg(hash.data(), password.data(), password.size(),
                            cheap ? crypto_pwhash_OPSLIMIT_MIN : crypto_pwhash_OPSLIMIT_INTERACTIVE,
                            cheap ? crypto_pwhash_MEMLIMIT_MIN : crypto_pwhash_MEMLIMIT_INTERACTIVE,
                            crypto_pwhash_ALG_ARGON2ID13) != 0)
    return short_of_memory();
  return std::string(hash.data());
}

void wipe(std::string& password) { sodium_memzero(password.data(), password.size()); }

}  // namespace

Passwords::Passwords(boost::asio::io_context& reactor, PasswordCost cost, std::size_t most_waiting)
    : reactor_(reactor), cost_(cost), most_waiting_(most_waiting) {
  if (sodium_init() < 0) std::abort();  // no random numbers: nothing here could be kept secret
}

template <class Answer, class Work>
void Passwords::run(Asker asker, Work work, std::function<void(const Result<Answer>&)> then) {
  const auto answer = [this, alive = std::weak_ptr<int>(alive_)](auto told, Result<Answer> result) {
    boost::asio::post(reactor_, [alive, told = std::move(told), result = std::move(result)] {
      if (alive.lock()) told(result);
    });
  };
  const bool taken = worker_.try_post(
      {most_waiting_ + (asker == Asker::kKnown ? kKept : 0)},
      [work = std::move(work), answer, then]() mutable { answer(then, work()); },
      [answer, then](const Error& failed) { answer(then, failed); });
  if (!taken) then(Error{ErrorCode::kUnavailable, "too many sign in at this moment: try again in a few seconds"});
}

void Passwords::hash(std::string password, std::function<void(const Result<std::string>&)> then) {
  run<std::string>(
      Asker::kKnown,
      [password = std::move(password), cost = cost_]() mutable {
        auto made = hash_now(password, cost);
        wipe(password);
        return made;
      },
      std::move(then));
}

void Passwords::verify(std::string hash, std::string password, Asker asker,
                       std::function<void(const Result<bool>&)> then) {
  run<bool>(
      asker,
      [hash = std::move(hash), password = std::move(password), cost = cost_]() mutable -> Result<bool> {
        if (hash.empty()) {
          const auto made = hash_now(password, cost);
          wipe(password);
          if (!made) return made.error();
          return false;
        }
        errno = 0;
        const bool right = crypto_pwhash_str_verify(hash.c_str(), password.data(), password.size()) == 0;
        const bool no_memory = !right && errno == ENOMEM;  // it tells a wrong password from this by errno alone
        wipe(password);
        if (no_memory) return short_of_memory();
        return right;
      },
      std::move(then));
}

}  // namespace veneer::daemon
