// What is asked twice with one key is done once.
#include "daemon/api/idempotency.h"

#include <gtest/gtest.h>

#include "base/hash.h"
#include "daemon/api/router.h"

namespace veneer::daemon {
namespace {

class Idempotency : public ::testing::Test {
 protected:
  Idempotency() {
    router.remember_in(keys);
    router.on_change([this](const Router::Change& change) {
      notes.push_back(change.caller.who + " " + std::string(change.operation) + (change.refused ? " refused" : "") +
                      (change.task ? " began task " + std::to_string(*change.task) : "") + " " + change.detail);
    });
    router.bind("scan", [this](const ApiRequest&, Reply reply) {
      ++scans;
      if (hold) return held.push_back(std::move(reply));
      if (answer) return reply(*answer);
      reply(refuse ? ApiReply::error(Error{ErrorCode::kConflict, "the scanner is busy: wait"}) : ApiReply::task(scans));
    });
    router.bind("getStatus", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({{"state", "Idle"}})); });
    router.bind("openSession", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({{"ok", true}})); });
  }

  void send(const std::string& key, const std::string& body = "{}", const std::string& who = "uid 1000",
            const std::string& method = "POST", const std::string& path = "/api/v1/scans") {
    const auto match = router.match(method, path);
    ASSERT_NE(match.route, nullptr);
    ApiRequest request;
    request.method = method;
    request.path = path;
    request.body = body;
    request.idempotency_key = key;
    request.caller.who = who;
    match.route->handler(request, [this](ApiReply reply) { replies.push_back(std::move(reply)); });
  }
  nlohmann::json last() const { return nlohmann::json::parse(replies.back().body); }

  ManualClock clock;
  IdempotencyKeys keys{clock};
  Router router;
  std::vector<std::string> notes;
  std::vector<ApiReply> replies;
  std::vector<Reply> held;
  int scans = 0;
  bool hold = false, refuse = false;
  std::optional<ApiReply> answer;  // instead of a task's
};

TEST_F(Idempotency, ARepetitionGetsTheFirstReplyAndDoesNothing) {
  send("a");
  EXPECT_EQ(last()["task"], 1);
  send("a");
  EXPECT_EQ(scans, 1);
  EXPECT_EQ(replies.back().status, 202);
  EXPECT_EQ(last()["task"], 1);
  EXPECT_EQ(replies.back().headers.back().first, "Idempotency-Replayed");
  send("b");
  EXPECT_EQ(last()["task"], 2);
  send("");
  EXPECT_EQ(last()["task"], 3) << "without a key every request counts";
}

TEST_F(Idempotency, ARepetitionThatComesTooEarlyWaitsForTheFirstReply) {
  hold = true;
  send("a");
  send("a");
  EXPECT_TRUE(replies.empty());
  held.front()(ApiReply::task(7));
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].body, replies[1].body);
  EXPECT_EQ(scans, 1);
}

TEST_F(Idempotency, AnotherRequestWithTheSameKeyIsRefused) {
  send("a", "{}");
  send("a", R"({"more":true})");
  EXPECT_EQ(replies.back().status, 409) << replies.back().body;
  EXPECT_EQ(scans, 1);
}

