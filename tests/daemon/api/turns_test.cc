// Whose request is looked at next.
#include "daemon/api/turns.h"

#include <gtest/gtest.h>

#include <string>

namespace veneer::daemon {
namespace {

class TurnsTest : public ::testing::Test {
 protected:
  void come(const std::string& identity, int times = 1) {
    for (int i = 0; i < times; ++i) turns.wait(identity, [this, identity] { served += identity; });
  }
  void serve(int times) {
    for (int i = 0; i < times; ++i) turns.next()();
  }
  Turns turns;
  std::string served;
};

TEST_F(TurnsTest, GoRoundTheIdentities) {
  come("c", 100);
  come("a", 2);
  come("b");
  serve(6);
  EXPECT_EQ(served, "cabcac");
}

TEST_F(TurnsTest, WithinOneIdentityTheFirstGoesFirst) {
  for (const char* name : {"1", "2", "3"}) turns.wait("a", [this, name] { served += name; });
  serve(3);
  EXPECT_EQ(served, "123");
  EXPECT_TRUE(turns.empty());
}

TEST_F(TurnsTest, ComingAgainAndAgainGetsNobodyAhead) {
  come("a", 3);
  for (int i = 0; i < 3; ++i) {
    come("b");
    serve(2);
  }
  EXPECT_EQ(served, "ababab");
}

}  // namespace
}  // namespace veneer::daemon
