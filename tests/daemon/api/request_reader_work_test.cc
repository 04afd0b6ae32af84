// How much the reader does for a body, counted: each stretch of its code and of the parser's that it goes through calls
// the function below (-fsanitize-coverage=trace-pc), the look at how deeply a body nests (base/json_depth.h) among
// them. What libraries do for them (memory, copies) is not counted. No clock is asked, so every machine counts the
// same.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "base/json_depth.h"
#include "daemon/api/request_reader.h"

namespace {
std::uint64_t steps = 0;
}

extern "C" void __sanitizer_cov_trace_pc() { ++steps; }  // NOLINT(bugprone-reserved-identifier)

namespace veneer::daemon {
namespace {

std::uint64_t steps_for(const std::string& body) {
  ApiRequest request;
  request.body = body;
  const std::uint64_t before = steps;
  auto reader = RequestReader::body_of(request);
  const std::uint64_t taken = steps - before;
  EXPECT_FALSE(reader.end().ok()) << "nobody asked for what is in it";
  return taken;
}

std::string list_of_objects(int count) {
  std::string body = R"({"a":[)";
  for (int i = 0; i < count; ++i) body += R"({"b":0},)";
  return body + "0]}";
}

std::string object_of_keys(int count) {
  std::string body = "{";
  for (int i = 0; i < count; ++i) body += "\"k" + std::to_string(10000 + i) + "\":0,";
  return body + "\"last\":0}";
}

// As many members as it has, each looked at as often as there are others, were 40 ms of 64 KiB: 82 times the work of a
// body of a tenth. It is 9.9 times now.
TEST(RequestReader, TheWorkItTakesGrowsNoFasterThanTheBody) {
  const std::uint64_t few = steps_for(list_of_objects(800)), many = steps_for(list_of_objects(8000));
  EXPECT_GT(few, 250 * 800U) << "not all of the reader is counted";
  EXPECT_LT(many, 11 * few);
}

// Each key is looked for among those before it, which takes the logarithm of their number.
TEST(RequestReader, TheWorkOfOneObjectOfManyKeysGrowsHardlyFasterThanTheBody) {
  const std::uint64_t few = steps_for(object_of_keys(600)), many = steps_for(object_of_keys(6000));
  EXPECT_GT(few, 100 * 600U) << "not all of the reader is counted";
  EXPECT_LT(many, 15 * few);
}

TEST(RequestReader, HowDeeplyABodyNestsIsSeenByTheWay) {
  const auto steps_of = [](std::size_t bytes) {
    const std::string body = std::string(bytes / 2, '[') + std::string(bytes / 2, ']');
    const std::uint64_t before = steps;
    EXPECT_FALSE(nested_too_deeply(body, static_cast<int>(bytes)));
    return steps - before;
  };
  const std::uint64_t few = steps_of(6000), many = steps_of(60000);
  EXPECT_GT(few, 6000U) << "it is not counted";
  EXPECT_LT(many, 11 * few);
}

}  // namespace
}  // namespace veneer::daemon
