#include "daemon/unit/cell_health.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

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
                      [this] { return moving_; }, [this] { return linked_; },
                      [this](const std::string& why) {
                        stopped_.push_back(why);
                        moving_ = false;
                      }},
                     seconds(5)};
  std::vector<std::string> stopped_;  // why, each time
  void after(seconds passed) {
    clock_.advance(passed);
    health_.look();
  }
};

TEST_F(CellHealthTest, NothingIsStoppedWhileEverybodyAnswers) {
  moving_ = true;
  for (int i = 0; i < 10; ++i) after(seconds(3));
  EXPECT_EQ(health_.sentence(), "");
  EXPECT_THAT(stopped_, IsEmpty());
}

TEST_F(CellHealthTest, ADatabaseThatHangsStopsWhatMovesWithOneSentence) {
  answers_ = false, moving_ = true;
  after(seconds(3));
  after(seconds(4));
  EXPECT_THAT(stopped_, IsEmpty());
  after(seconds(2));
  EXPECT_THAT(stopped_, ElementsAre(HasSubstr("database")));
  EXPECT_THAT(health_.sentence(), HasSubstr("disk"));
  after(seconds(1));
  EXPECT_THAT(stopped_, ::testing::SizeIs(1)) << "what rests is left alone";
  answers_ = true;
  answer_();  // it was only slow
  moving_ = true;
  after(seconds(1));
  EXPECT_EQ(health_.sentence(), "");
  EXPECT_THAT(stopped_, ::testing::SizeIs(1));
}

TEST_F(CellHealthTest, WhatBeginsToMoveWhileTheDatabaseHangsIsStoppedToo) {
  answers_ = false;
  after(seconds(1));
  after(seconds(6));
  EXPECT_THAT(stopped_, IsEmpty());
  moving_ = true;
  after(seconds(1));
  EXPECT_THAT(stopped_, ElementsAre(HasSubstr("database")));
}

TEST_F(CellHealthTest, ALaserThatIsOffAtRestIsNoFault) {
  linked_ = false;
  for (int i = 0; i < 10; ++i) after(seconds(3));
  EXPECT_EQ(health_.sentence(), "");
  EXPECT_THAT(stopped_, IsEmpty());
}

TEST_F(CellHealthTest, MovingWithoutALinkIsStoppedOnceItLasts) {
  moving_ = true, linked_ = false;
  after(seconds(3));
  after(seconds(4));
  EXPECT_THAT(stopped_, IsEmpty());
  after(seconds(2));
  EXPECT_THAT(stopped_,
              ElementsAre(AllOf(HasSubstr("the laser's link does not answer"), HasSubstr("busy with something else"),
                                HasSubstr("this computer was too loaded"), HasSubstr("end other heavy programs"))));
  linked_ = true;
  after(seconds(1));
  EXPECT_EQ(health_.sentence(), "");
}

TEST_F(CellHealthTest, AnAnswerAfterItsEndIsIgnored) {
  answers_ = false;
  {
    CellHealth short_lived(clock_, {[this](std::function<void()> answered) { answer_ = std::move(answered); },
                                    [] { return false; }, [] { return true; }, [](const std::string&) {}});
    short_lived.look();
  }
  answer_();
}

}  // namespace
}  // namespace veneer::daemon