// A retouched picture is as large as it was, and begins and ends as it did.
TEST_F(Idempotency, ALargeBodyThatDiffersInItsMiddleIsAnotherRequest) {
  ApiRequest request;
  request.method = "POST";
  request.path = "/api/v1/plans";
  std::string picture(100'000, 'x');
  request.body = picture;
  const std::string before = fingerprint_of(request);
  EXPECT_EQ(fingerprint_of(request), before);
  picture[50'000] = 'y';
  request.body = picture;
  EXPECT_NE(fingerprint_of(request), before);
}

// Keys of requests that make jobs are kept in the database, and outlast an update of this program.
TEST_F(Idempotency, TheFingerprintOfASmallBodyIsWhatItAlwaysWas) {
  ApiRequest request;
  request.method = "POST";
  request.path = "/api/v1/jobs";
  request.query = {{"plan", "7"}};
  request.body = R"({"plan":7})";
  EXPECT_EQ(fingerprint_of(request),
            sha256_hex(std::as_bytes(std::span(std::string_view("POST /api/v1/jobs?plan=7&\n10\n{\"plan\":7}")))));
}

TEST_F(Idempotency, KeysBelongToWhoSentThem) {
  send("a", "{}", "uid 1000");
  send("a", "{}", "console link 1 of uid 1000");
  EXPECT_EQ(scans, 2);
}

TEST_F(Idempotency, WhatWasRefusedOrDroppedMayBeTriedAgain) {
  refuse = true;
  send("a");
  EXPECT_EQ(replies.back().status, 409);
  refuse = false;
  send("a");
  EXPECT_EQ(replies.back().status, 202);
  hold = true;
  send("b");
  held.clear();  // the handler forgets to reply
  hold = false;
  send("b");
  EXPECT_EQ(scans, 4);
  EXPECT_EQ(last()["task"], 4);
}

// It was done: a repetition is told so, and how to see what came of it.
TEST_F(Idempotency, WhatWasDoneIsNotDoneAgainWhereTheReplyIsTooLargeToKeep) {
  answer = ApiReply::json({{"pieces", std::string(IdempotencyKeys::kLargestReply + 1, 'x')}});
  send("a");
  EXPECT_EQ(replies.back().body, answer->body);
  send("a");
  EXPECT_EQ(scans, 1);
  EXPECT_EQ(replies.back().status, 409);
  EXPECT_EQ(last()["error"]["code"], "conflict");
  EXPECT_EQ(last()["error"]["sentence"], "this was done already (200), and its reply was too large to be kept");
  EXPECT_EQ(last()["error"]["remedy"], "look at what it changed");
  answer = ApiReply::json({{"pieces", std::string(IdempotencyKeys::kLargestReply - 100, 'x')}});
  send("b");
  send("b");
  EXPECT_EQ(replies.back().body, answer->body) << "one that fits is sent again";
}

TEST_F(Idempotency, AnErrorAboutAChangeThatHoldsIsToldAgainAndNothingIsDone) {
  answer = ApiReply::error(Error{ErrorCode::kStorage, "the disk is full: make room"});
  answer->changed = true;
  send("a");
  answer = ApiReply::task(2);
  send("a");
  EXPECT_EQ(scans, 1);
  EXPECT_EQ(replies.back().status, 500);
  EXPECT_EQ(last()["error"]["remedy"], "make room");
  ASSERT_FALSE(replies.back().headers.empty());
  EXPECT_EQ(replies.back().headers.back().first, "Idempotency-Replayed");
}

TEST_F(Idempotency, WhatIsStillBeingDoneIsForgottenForNobodysKeys) {
  hold = true;
  for (std::size_t i = 0; i < IdempotencyKeys::kMost; ++i) send("held-" + std::to_string(i));
  hold = false;
  send("more");
  EXPECT_EQ(replies.back().status, 429) << "there is no room for its key";
  for (const Reply& reply : held) reply(ApiReply::task(7));
  const int before = scans;
  send("held-0");
  EXPECT_EQ(scans, before);
  send("more");
  EXPECT_EQ(scans, before + 1);
}

TEST_F(Idempotency, KeysGrowOldAndTheirNumberIsBounded) {
  send("a");
  clock.advance(IdempotencyKeys::kLife + std::chrono::seconds(1));
  send("a");
  EXPECT_EQ(scans, 2);
  for (std::size_t i = 0; i < IdempotencyKeys::kMost; ++i) send("many " + std::to_string(i));
  EXPECT_EQ(replies.back().status, 400) << "a key has no spaces";
  for (std::size_t i = 0; i < IdempotencyKeys::kMost; ++i) send("many-" + std::to_string(i));
  const int before = scans;
  send("many-1");
  EXPECT_EQ(scans, before);
  send("a");
  EXPECT_EQ(scans, before + 1) << "the oldest is forgotten";
}

TEST_F(Idempotency, NobodysManyKeysMakeTheCellForgetWhatAnotherBegan) {
  send("mine");
  const auto first = last();
  for (std::size_t i = 0; i < 3 * IdempotencyKeys::kMost; ++i) send("many-" + std::to_string(i), "{}", "uid 1001");
  const int before = scans;
  send("mine");
  EXPECT_EQ(scans, before);
  EXPECT_EQ(last(), first);
}

TEST_F(Idempotency, EveryChangeIsNotedWithWhoAskedAndEveryRefusalToo) {
  send("", R"({"more":true})", "uid 1000");
  refuse = true;
  send("", "{}", "console link 3 of uid 0");
  send("", "", "anonymous", "GET", "/api/v1/status");
  ASSERT_EQ(notes.size(), 4U);
  EXPECT_EQ(notes[0], R"(uid 1000 scan POST /api/v1/scans {"more":true})");
  EXPECT_EQ(notes[1], "uid 1000 scan began task 1 ");
  EXPECT_EQ(notes[2], "console link 3 of uid 0 scan POST /api/v1/scans {}");
  EXPECT_EQ(notes[3].substr(0, 36), "console link 3 of uid 0 scan refused");
  EXPECT_NE(notes[3].find("the scanner is busy"), std::string::npos);
}

TEST_F(Idempotency, ARepetitionIsNotNotedTwiceAndASecretNotAtAll) {
  send("a");
  send("a");
  EXPECT_EQ(notes.size(), 2U) << "the request, and the task that it began";
  send("", R"({"token":"very-secret"})", "anonymous", "POST", "/api/v1/session");
  ASSERT_EQ(notes.size(), 3U);
  EXPECT_EQ(notes[2].find("very-secret"), std::string::npos) << notes[2];
}

// Every operation of the table that changes something goes through one door.
TEST(EveryChange, IsNotedWithWhoAskedAndDoneOnceWithAKey) {
  int changing = 0;
  for (const ApiOperation& operation : api_operations()) {
    if (operation.method == "GET" || operation.asks || operation.id == "stop") continue;
    SCOPED_TRACE(operation.id);
    ManualClock clock;
    IdempotencyKeys keys(clock);
    Router router;
    router.remember_in(keys);
    std::vector<std::string> notes;
    router.on_change([&](const Router::Change& change) {
      notes.push_back(change.caller.who + " " + std::string(change.operation));
    });
    int done = 0;
    router.bind(operation.id, [&](const ApiRequest&, const Reply& reply) {
      ++done;
      reply(ApiReply::json({{"done", done}}));
    });
    std::string path(operation.pattern);
    for (auto at = path.find('{'); at != std::string::npos; at = path.find('{'))
      path.replace(at, path.find('}', at) - at + 1, "1");
    const auto match = router.match(operation.method, path);
    ASSERT_NE(match.route, nullptr);
    ApiRequest request;
    request.method = operation.method;
    request.path = path;
    request.path_params = match.path_params;
    request.caller.who = "user anna";
    std::vector<ApiReply> replies;
    const auto send = [&](const char* key) {
      request.idempotency_key = key;
      match.route->handler(request, [&](ApiReply reply) { replies.push_back(std::move(reply)); });
    };
    send("a");
    send("a");
    ASSERT_EQ(replies.size(), 2U);
    // Who sends a password twice is told anew whether it is right: nothing of it is kept.
    const bool secret = operation.takes == Takes::kSecrets;
    EXPECT_EQ(done, secret ? 2 : 1);
    EXPECT_EQ(replies[0].body == replies[1].body, !secret);
    EXPECT_EQ(notes, std::vector<std::string>(secret ? 2 : 1, "user anna " + std::string(operation.id)));
    send("has spaces");
    EXPECT_EQ(replies.back().status, secret ? 200 : 400);
    EXPECT_EQ(done, secret ? 3 : 1);
    ++changing;
  }
  EXPECT_GT(changing, 60);
}

}  // namespace
}  // namespace veneer::daemon
