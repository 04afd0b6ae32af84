// What is done beside the wood: accounts and their tokens, requests that carry a key, certificates and the audit log.
#pragma once

#include "db/accounts.h"
#include "db/audit.h"
#include "db/certificates.h"
#include "tests/db/modelled_facts.h"

namespace veneer::db {

class ModelledPeople : public ModelledFacts {
 protected:
  void change_users() {
    Accounts accounts(cell_.database());
    const std::string name = *rc::gen::element<std::string>("anna", "ben");
    const std::string role = *rc::gen::element<std::string>("operator", "viewer");
    const bool known = users_.contains(name);
    const auto sign_out = [&](bool sessions_only) {
      std::erase_if(credentials_, [&](const auto& c) { return c.user == name && (c.session || !sessions_only); });
    };
    switch (*in_range(0, 4)) {
      case 0:
        RC_ASSERT(accounts.remove(name).ok() == known);
        users_.erase(name);
        return sign_out(false);
      case 1:
        RC_ASSERT(accounts.change({name, role, "$argon2id$v=19$y", kNow, kLater}).ok() == known);
        if (known) users_[name] = role;
        return sign_out(true);
      default:
        RC_ASSERT(accounts.add(UserRecord{name, role, "$argon2id$v=19$x", kNow, kNow}).ok() == !known);
        users_.emplace(name, role);
    }
  }
  void change_credentials() {
    Accounts accounts(cell_.database());
    const int what = *in_range(0, 8);
    if (what == 0) {
      VENEER_EXPECT_OK(accounts.end_all());
      return credentials_.clear();
    }
    if (what < 4 && !credentials_.empty()) {
      const auto index = *in_range<std::size_t>(0, credentials_.size());
      VENEER_EXPECT_OK(accounts.end({credentials_[index].secret}));
      credentials_.erase(credentials_.begin() + static_cast<std::ptrdiff_t>(index));
      return;
    }
    if (users_.empty()) change_users();
    const ModelCredential wanted{fmt::format("{:064}", ++secrets_), *rc::gen::element<std::string>("anna", "ben"),
                                 *rc::gen::arbitrary<bool>()};
    // One person's tokens have names of their own.
    const bool twice = !wanted.session && std::any_of(credentials_.begin(), credentials_.end(), [&](const auto& c) {
      return c.user == wanted.user && !c.session;
    });
    const Status added = accounts.add(CredentialRecord{wanted.secret, wanted.session ? "session" : "token", wanted.user,
                                                       "press", "viewer", kNow, kLater});
    RC_ASSERT(added.ok() == (users_.contains(wanted.user) && !twice));
    if (added.ok()) credentials_.push_back(wanted);
  }
  void take_request() {
    RequestKeys keys(cell_.database());
    const std::string key = *rc::gen::element<std::string>("k-1", "k-2", "k-3");
    const std::string hash = *rc::gen::element<std::string>("this", "that");
    const KeyedRequest request{"local:1000", "newJob", key, hash};
    const auto known = requests_.find(key);
    const int what = *in_range(0, 6);
    if (what == 0) {
      VENEER_EXPECT_OK(keys.forget(request));
      requests_.erase(key);
    } else if (what == 1) {
      RC_ASSERT(must(keys.prune(kLater)) == static_cast<int>(requests_.size()));
      requests_.clear();
    } else {
      const auto begun = keys.begin(request, kNow);
      RC_ASSERT(begun.ok() == (known == requests_.end() || known->second == hash));
      if (!begun.ok()) return RC_ASSERT(begun.error().code == ErrorCode::kConflict);
      RC_ASSERT(begun->has_value() == (known != requests_.end()));
      requests_.emplace(key, hash);
    }
  }
  void certify() {
    Certificates store(cell_.database());
    if (*in_range(0, 3) == 0) {
      VENEER_EXPECT_OK(store.laser_is(*rc::gen::element<std::string>("Grbl 1.1h", "Grbl 1.1f"), kNow));
    } else {
      certificates_.push_back(
          must(store.issue({{}, CertificateKind::kKerf, kNow, kLater, 0.01_mm, fmt::format("{}", ++tick_)})));
    }
  }
  void note() { VENEER_EXPECT_OK(Audit(cell_.database()).append({0, kLater, "local:1000", "note", "a remark"})); }

  void compare_people() {
    std::map<std::string, std::string> users;
    for (const UserRecord& user : must(Accounts(cell_.database()).users())) users[user.name] = user.role;
    RC_ASSERT(users == users_);
    std::vector<std::string> secrets, wanted;
    for (const auto& found : must(Accounts(cell_.database()).credentials())) secrets.push_back(found.secret);
    for (const auto& known : credentials_) wanted.push_back(known.secret);
    RC_ASSERT(secrets == wanted);
    std::vector<CertificateId> certificates;
    for (const auto& found : must(Certificates(cell_.database()).list()))
      certificates.insert(certificates.begin(), found.id);
    RC_ASSERT(certificates == certificates_);
  }
};

}  // namespace veneer::db
