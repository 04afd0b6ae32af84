// Users, sessions and tokens on a calendar that stands still, and how often a password may be tried.
#include "daemon/api/accounts.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/clock.h"
#include "daemon/api/sign_in_throttle.h"
#include "tests/support/account_memory.h"

namespace veneer::daemon {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class AccountsTest : public ::testing::Test {
 protected:
  Accounts::Then into(Status& status) {
    return [&status](const Status& told) { status = told; };
  }
  Status add(const std::string& name, Role role) {
    Status done = Ok();
    accounts.add_user(name, role, "$argon2id$" + name, into(done));
    return done;
  }
  std::string sign_in(const std::string& name) {
    std::string secret;
    accounts.open_session(name, accounts.user(name)->password,
                          [&](const Result<std::string>& got) { secret = got ? *got : got.error().message; });
    return secret;
  }
  Result<std::string> token(const std::string& user, const std::string& name, Role role, int days) {
    Result<std::string> out = Error{ErrorCode::kInternal, "not told"};
    accounts.new_token(user, name, role, days, [&](const Result<std::string>& got) { out = got; });
    return out;
  }
  // "user anna, operator"; "nobody"
  static std::string who(const Accounts& in, const std::string& secret) {
    const auto caller = in.who_has(secret);
    return caller ? caller->who + ", " + to_string(caller->role) : "nobody";
  }
  std::string who(const std::string& secret) const { return who(accounts, secret); }

  ManualClock clock;
  testing::AccountMemory store;
  Accounts::Calendar calendar = [this](seconds ahead) { return testing::calendar_time(clock.now(), ahead); };
  Accounts accounts{calendar, store};
};

TEST_F(AccountsTest, ASessionIsItsUsersUntilItsTimeIsOver) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string secret = sign_in("anna");
  EXPECT_GE(secret.size(), 43U);
  EXPECT_EQ(who(secret), "user anna, operator");
  EXPECT_EQ(accounts.who_has(secret)->user, "anna");
  for (const std::string& other : {secret.substr(1), secret + "A", std::string(), store.credentials.at(0).secret})
    EXPECT_EQ(who(other), "nobody") << other;
  clock.advance(Accounts::kSessionLife - seconds(1));
  EXPECT_EQ(who(secret), "user anna, operator");
  clock.advance(seconds(1));
  EXPECT_EQ(who(secret), "nobody");
  accounts.forget_expired();
  EXPECT_THAT(store.credentials, IsEmpty());
}

TEST_F(AccountsTest, NothingThatOpensADoorIsInTheStore) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string secret = sign_in("anna");
  const std::string made = *token("anna", "press", Role::kViewer, 30);
  ASSERT_THAT(store.credentials, SizeIs(2));
  for (const Credential& kept : store.credentials) {
    EXPECT_THAT(kept.secret, SizeIs(64));
    EXPECT_NE(kept.secret, secret);
    EXPECT_NE(kept.secret, made);
  }
}

TEST_F(AccountsTest, SessionsAndTokensOutliveTheDaemon) {
  ASSERT_TRUE(add("anna", Role::kMaintainer).ok());
  const std::string session = sign_in("anna"), press = *token("anna", "press", Role::kOperator, 1);
  std::string link;
  accounts.open_link_session("console link 7 of uid 1000", Role::kOperator,
                             [&](const Result<std::string>& got) { link = *got; });
  Accounts later(calendar, store);
  later.load(store.users, store.credentials);
  EXPECT_EQ(who(later, session), "user anna, maintainer");
  EXPECT_EQ(who(later, press), "token press of user anna, operator");
  EXPECT_EQ(who(later, link), "console link 7 of uid 1000, operator");
  EXPECT_EQ(later.last_link(), 7);
  clock.advance(hours(24));
  EXPECT_EQ(who(later, press), "nobody");
}

