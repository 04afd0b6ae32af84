#include "daemon/api/request_reader.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

ApiRequest with_body(const std::string& body) {
  ApiRequest request;
  request.body = body;
  return request;
}
ApiRequest with_query(std::map<std::string, std::string> query) {
  ApiRequest request;
  request.query = std::move(query);
  return request;
}

TEST(RequestReader, ReadsWhatIsThereAndLeavesOutWhatIsNot) {
  auto body = RequestReader::body_of(
      with_body(R"({"dry":true,"size_mm":50.5,"passes":2,"name":"oak","confirmed":["lid"],"powers":[0.1,1]})"));
  EXPECT_EQ(body.flag("dry"), true);
  EXPECT_EQ(body.number("size_mm"), 50.5);
  EXPECT_EQ(body.whole("passes", {1, 20}), 2);
  EXPECT_EQ(body.text("name"), "oak");
  EXPECT_EQ(body.texts("confirmed"), std::vector<std::string>{"lid"});
  EXPECT_EQ(body.numbers("powers", {0, 1}), (std::vector<double>{0.1, 1}));
  EXPECT_EQ(body.flag("check"), std::nullopt);
  EXPECT_TRUE(body.end().ok());
}

TEST(RequestReader, ReadsAQueryByTheSameRules) {
  auto query = RequestReader::query_of(with_query({{"width", "120"}, {"size_mm", "1e2"}, {"dry", "1"}}));
  EXPECT_EQ(query.whole("width", {16, 8192}), 120);
  EXPECT_EQ(query.number("size_mm"), 100);
  EXPECT_EQ(query.flag("dry"), true);
  EXPECT_TRUE(query.end().ok());
  for (const char* wrong : {"nan", "inf", "12x", "", " 1", "0x10"}) {
    auto reader = RequestReader::query_of(with_query({{"seed", wrong}}));
    EXPECT_EQ(reader.number("seed"), std::nullopt);
    EXPECT_EQ(reader.end().error().code, ErrorCode::kInvalidArgument) << wrong;
  }
}

TEST(RequestReader, SaysWhatIsWrongAndWhatItMustBe) {
  auto body = RequestReader::body_of(with_body(R"({"power":1.5})"));
  body.number("power", {0, 1});
  EXPECT_EQ(body.end().error().message, "power is 1.5: it must be a number from 0 to 1");
  auto misspelt = RequestReader::body_of(with_body(R"({"dri":true})"));
  misspelt.flag("dry");
  misspelt.number("size_mm");
  EXPECT_EQ(misspelt.end().error().message, "\"dri\" is not known here: the body of this request takes dry, size_mm");
  auto nothing = RequestReader::query_of(with_query({{"x", "1"}}));
  EXPECT_EQ(nothing.end().error().message, "\"x\" is not known here: the query of this request is empty");
}

TEST(RequestReader, DuplicateKeysAreRefusedAtAnyDepth) {
  for (const char* body : {R"({"dry":true,"dry":true})", R"({"a":{"dry":1,"dry":2}})", R"({"a":[{"dry":1,"dry":2}]})",
                           R"({"d\u0072y":true,"dry":false})"}) {
    auto reader = RequestReader::body_of(with_body(body));
    EXPECT_THAT(reader.end().error().message, HasSubstr("\"dry\" is given twice")) << body;
  }
  auto apart = RequestReader::body_of(with_body(R"({"a":{"dry":1},"b":{"dry":2},"dry":3})"));
  EXPECT_THAT(apart.end().error().message, HasSubstr("is not known here"));
}

TEST(RequestReader, AHostileBodyIsRefusedWithoutHarm) {
  for (const std::string& body :
       {std::string(100'000, '['), std::string("{\"a\":") + std::string(5000, '{'),
        // Brackets in a text open and close nothing.
        "{\"b\":\"" + std::string(5000, ']') + "\",\"a\":" + std::string(5000, '[') + std::string(5000, ']') + "}",
        std::string("\xff\xfe"), std::string("{\"a\":1e999}"), std::string("{}{}")}) {
    auto reader = RequestReader::body_of(with_body(body));
    reader.number("a");
    EXPECT_EQ(reader.end().error().code, ErrorCode::kInvalidArgument) << body.substr(0, 20);
    EXPECT_THAT(reader.end().error().message, ::testing::StartsWith("the body ")) << body.substr(0, 20);
  }
  auto long_text = RequestReader::body_of(with_body("{\"a\":\"" + std::string(5000, 'x') + "\"}"));
  long_text.flag("a");
  EXPECT_LT(long_text.end().error().message.size(), 200U);
}

TEST(RequestReader, WhatItMeansIsRefusedOnlyWhenAllElseIsRight) {
  auto body = RequestReader::body_of(with_body(R"({"x_mm":1,"size":2})"));
  body.number("x_mm");
  body.refuse({ErrorCode::kInvalidArgument, "x_mm and y_mm are given together"});
  EXPECT_THAT(body.end().error().message, HasSubstr("\"size\" is not known"));
}

// A body of 24 MiB may hold millions of values, and each would cost many times its bytes of memory.
TEST(RequestReader, ABodyOfMoreValuesThanADrawingHasIsRefusedBeforeItIsRead) {
  const auto list = [](std::size_t numbers) {
    std::string body = R"({"points_mm":[0)";
    for (std::size_t i = 1; i < numbers; ++i) body += ",0";
    return body + "]}";
  };
  auto most = RequestReader::body_of(with_body(list(kMostNumbers)));
  EXPECT_EQ(most.numbers("points_mm")->size(), kMostNumbers);
  EXPECT_TRUE(most.end().ok());
  auto more = RequestReader::body_of(with_body(list(kMostNumbers + 1)));
  EXPECT_EQ(more.numbers("points_mm"), std::nullopt);
  EXPECT_THAT(more.end().error().message, HasSubstr("more than 2250100 numbers"));
}

TEST(RequestReader, OnlyListsOfNumbersMayBeLong) {
  for (const char* item : {"[],", "{},", "\"\",", "{\"a\":1},"}) {
    std::string body = R"({"points_mm":[)";
    for (int i = 0; i < 70'000; ++i) body += item;
    auto reader = RequestReader::body_of(with_body(body + "0]}"));
    reader.numbers("points_mm");
    EXPECT_THAT(reader.end().error().message, HasSubstr("more texts, lists and objects")) << item;
  }
}

}  // namespace
}  // namespace veneer::daemon
