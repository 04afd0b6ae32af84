// How much the reader does for a body, counted: each stretch of its code and of the parser's that it goes through calls
// the function below (-fsanitize-coverage=trace-pc). What libraries do for them (memory, copies) and the look at how
// deeply a body nests (base/json_depth.h) are not counted. No clock is asked, so every machine counts the same.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "daemon/api/request_reader.h"

namespace {
std::uint64_t steps = 0;
}

extern "C" void __sanitizer_cov_trace_pc() { ++steps; }  // NOLINT(bugprone-reserved-identifier)

namespace veneer::daemon {
namespace {

std::uint64_t steps_for(std::size_t objects) {
  ApiRequest request;
  std::string body = R"({"a":[)";
  for (std::size_t i = 0; i < objects; ++i) body += R"({"b":0},)";
  request.body = body + "0]}";
  const std::uint64_t before = steps;
  auto reader = RequestReader::body_of(request);
  const std::uint64_t taken = steps - before;
  EXPECT_FALSE(reader.end().ok());
  return taken;
}

// As many members as it has, each looked at as often as there are others, were 40 ms of 64 KiB: 82 times the work of a
// body of a tenth. It is 9.9 times now.
TEST(RequestReader, TheWorkItTakesGrowsNoFasterThanTheBody) {
  const std::uint64_t few = steps_for(800), many = steps_for(8000);
  EXPECT_GT(few, 250 * 800U) << "not all of the reader is counted";
  EXPECT_LT(many, 11 * few);
}

}  // namespace
}  // namespace veneer::daemon