TEST_F(AccountsTest, ANewPasswordOrRoleEndsSessionsAndATokenIsNeverMoreThanItsUser) {
  ASSERT_TRUE(add("anna", Role::kAdmin).ok());
  const std::string first = sign_in("anna"), press = *token("anna", "press", Role::kMaintainer, 30);
  int ended = 0;
  accounts.on_ended([&] { ++ended; });
  Status done = Ok();
  accounts.set_password("anna", "$argon2id$new", into(done));
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(who(first), "nobody");
  EXPECT_EQ(who(press), "token press of user anna, maintainer");
  const std::string second = sign_in("anna");
  const Caller caller = *accounts.who_has(press);
  EXPECT_TRUE(accounts.holds(caller));
  accounts.set_role("anna", Role::kOperator, into(done));
  EXPECT_EQ(who(second), "nobody");
  EXPECT_EQ(who(press), "token press of user anna, operator");
  EXPECT_FALSE(accounts.holds(caller)) << "who listens with it has another role now";
  EXPECT_EQ(ended, 2);
  EXPECT_THAT(store.credentials, SizeIs(1)) << "the token";
}

TEST_F(AccountsTest, WhoIsRemovedIsOutAtOnceAndStaysOut) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string session = sign_in("anna"), press = *token("anna", "press", Role::kOperator, 30);
  Status done = Ok();
  accounts.remove_user("anna", into(done));
  EXPECT_TRUE(done.ok());
  EXPECT_EQ(who(session), "nobody");
  EXPECT_EQ(who(press), "nobody");
  EXPECT_THAT(store.users, IsEmpty());
  EXPECT_THAT(store.credentials, IsEmpty());
  accounts.remove_user("anna", into(done));
  EXPECT_EQ(done.error().code, ErrorCode::kNotFound);
}

// A password was being looked at while somebody gave the account another one.
TEST_F(AccountsTest, APasswordThatWasJustReplacedOpensNothing) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string verified = accounts.user("anna")->password;
  Status done = Ok();
  accounts.set_password("anna", "$argon2id$new", into(done));
  Result<std::string> got = Error{ErrorCode::kInternal, "not told"};
  accounts.open_session("anna", verified, [&](const Result<std::string>& told) { got = told; });
  ASSERT_FALSE(got.ok());
  EXPECT_EQ(got.error().code, ErrorCode::kConflict);
  EXPECT_THAT(store.credentials, IsEmpty());
}

TEST_F(AccountsTest, SoDoesAChangeOfOnesOwnPassword) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string verified = accounts.user("anna")->password;
  Status done = Ok();
  accounts.set_password("anna", "$argon2id$by the admin", into(done));
  accounts.change_password("anna", verified, "$argon2id$by a thief", into(done));
  EXPECT_EQ(done.error().code, ErrorCode::kConflict);
  EXPECT_EQ(accounts.user("anna")->password, "$argon2id$by the admin");
  accounts.change_password("anna", "$argon2id$by the admin", "$argon2id$own", into(done));
  EXPECT_TRUE(done.ok());
  EXPECT_EQ(store.users.at(0).password, "$argon2id$own");
}

TEST_F(AccountsTest, AHigherRoleWaitsForTheStoreAndALowerOneDoesNot) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string session = sign_in("anna");
  store.disk_is_full = true;
  bool holds = true;
  Status done = Ok();
  const auto note = [&](const Outcome& told) { done = static_cast<const Status&>(told), holds = told.holds; };
  accounts.set_role("anna", Role::kAdmin, note);
  EXPECT_EQ(done.error().code, ErrorCode::kStorage);
  EXPECT_FALSE(holds);
  EXPECT_EQ(who(session), "user anna, operator") << "nothing changed, and who is signed in stays so";
  accounts.set_role("anna", Role::kViewer, note);
  EXPECT_THAT(done.error().message, HasSubstr("it holds until veneerd is started again"));
  EXPECT_TRUE(holds);
  EXPECT_EQ(accounts.user("anna")->role, Role::kViewer);
}

