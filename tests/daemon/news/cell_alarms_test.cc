// Alarms: what needs somebody, from when to when, and who has seen it.
#include "daemon/news/cell_alarms.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kAt = "2026-05-01T07:30:00.000Z";
constexpr const char* kLater = "2026-05-01T07:31:00.000Z";

AlarmCondition lid() { return {"held", false, "the lid was opened"}; }

TEST(AlarmBook, OneThatIsSeenIsOverOnceItIsGone) {
  AlarmBook book;
  EXPECT_THAT(book.take({lid()}, kAt).begun, SizeIs(1));
  EXPECT_FALSE(book.take({lid()}, kLater).any()) << "it is the same one while it holds";
  EXPECT_EQ(book.count(AlarmState::kNew), 1);
  EXPECT_TRUE(book.acknowledge(1, "user anna", kLater).ok());
  EXPECT_EQ(book.alarms()[0].state, AlarmState::kAcknowledged);
  EXPECT_THAT(book.take({}, kLater).ended, SizeIs(1));
  EXPECT_EQ(book.alarms()[0].state, AlarmState::kOver);
  EXPECT_EQ(book.alarms()[0].until, kLater);
}

TEST(AlarmBook, OneThatWentUnseenStaysInSight) {
  AlarmBook book;
  book.take({lid()}, kAt);
  book.take({}, kLater);
  EXPECT_EQ(book.count(AlarmState::kReturned), 1);
  book.take({lid()}, kLater);
  EXPECT_THAT(book.alarms(), SizeIs(2)) << "that it comes again is another one";
  EXPECT_EQ(book.acknowledge_all("user anna", kLater), 2);
  EXPECT_EQ(book.count(AlarmState::kOver), 1);
  EXPECT_EQ(book.count(AlarmState::kAcknowledged), 1);
}

TEST(AlarmBook, TellsWhoHasSeenIt) {
  AlarmBook book;
  const Alarm failed = book.happened({"task 7", false, "scan: the lamp is cold"}, kAt);
  EXPECT_EQ(failed.state, AlarmState::kReturned) << "it does not last";
  EXPECT_TRUE(book.acknowledge(failed.id, "user anna", kLater).ok());
  const Status again = book.acknowledge(failed.id, "user berta", kLater);
  EXPECT_EQ(again.error().code, ErrorCode::kConflict);
  EXPECT_THAT(again.error().message, HasSubstr("user anna"));
  EXPECT_EQ(book.acknowledge(99, "user anna", kLater).error().code, ErrorCode::kNotFound);
}

TEST(AlarmBook, ForgetsWhatIsOverFirst) {
  AlarmBook book;
  book.take({lid()}, kAt);
  for (std::size_t i = 1; i < 2 * AlarmBook::kKept; ++i) {
    const Alarm alarm = book.happened({"task", false, "it failed"}, kAt);
    if (i % 2 == 0) {
      EXPECT_TRUE(book.acknowledge(alarm.id, "user anna", kAt).ok());
    }
  }
  EXPECT_THAT(book.alarms(), SizeIs(AlarmBook::kKept));
  EXPECT_EQ(book.alarms().front().what.key, "held") << "what holds is never forgotten";
}

TEST(AlarmBook, AWorseOneIsAnotherThatNobodyHasSeen) {
  AlarmBook book;
  book.take({{"database", false, "the database is being checked"}}, kAt);
  EXPECT_TRUE(book.acknowledge(1, "user anna", kAt).ok());
  const auto changes = book.take({{"database", true, "the database is damaged"}}, kLater);
  ASSERT_THAT(changes.begun, SizeIs(1));
  EXPECT_THAT(changes.ended, SizeIs(1));
  EXPECT_EQ(changes.begun[0].state, AlarmState::kNew);
  EXPECT_EQ(book.count(AlarmState::kOver), 1) << "what was seen is kept";
  EXPECT_TRUE(book.acknowledge(changes.begun[0].id, "user anna", kLater).ok());
  EXPECT_FALSE(book.take({{"database", false, "the database is being checked"}}, kLater).any()) << "it got better";
}

