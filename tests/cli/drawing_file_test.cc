// Strokes as JSON, to be burnt as they are.
#include "cli/drawing_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/json_schema.h"

namespace veneer::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Strokes, AreReadStrictly) {
  const std::string text = R"({"schema_version":1,"strokes":[
      {"points_mm":[[0,0],[10,5]],"power":0.5,"speed_mm_s":20,"passes":2,"air":true,"layer":"cut"}]})";
  EXPECT_THAT(testing::schema_errors(nlohmann::json::parse(text), "strokes.schema.json"), IsEmpty());
  const auto good = read_strokes(text);
  ASSERT_TRUE(good.ok());
  ASSERT_EQ(good->lines.size(), 1U);
  EXPECT_EQ(good->lines[0].layer, "cut");
  EXPECT_EQ(good->lines[0].power, 0.5);
  EXPECT_EQ(good->lines[0].passes, 2);
  EXPECT_NEAR(length_of(*good), std::hypot(10, 5), 1e-9);
  const auto refused = [](const std::string& strokes) {
    const auto drawing = read_strokes(strokes);
    return drawing.ok() ? "taken" : drawing.error().message;
  };
  EXPECT_THAT(refused("[]"), HasSubstr("strokes as JSON"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[{"points_mm":[[0,0],[1,1]],"power":0.1,"power":1}]})"),
              HasSubstr("\"power\" is given twice"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[{"points_mm":[[0,0],[1,1]]}],"strokes":[]})"),
              HasSubstr("\"strokes\" is given twice"));
  EXPECT_THAT(refused(R"({"schema_version":2,"strokes":[{"points_mm":[[0,0],[1,1]]}]})"), HasSubstr("schema_version"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[{"points_mm":[[0,0]]}]})"), HasSubstr("fewer than two points"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[{"points_mm":[[0,0],[1]]}]})"), HasSubstr("points_mm"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[{"points_mm":[[0,0],[1,1]],"speed":3}]})"),
              HasSubstr("\"speed\" is not known"));
  EXPECT_THAT(refused(R"({"schema_version":1,"strokes":[]})"), HasSubstr("no strokes"));
}

}  // namespace
}  // namespace veneer::cli