// Raised, and lowered or removed before the store has written that: the later word counts, here and in the store.
TEST_F(AccountsTest, ARaiseNeverUndoesALaterChange) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  Status raised = Ok(), later = Ok();
  store.slow = true;
  accounts.set_role("anna", Role::kAdmin, into(raised));
  accounts.set_role("anna", Role::kViewer, into(later));
  store.answer_all();
  EXPECT_EQ(raised.error().code, ErrorCode::kConflict);
  EXPECT_TRUE(later.ok());
  EXPECT_EQ(accounts.user("anna")->role, Role::kViewer);
  EXPECT_EQ(store.users.at(0).role, Role::kViewer);
  accounts.set_role("anna", Role::kAdmin, into(raised));
  accounts.remove_user("anna", into(later));
  store.answer_all();
  EXPECT_EQ(raised.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(accounts.user("anna"), nullptr);
}

// A store from before names were its own business: both end.
TEST_F(AccountsTest, ARevocationEndsEveryTokenOfTheName) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  store.slow = true;
  std::vector<std::string> made;
  for (int i = 0; i < 2; ++i)
    accounts.new_token("anna", "press", Role::kViewer, 30,
                       [&](const Result<std::string>& got) { made.push_back(*got); });
  store.answer_all();
  ASSERT_THAT(made, SizeIs(2)) << "this store takes both";
  Status done = Ok();
  accounts.revoke_token("anna", "press", into(done));
  for (const std::string& secret : made) EXPECT_EQ(who(secret), "nobody");
}

TEST_F(AccountsTest, OnAFullDiskWhatEndsHoldsAndWhatGivesMoreDoesNot) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  const std::string press = *token("anna", "press", Role::kOperator, 30);
  store.disk_is_full = true;
  EXPECT_EQ(add("berta", Role::kAdmin).error().code, ErrorCode::kStorage);
  EXPECT_EQ(accounts.user("berta"), nullptr);
  EXPECT_FALSE(token("anna", "other", Role::kOperator, 30).ok());
  EXPECT_EQ(who(sign_in("anna")), "user anna, operator") << "whoever has the password comes in";
  Status done = Ok();
  accounts.revoke_token("anna", "press", into(done));
  EXPECT_THAT(done.error().message, HasSubstr("it holds until veneerd is started again"));
  EXPECT_EQ(who(press), "nobody");
}

TEST_F(AccountsTest, TokensHaveANameARoleAndAnEnd) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  EXPECT_EQ(token("anna", "press", Role::kMaintainer, 30).error().code, ErrorCode::kRefused);
  EXPECT_EQ(token("berta", "press", Role::kViewer, 30).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(token("anna", "", Role::kViewer, 30).error().code, ErrorCode::kInvalidArgument);
  ASSERT_TRUE(token("anna", "press", Role::kViewer, 30).ok());
  EXPECT_EQ(token("anna", "press", Role::kViewer, 30).error().code, ErrorCode::kConflict);
  EXPECT_EQ(accounts.tokens().at(0).expires_at, "2026-05-31T00:00:00.000Z");
  Status done = Ok();
  accounts.revoke_token("anna", "press", into(done));
  EXPECT_TRUE(done.ok());
  EXPECT_THAT(accounts.tokens(), IsEmpty());
  accounts.revoke_token("anna", "press", into(done));
  EXPECT_EQ(done.error().code, ErrorCode::kNotFound);
}

TEST_F(AccountsTest, TheOldestSessionsOfAUserMakeRoomForNewOnesAndForNobodyElses) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  ASSERT_TRUE(add("berta", Role::kOperator).ok());
  const std::string other = sign_in("berta"), first = sign_in("anna");
  std::string last;
  for (std::size_t i = 0; i < Accounts::kMostSessions; ++i) last = sign_in("anna");
  EXPECT_EQ(who(first), "nobody");
  EXPECT_EQ(who(last), "user anna, operator");
  EXPECT_EQ(who(other), "user berta, operator");
  EXPECT_THAT(store.credentials, SizeIs(Accounts::kMostSessions + 1));
}

