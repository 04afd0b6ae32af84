#include "daemon/api/router.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/api/route_table.h"
#include "daemon/api/url.h"

namespace veneer::daemon {
namespace {

const Handler kNothing = [](const ApiRequest&, const Reply&) {};

TEST(Router, FindsTheRouteAndItsParameters) {
  Router router;
  router.bind("startJob", kNothing);
  const auto match = router.match("POST", "/api/v1/jobs/7/start?dry=1&name=Grace+Hopper%21");
  ASSERT_NE(match.route, nullptr);
  EXPECT_EQ(match.route->role, Role::kOperator);
  EXPECT_EQ(match.path_params.at("id"), "7");
  EXPECT_EQ(match.query.at("dry"), "1");
  EXPECT_EQ(match.query.at("name"), "Grace Hopper!");
}

TEST(Router, PrefersTheLiteralOverTheParameter) {
  Router router;
  router.add("GET", "/a/{x}", Role::kViewer, kNothing);
  router.add("GET", "/a/b", Role::kAdmin, kNothing);
  EXPECT_EQ(router.match("GET", "/a/b").route->pattern, "/a/b");
  EXPECT_EQ(router.match("GET", "/a/c").route->pattern, "/a/{x}");
}

TEST(Router, TellsWhichOperationsNobodyAnswers) {
  Router router;
  const auto before = router.unbound().size();
  router.bind("getStatus", kNothing);
  EXPECT_EQ(router.unbound().size(), before - 1);
}

TEST(Router, BindingTwiceOrTheUnknownIsABug) {
  Router router;
  router.bind("getStatus", kNothing);
  EXPECT_DEATH(router.bind("getStatus", kNothing), "");
  EXPECT_DEATH(router.bind("getCoffee", kNothing), "");
}

// Who did what is noted of every operation that changes something; that a new one changes nothing has to be said here.
TEST(Router, NotesEveryOperationButThoseThatOnlyAsk) {
  Router router;
  std::vector<std::string_view> only_ask;
  for (const ApiOperation& operation : api_operations()) {
    router.bind(operation.id, kNothing);
    const auto match = router.match(operation.method, operation.pattern);
    ASSERT_NE(match.route, nullptr) << operation.id;
    if (operation.method != "GET" && !match.route->changes) only_ask.push_back(operation.id);
  }
  EXPECT_THAT(only_ask, ::testing::ElementsAre("readDrawing", "sketchPlan", "sketchGrid", "sketchMosaic"));
}

// Anybody may try to open a session as often as he likes: only what was done is worth a line that is kept for ever.
TEST(Router, TellsOfWhatNeedsNoLoginOnlyOnceItWasDone) {
  Router router;
  std::vector<std::string> told;
  router.on_change([&](const Router::Change& change) {
    told.push_back(std::string(change.operation) + (change.refused ? " refused" : ""));
  });
  router.bind("openSession", [](const ApiRequest& request, const Reply& reply) {
    reply(request.body.text().find("good") != std::string::npos ? ApiReply::json({})
                                                                : ApiReply::error(403, "forbidden", "unknown"));
  });
  router.bind("cancelJob", [](const ApiRequest&, const Reply& reply) {
    reply(ApiReply::error(Error{ErrorCode::kConflict, "it is under way: stop it first"}));
  });
  const auto ask = [&](const std::string& path, const std::string& body) {
    ApiRequest request;
    request.method = "POST";
    request.path = path;
    request.body = body;
    request.content_type = "application/json";
    router.match("POST", path).route->handler(request, [](const ApiReply&) {});
  };
  for (int i = 0; i < 100; ++i) ask("/api/v1/session", R"({"token":"wrong"})");
  EXPECT_TRUE(told.empty());
  ask("/api/v1/session", R"({"token":"good"})");
  ask("/api/v1/jobs/1/cancel", "");
  EXPECT_EQ(told, (std::vector<std::string>{"openSession", "cancelJob", "cancelJob refused"}));
}

TEST(Url, DecodesWhatItMayAndRefusesTheRest) {
  EXPECT_EQ(percent_decode("a%20b+c", false), "a b+c");
  EXPECT_EQ(percent_decode("a%20b+c", true), "a b c");
  EXPECT_EQ(percent_decode("%c3%a4", false), "\xc3\xa4");
  for (const char* bad : {"%", "%4", "%4g", "%00", "%0a", "\n"}) EXPECT_EQ(percent_decode(bad, false), std::nullopt);
  EXPECT_TRUE(parse_target("/")->segments.empty());
  for (const char* bad : {"", "x", "//", "/a/", "/./a", "/a/..", "/a%2fb", "/a?x=%"}) {
    EXPECT_FALSE(parse_target(bad).has_value()) << bad;
  }
  EXPECT_EQ(parse_target("/a?x&y=&&z=1=2")->query.at("z"), "1=2");
}

TEST(Url, AQueryHasAtMostAHundredNames) {
  std::string target = "/a?";
  for (int i = 0; i < 100; ++i) target += "k" + std::to_string(i) + "=&";
  EXPECT_EQ(parse_target(target)->query.size(), 100U);
  EXPECT_FALSE(parse_target(target + "k=").has_value());
}

TEST(ApiMessage, ErrorsBecomeStatusAndSentence) {
  const ApiReply reply = ApiReply::error(Error{ErrorCode::kRefused, "wrong panel on the bed: load P-2"});
  EXPECT_EQ(reply.status, 422);
  const auto body = nlohmann::json::parse(reply.body);
  EXPECT_EQ(body["error"]["code"], "refused");
  EXPECT_EQ(body["error"]["message"], "wrong panel on the bed: load P-2");
  EXPECT_EQ(body["error"]["sentence"], "wrong panel on the bed");
  EXPECT_EQ(body["error"]["remedy"], "load P-2");
  EXPECT_TRUE(error_json("conflict", "the job is over")["remedy"].is_null());
  EXPECT_EQ(body["schema_version"], 1);
}

// What nothing answers is refused like all else, with what to do about it.
TEST(ApiMessage, WhatNoRouteTakesHasARemedyAsWell) {
  Router router;
  router.bind("getStatus", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({})); });
  const auto refused = [&](const char* method, const char* target) {
    const auto match = router.match(method, target);
    EXPECT_EQ(match.route, nullptr);
    return nlohmann::json::parse(match.refusal.body)["error"];
  };
  EXPECT_EQ(refused("GET", "/api/v1/stats")["sentence"], "nothing answers at this path");
  EXPECT_EQ(refused("GET", "/api/v1/stats")["remedy"], "docs/openapi.json lists what there is");
  EXPECT_EQ(refused("POST", "/api/v1/status")["sentence"], "this path does not take POST");
  EXPECT_EQ(refused("POST", "/api/v1/status")["remedy"], "send GET");
  EXPECT_EQ(refused("GET", "/a/../b")["sentence"], "the request's path or query cannot be read");
  EXPECT_EQ(refused("GET", "/a/../b")["remedy"], "write it as in a link, with %-codes of two digits");
}