TEST(AlarmBook, MoreThingsThanWereSeenAreAnother) {
  AlarmBook book;
  book.take({{"suspect 3", false, "1 piece", 1}}, kAt);
  book.take({{"suspect 3", false, "6 pieces", 6}}, kLater);
  ASSERT_THAT(book.alarms(), SizeIs(1)) << "nobody saw the lesser one";
  EXPECT_EQ(book.acknowledge(1, "user anna", kLater).error().code, ErrorCode::kNotFound) << "what was on the screen";
  EXPECT_TRUE(book.acknowledge(2, "user anna", kLater).ok());
  EXPECT_FALSE(book.take({{"suspect 3", false, "5 pieces", 5}}, kLater).any());
  EXPECT_EQ(book.alarms()[0].what.sentence, "5 pieces");
  EXPECT_THAT(book.take({{"suspect 3", false, "6 pieces", 6}}, kLater).begun, SizeIs(1));
}

TEST(AlarmBook, OnlyWhatWasInSightIsSeen) {
  AlarmBook book;
  book.take({lid()}, kAt);
  book.take({lid(), {"laser", true, "check its power"}}, kLater);
  EXPECT_EQ(book.acknowledge_all("user anna", kLater, 1), 1);
  EXPECT_EQ(book.alarms()[1].state, AlarmState::kNew);
}

TEST(AlarmBook, ForgetsFailedTasksBeforeWhatWasUrgent) {
  AlarmBook book;
  book.take({lid(), {"aborted", true, "the laser stopped answering"}}, kAt);
  book.take({}, kLater);  // neither was seen
  for (std::size_t i = 0; i < 2 * AlarmBook::kKept; ++i) book.happened({"task", false, "it failed"}, kLater);
  EXPECT_THAT(book.alarms(), SizeIs(AlarmBook::kKept));
  EXPECT_EQ(book.alarms()[0].what.key, "held");
  EXPECT_EQ(book.alarms()[1].what.key, "aborted");
}

TEST(AlarmBook, KeepsTheBeginningOfALongSentence) {
  AlarmBook book;
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "ü";
  const std::string kept = book.happened({"task 7", false, text}, kAt).what.sentence;
  EXPECT_LE(kept.size(), AlarmBook::kLongestSentence);
  EXPECT_TRUE(kept.ends_with("ü...")) << kept;
  book.take({{"beam", true, text}}, kAt);
  EXPECT_EQ(book.take({{"beam", true, text}}, kLater).begun.size(), 0U);
  EXPECT_EQ(book.alarms().back().what.sentence, kept);
}

std::vector<std::string> keys(const CellView& view, const LaserStatus& laser, const CellNeeds& needs) {
  std::vector<std::string> out;
  for (const AlarmCondition& condition : cell_alarms(view, laser, needs)) out.push_back(condition.key);
  return out;
}

TEST(CellAlarms, ANewCellHasNone) {
  CellNeeds needs;
  needs.certificates = {{db::CertificateKind::kScanner, CertificateState::kMissing}};
  EXPECT_THAT(keys({}, {}, needs), IsEmpty()) << "what was never made is the next step, and no alarm";
}

TEST(CellAlarms, NameWhatIsWrong) {
  CellView view;
  view.state = CellState::kAborted;
  view.reason = "the laser stopped answering";
  LaserStatus laser;
  laser.connected = false;
  laser.why_not_connected = "check its power";
  CellNeeds needs;
  needs.certificates = {{db::CertificateKind::kCamera, CertificateState::kExpired}};
  needs.suspects = {{JobId{3}, 6}, {JobId{4}, 1}};
  needs.backups_silent = "the disk of the backups does not answer";
  EXPECT_THAT(keys(view, laser, needs),
              ElementsAre("aborted", "laser", "backups", "certificate camera", "suspect 3", "suspect 4"));
  EXPECT_EQ(cell_alarms(view, laser, needs)[4].count, 6);
  EXPECT_TRUE(cell_alarms(view, laser, needs)[0].urgent);
  EXPECT_EQ(cell_alarms(view, laser, needs)[0].sentence, "the laser stopped answering");
}

TEST(CellAlarms, AHoldThatSomebodyGaveIsNone) {
  CellView view;
  view.state = CellState::kHeld;
  view.reason = "held between two pieces";
  view.hold_commanded = true;
  EXPECT_THAT(keys(view, {}, {}), IsEmpty());
  view.hold_commanded = false;
  view.reason = "held by the machine: check the lid, then Unhold";
  EXPECT_THAT(keys(view, {}, {}), ElementsAre("held"));
}

}  // namespace
}  // namespace veneer::daemon