TEST_F(AccountsTest, SoDoThoseOfOneMakersLinks) {
  const auto link = [&](const std::string& name) {
    std::string secret;
    accounts.open_link_session(name, Role::kOperator, [&](const Result<std::string>& got) { secret = *got; });
    return secret;
  };
  const std::string other = link("console link 1 of uid 0"), first = link("console link 2 of uid 1000");
  for (std::size_t i = 0; i < Accounts::kMostSessions; ++i) link(fmt::format("console link {} of uid 1000", i + 3));
  EXPECT_EQ(who(first), "nobody");
  EXPECT_EQ(who(other), "console link 1 of uid 0, operator");
}

TEST_F(AccountsTest, SessionsOfAllLinksEndTogetherAndNobodyElses) {
  ASSERT_TRUE(add("anna", Role::kOperator).ok());
  std::vector<std::string> links;
  for (const char* name : {"console link 1 of uid 0", "console link 2 of uid 1000"})
    accounts.open_link_session(name, Role::kAdmin, [&](const Result<std::string>& got) { links.push_back(*got); });
  const std::string anna = sign_in("anna");
  std::size_t ended = 0;
  accounts.end_link_sessions([&](const Outcome& done, std::size_t sessions) {
    EXPECT_TRUE(done.ok());
    ended = sessions;
  });
  EXPECT_EQ(ended, 2U);
  for (const std::string& link : links) EXPECT_EQ(who(link), "nobody");
  EXPECT_EQ(who(anna), "user anna, operator");
  EXPECT_THAT(store.credentials, SizeIs(1)) << "they stay out after a restart";
}

TEST(AccountNames, AreSmallLettersDigitsDotsAndDashes) {
  for (const char* good : {"a", "anna", "anna.b-2_c"}) EXPECT_TRUE(check_user_name(good).ok()) << good;
  for (const char* bad : {"", "Anna", "2anna", "anna b", "änna", "a/b", "abcdefghijabcdefghijabcdefghijabc"})
    EXPECT_FALSE(check_user_name(bad).ok()) << bad;
  EXPECT_FALSE(check_password("1234567").ok());
  EXPECT_TRUE(check_password("12345678").ok());
  EXPECT_FALSE(check_password(std::string(257, 'a')).ok());
}

// ---- how often ------------------------------------------------------------------------------------------------------

class ThrottleTest : public ::testing::Test {
 protected:
  // Seconds to wait; 0: the try counts.
  long tried(const std::string& name, const std::string& address) {
    const auto wait = throttle.begin(name, address);
    return wait ? wait->count() : 0;
  }
  ManualClock clock;
  SignInThrottle throttle{clock};
};

TEST_F(ThrottleTest, ThreeAMinuteFiveInTenMinutesTenAnHour) {
  std::vector<long> waits;
  for (int i = 0; i < 4; ++i) waits.push_back(tried("anna", "10.0.0.1"));
  EXPECT_EQ(waits, (std::vector<long>{0, 0, 0, 60}));
  clock.advance(seconds(59));
  EXPECT_EQ(tried("anna", "10.0.0.1"), 1) << "what was refused did not count";
  clock.advance(seconds(1));
  EXPECT_EQ(tried("anna", "10.0.0.1"), 0);
  EXPECT_EQ(tried("anna", "10.0.0.1"), 0);
  EXPECT_EQ(tried("anna", "10.0.0.1"), 540) << "five in ten minutes";
  clock.advance(minutes(9));
  int more = 0;
  for (int i = 0; i < 600 && more < 5; ++i, clock.advance(seconds(5))) more += tried("anna", "10.0.0.1") == 0 ? 1 : 0;
  EXPECT_EQ(more, 5);
  clock.advance(minutes(11));
  EXPECT_GT(tried("anna", "10.0.0.1"), 600) << "ten an hour";
  clock.advance(hours(1));
  EXPECT_EQ(tried("anna", "10.0.0.1"), 0);
}