// Clients show the remedy as what to do.
TEST(ApiMessage, WhatFollowsAColonIsARemedyAndNeverACauseOrForeignText) {
  const auto remedy = [](std::string_view message) {
    const auto error = error_json("conflict", message);
    EXPECT_EQ(error["message"], message);
    return error["remedy"].is_null() ? "none" : error["remedy"].get<std::string>();
  };
  EXPECT_EQ(remedy("the database refuses it (UNIQUE constraint failed: panels.name)"), "none");
  EXPECT_EQ(remedy("the database is damaged (malformed: row 3): put a backup in its place"),
            "put a backup in its place");
  EXPECT_EQ(remedy("panel \"offcut: large\" is taken"), "none");
  EXPECT_EQ(remedy("\"a: b\" is no name: choose another"), "choose another");
  EXPECT_EQ(remedy("this was seen to (focus, air assist): confirm it by --confirm \"air assist\""),
            "confirm it by --confirm \"air assist\"");
  EXPECT_EQ(remedy("the answer (was cut: off"), "none") << "what is left open may hold anything";
  EXPECT_EQ(remedy("piece A1-1: the lid is open: close it"), "close it");
}

TEST(ApiMessage, TextThatIsNotUtf8DoesNotThrow) {
  EXPECT_NE(ApiReply::json({{"name", "\xff\xfe"}}).body.find("name"), std::string::npos);
}

}  // namespace
}  // namespace veneer::daemon
