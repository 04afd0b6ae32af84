#include "cli/power.h"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace veneer::cli {
namespace {

using ::testing::HasSubstr;

double fraction(const std::string& text) {
  const auto power = power_of(text);
  EXPECT_TRUE(power.ok()) << text;
  return power ? *power : -1;
}

std::string refused_power(const std::string& text) {
  const auto power = power_of(text);
  EXPECT_FALSE(power.ok()) << text;
  return power ? "" : power.error().message;
}

TEST(Power, IsPerCentAndSaysSo) {
  EXPECT_DOUBLE_EQ(fraction("60%"), 0.6);
  EXPECT_DOUBLE_EQ(fraction("1%"), 0.01);
  EXPECT_DOUBLE_EQ(fraction("2.5 %"), 0.025);
  EXPECT_DOUBLE_EQ(fraction("100%"), 1);
  EXPECT_DOUBLE_EQ(fraction("0%"), 0);
  EXPECT_DOUBLE_EQ(fraction("0"), 0);
}

// 1 was 1 % of one command and all of another's.
TEST(Power, WithoutAUnitIsRefusedWithWhatToWrite) {
  EXPECT_THAT(refused_power("1"), HasSubstr("write 1% or 100%"));
  EXPECT_THAT(refused_power("0.07"), HasSubstr("write 0.07% or 7%"));
  EXPECT_THAT(refused_power("50"), HasSubstr("write 50%"));
  EXPECT_THAT(refused_power("high"), HasSubstr("as in 60%"));
  EXPECT_THAT(refused_power(""), HasSubstr("as in 60%"));
  EXPECT_THAT(refused_power("nan%"), HasSubstr("as in 60%"));
  EXPECT_THAT(refused_power("120%"), HasSubstr("0% to 100%"));
  EXPECT_THAT(refused_power("-5%"), HasSubstr("0% to 100%"));
}

TEST(Overrides, AreWhatTheDescriptionOfTheApiSays) {
  std::ifstream file(VENEER_OPENAPI);
  const auto openapi = nlohmann::json::parse(file, nullptr, false);
  const auto& properties = openapi["paths"]["/api/v1/laser/overrides"]["post"]["requestBody"]["content"]
                                  ["application/json"]["schema"]["properties"];
  EXPECT_EQ(properties["feed"]["minimum"], kFeedOverride.least);
  EXPECT_EQ(properties["feed"]["maximum"], kFeedOverride.most);
  EXPECT_EQ(properties["rapid"]["enum"], (nlohmann::json{kRapidOverride.least, 50, kRapidOverride.most}));
  EXPECT_EQ(properties["power"]["minimum"], kPowerOverride.least);
  EXPECT_EQ(properties["power"]["maximum"], kPowerOverride.most);
}

}  // namespace
}  // namespace veneer::cli
