// A store of accounts that a test looks into, and that fails when it is told to. Answers come at once, or when the test
// asks for them.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "daemon/api/accounts.h"

namespace veneer::testing {

class AccountMemory final : public daemon::AccountStore {
 public:
  std::vector<daemon::User> users;
  std::vector<daemon::Credential> credentials;
  bool disk_is_full = false;
  bool slow = false;  // answers wait for answer_all()

  void answer_all() {
    for (const auto& one : std::exchange(waiting_, {})) one();
  }

  void add(const daemon::User& user, Then then) override {
    answer(std::move(then), [this, user] { users.push_back(user); });
  }
  void change(const daemon::User& user, Then then) override {
    answer(std::move(then), [this, user] {
      for (daemon::User& one : users)
        if (one.name == user.name) one = user;
      std::erase_if(credentials, [&](const daemon::Credential& c) {
        return c.user == user.name && c.kind == daemon::CredentialKind::kSession;
      });
    });
  }
  void remove_user(const std::string& name, Then then) override {
    answer(std::move(then), [this, name] {
      std::erase_if(users, [&](const daemon::User& one) { return one.name == name; });
      std::erase_if(credentials, [&](const daemon::Credential& c) { return c.user == name; });
    });
  }
  void add(const daemon::Credential& credential, Then then) override {
    answer(std::move(then), [this, credential] { credentials.push_back(credential); });
  }
  void end(const std::vector<std::string>& secrets, Then then) override {
    answer(std::move(then), [this, secrets] {
      std::erase_if(credentials,
                    [&](const daemon::Credential& c) { return std::ranges::count(secrets, c.secret) > 0; });
    });
  }

 private:
  template <class Act>
  void answer(Then then, Act act) {
    waiting_.push_back([this, then = std::move(then), act = std::move(act)] {
      if (!disk_is_full) act();
      then(disk_is_full ? Status(Error{ErrorCode::kStorage, "the disk is full"}) : Ok());
    });
    if (!slow) answer_all();
  }

  std::vector<std::function<void()>> waiting_;
};

// A calendar on a clock that stands still: whole seconds from the morning of a day.
inline std::string calendar_time(TimePoint now, std::chrono::seconds ahead) {
  using namespace std::chrono;
  const auto since = duration_cast<seconds>(now.time_since_epoch()) + ahead;
  const sys_days day = sys_days(year(2026) / 5 / 1) + floor<days>(since);
  const hh_mm_ss time(since - floor<days>(since));
  const year_month_day date(day);
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.000Z", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(time.hours().count()), static_cast<int>(time.minutes().count()),
                static_cast<int>(time.seconds().count()));
  return text;
}

}  // namespace veneer::testing
