// Alarms: what needs somebody, from when to when, and who has seen it.
#include "daemon/services/cell_alarms.h"

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
  view.rest.emplace();
  view.rest->suspect = 2;
  LaserStatus laser;
  laser.connected = false;
  laser.why_not_connected = "check its power";
  CellNeeds needs;
  needs.certificates = {{db::CertificateKind::kCamera, CertificateState::kExpired}};
  EXPECT_THAT(keys(view, laser, needs), ElementsAre("aborted", "laser", "certificate camera", "suspect"));
  EXPECT_TRUE(cell_alarms(view, laser, needs)[0].urgent);
  EXPECT_EQ(cell_alarms(view, laser, needs)[0].sentence, "the laser stopped answering");
}

}  // namespace
}  // namespace veneer::daemon
