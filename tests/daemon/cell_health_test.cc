#include "daemon/cell_health.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

class CellHealthTest : public ::testing::Test {
 protected:
  ManualClock clock_;
  std::function<void()> answer_;  // of the database, not given yet
  bool answers_ = true, moving_ = false, linked_ = true;
  CellHealth health_{clock_,
                     {[this](std::function<void()> answered) {
                        if (answers_)
                          answered();
                        else
                          answer_ = std::move(answered);
                      },
                      [this] { return moving_; }, [this] { return linked_; }},
                     seconds(5)};
  bool after(seconds passed) {
    clock_.advance(passed);
    return health_.good();
  }
};

TEST_F(CellHealthTest, IsGoodWhileEverybodyAnswers) {
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(after(seconds(3)));
  EXPECT_EQ(health_.sentence(), "");
}

TEST_F(CellHealthTest, ADatabaseThatHangsEndsIt) {
  answers_ = false;
  EXPECT_TRUE(after(seconds(3)));
  EXPECT_TRUE(after(seconds(4)));
  EXPECT_FALSE(after(seconds(2)));
  EXPECT_THAT(health_.sentence(), HasSubstr("database"));
  answers_ = true;
  answer_();  // it was only slow
  EXPECT_TRUE(after(seconds(1)));
}

TEST_F(CellHealthTest, ALaserThatIsOffAtRestIsNoFault) {
  linked_ = false;
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(after(seconds(3)));
}

TEST_F(CellHealthTest, MovingWithoutALinkIsAFaultOnceItLasts) {
  moving_ = true, linked_ = false;
  EXPECT_TRUE(after(seconds(3)));
  EXPECT_TRUE(after(seconds(4)));
  EXPECT_FALSE(after(seconds(2)));
  EXPECT_THAT(health_.sentence(), HasSubstr("laser"));
  linked_ = true;
  EXPECT_TRUE(after(seconds(1)));
}

TEST_F(CellHealthTest, AnAnswerAfterItsEndIsIgnored) {
  answers_ = false;
  {
    CellHealth short_lived(clock_, {[this](std::function<void()> answered) { answer_ = std::move(answered); },
                                    [] { return false; }, [] { return true; }});
    EXPECT_TRUE(short_lived.good());
  }
  answer_();
}

}  // namespace
}  // namespace veneer::daemon