// What goes through within any hour, however it is tried.
TEST_F(ThrottleTest, NoWayOfTryingGetsMoreThanTenAnHourThrough) {
  int through = 0;
  for (int second = 0; second < 3600; ++second, clock.advance(seconds(1)))
    through += tried("anna", "10.0.0.1") == 0 ? 1 : 0;
  EXPECT_EQ(through, 10);
}

TEST_F(ThrottleTest, CountsNamesAndAddressesEachForThemselves) {
  for (const char* address : {"10.0.0.1", "10.0.0.2", "10.0.0.3"}) EXPECT_EQ(tried("anna", address), 0);
  EXPECT_GT(tried("anna", "10.0.0.4"), 0) << "one name from many addresses";
  EXPECT_EQ(tried("berta", "10.0.0.4"), 0);
  EXPECT_EQ(tried("carla", "10.0.0.4"), 0);
  EXPECT_EQ(tried("doris", "10.0.0.4"), 0);
  EXPECT_GT(tried("emma", "10.0.0.4"), 0) << "many names from one address";
  EXPECT_EQ(tried("emma", "10.0.0.5"), 0) << "and was not counted";
}

TEST_F(ThrottleTest, WhoKnowsThePasswordIsNotCounted) {
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(tried("anna", "10.0.0.1"), 0) << i;
    throttle.was_right("anna", "10.0.0.1");
  }
}

TEST_F(ThrottleTest, KnowsThisMachineAndWhereSomebodyHasSignedIn) {
  for (const char* own : {"", "127.0.0.1", "127.8.0.1", "::1", "::ffff:127.0.0.1"})
    EXPECT_TRUE(throttle.knows(own)) << own;
  EXPECT_FALSE(throttle.knows("10.0.0.1"));
  EXPECT_EQ(tried("anna", "10.0.0.1"), 0);
  EXPECT_FALSE(throttle.knows("10.0.0.1")) << "only tried";
  throttle.was_right("anna", "10.0.0.1");
  EXPECT_TRUE(throttle.knows("10.0.0.1"));
  throttle.was_right("anna", "2001:db8:1:2::1");
  EXPECT_TRUE(throttle.knows("2001:db8:1:2::9"));
  for (std::size_t i = 0; i + 1 < SignInThrottle::kMostKnown; ++i) throttle.was_right("anna", "a" + std::to_string(i));
  EXPECT_FALSE(throttle.knows("10.0.0.1")) << "the one that was right first is forgotten first";
  EXPECT_TRUE(throttle.knows("2001:db8:1:2::1"));
}

// A /64 of IPv6 is one host's to choose from.
TEST_F(ThrottleTest, OneHostWithManyAddressesIsOne) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(tried("", "2001:db8:1:2::" + std::to_string(i)), 0);
  EXPECT_GT(tried("", "2001:db8:1:2:aaaa::1"), 0);
  EXPECT_EQ(tried("", "2001:db8:1:3::1"), 0);
}

// A name that nobody has takes no memory; of addresses the quietest is forgotten, and nobody is kept out for them.
TEST_F(ThrottleTest, ManyAddressesCloseTheDoorToNobodyElse) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(tried("", "10.0.0.1"), 0);
  for (std::size_t i = 0; i < SignInThrottle::kMostAddresses + 50; ++i) {
    clock.advance(std::chrono::milliseconds(1));
    ASSERT_EQ(tried("", "a" + std::to_string(i)), 0) << i;
  }
  EXPECT_EQ(tried("anna", "10.0.0.9"), 0);
  EXPECT_EQ(tried("", "10.0.0.1"), 0) << "forgotten";
}

}  // namespace
}  // namespace veneer::daemon
