// Each link of the interlock chain: good, in the way with its remedy, or not known and said so.
#include "daemon/news/interlocks.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "daemon/devices/device_places.h"
#include "daemon/unit/disk_room.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const auto kNow = std::chrono::system_clock::time_point(std::chrono::hours(500'000));

// A cell that may cut at once.
struct Chain {
  CellView view;
  LaserStatus laser;
  CellNeeds needs;
  InterlockFacts facts;

  Chain() {
    view.state = CellState::kIdle;
    laser.connected = laser.homed = true, laser.state = "Idle", laser.lid_open = false;
    for (const auto kind : {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                            db::CertificateKind::kKerf})
      needs.certificates.push_back({kind, CertificateState::kValid});
    facts.guardian = Ok();
    facts.camera.at = facts.scanner.at = kNow - std::chrono::seconds(12);
    facts.free_bytes = 50'000'000'000;
    facts.backups = BackupsSeen{kNow - std::chrono::hours(20)};
    facts.now = kNow;
  }
  Interlock link(const std::string& name) const {
    for (const Interlock& one : interlocks(view, laser, needs, facts))
      if (one.name == name) return one;
    ADD_FAILURE() << "there is no " << name;
    return {};
  }
};

TEST(Interlocks, NothingIsInTheWayOfACellThatMayCut) {
  const Chain chain;
  for (const Interlock& one : interlocks(chain.view, chain.laser, chain.needs, chain.facts)) {
    EXPECT_EQ(one.state, InterlockState::kGood) << one.name << ": " << one.sentence;
    EXPECT_THAT(one.sentence, Not(IsEmpty())) << one.name;
    EXPECT_THAT(one.remedy, IsEmpty()) << one.name;
  }
  EXPECT_EQ(chain.link("camera").age_s, 12);
  EXPECT_EQ(chain.link("backup").age_s, 20 * 3600);
}

TEST(Interlocks, WhatNobodyHasToldIsNotKnown) {
  Chain chain;
  chain.laser = {};
  chain.needs.certificates.clear();
  chain.facts = {};
  for (const char* name : {"lid", "machine", "guardian", "certificates", "camera", "scanner", "disk", "backup"})
    EXPECT_EQ(chain.link(name).state, InterlockState::kUnknown) << name;
  EXPECT_EQ(to_json(interlocks(chain.view, chain.laser, chain.needs, chain.facts))[6],
            (nlohmann::json{{"name", "camera"},
                            {"state", "unknown"},
                            {"sentence", "no picture of the bed since the program began"},
                            {"remedy", nullptr},
                            {"age_s", nullptr}}));
  chain.laser.connected = true;
  EXPECT_EQ(chain.link("lid").state, InterlockState::kUnknown) << "it tells of no switch";
}

TEST(Interlocks, WhatBlocksNamesItsRemedy) {
  const auto blocks = [](const char* name, auto change) {
    Chain chain;
    change(chain);
    const Interlock link = chain.link(name);
    EXPECT_EQ(link.state, InterlockState::kBlocks) << name << ": " << link.sentence;
    return link.sentence + " | " + link.remedy;
  };
  EXPECT_EQ(blocks("lid", [](Chain& c) { c.laser.lid_open = true; }), "the lid is open | Close the lid.");
  EXPECT_THAT(blocks("machine", [](Chain& c) { c.laser.state = "Alarm:1", c.view.state = CellState::kAborted; }),
              HasSubstr("Clear and Reset"));
  for (const char* open : {"Door", "Door:1", "Door:2"})
    EXPECT_THAT(blocks("machine", [&](Chain& c) { c.laser.state = open; }), HasSubstr("Close the door"));
  EXPECT_EQ(blocks("stop", [](Chain& c) { c.view.state = CellState::kAborted, c.view.reason = "STOP was pressed"; }),
            "STOP was pressed | See to the cause, then Clear and Reset.");
  EXPECT_THAT(blocks("stop", [](Chain& c) { c.view.state = CellState::kHeld; }), HasSubstr("Unhold"));
  EXPECT_THAT(blocks("guardian",
                     [](Chain& c) {
                       c.facts.guardian = Error{ErrorCode::kRefused, "nobody watches"};
                     }),
              HasSubstr("nobody watches | It comes back"));
  EXPECT_THAT(blocks("certificates", [](Chain& c) { c.needs.certificates[2].state = CertificateState::kMissing; }),
              HasSubstr("the laser on the bed was never calibrated | Calibrate it"));
  EXPECT_THAT(blocks("camera",
                     [](Chain& c) {
                       c.facts.camera.outcome = Error{ErrorCode::kTimeout, "/dev/video0 is silent"};
                     }),
              HasSubstr("/dev/video0 is silent | See that the camera is plugged in"));
  EXPECT_THAT(blocks("database",
                     [](Chain& c) {
                       c.needs.database_busy = "a row is not as it was written", c.needs.database_damaged = true;
                     }),
              HasSubstr("db check"));
}

// As after every panel that is laid through the lid.
TEST(Interlocks, ALidThatIsClosedAgainIsInNobodysWay) {
  Chain chain;
  chain.laser.state = "Door:0";
  EXPECT_EQ(chain.link("machine").state, InterlockState::kGood);
  EXPECT_EQ(chain.link("machine").sentence, "homed; the lid is closed again; its controller says Door:0");
  chain.view.state = CellState::kStopped, chain.laser.homed = false;
  EXPECT_EQ(chain.link("machine").state, InterlockState::kWarns);
  EXPECT_EQ(chain.link("machine").remedy, "Reset homes it.");
}

// grblHAL takes seconds, and nothing begins meanwhile.
TEST(Interlocks, AControllerThatComesOutOfItsDoorIsWaitedFor) {
  for (const bool homed : {true, false}) {
    Chain chain;
    chain.laser.state = "Door:3", chain.laser.homed = homed;
    EXPECT_EQ(chain.link("lid").state, InterlockState::kGood);
    EXPECT_EQ(chain.link("machine").state, InterlockState::kWarns);
    EXPECT_EQ(chain.link("machine").sentence + " | " + chain.link("machine").remedy,
              "the lid is closed again, and the controller is still coming out of its wait | Wait a few seconds.");
  }
}

TEST(Interlocks, AMachineWithoutHomingSwitchesIsNotCalledHomed) {
  Chain chain;
  chain.facts.finds_home = false;
  EXPECT_EQ(chain.link("machine").state, InterlockState::kGood);
  EXPECT_EQ(chain.link("machine").sentence,
            "no homing switches; it counts from the corner it was given; its controller says Idle");
  chain.laser.state = "Door:0";
  EXPECT_THAT(chain.link("machine").sentence, AllOf(HasSubstr("the lid is closed again"), Not(HasSubstr("homed"))));
  chain.view.state = CellState::kStopped, chain.laser.homed = false;
  EXPECT_EQ(chain.link("machine").state, InterlockState::kWarns);
  EXPECT_THAT(chain.link("machine").sentence, Not(HasSubstr("homed")));
  EXPECT_EQ(
      chain.link("machine").remedy,
      "Reset takes the place where its head stands as its corner, or brings the head back to the corner it was "
      "given; where the controller has forgotten it, bring the head to that corner and say veneerctl laser here before "
      "Reset.");
}

// What Reset does is done only from where Reset is taken.
TEST(Interlocks, ResetIsNamedWithWhatLeadsThere) {
  const auto remedy = [](CellState state, auto change) {
    Chain chain;
    chain.view.state = state;
    change(chain.laser);
    return chain.link("machine").remedy;
  };
  const auto unasked = [](LaserStatus& l) { l = {}; };
  const auto lost = [](LaserStatus& l) { l.connected = false, l.why_not_connected = "stopped by command"; };
  const auto astray = [](LaserStatus& l) { l.homed = false; };
  const auto alarmed = [](LaserStatus& l) { l.state = "Alarm:1"; };
  EXPECT_EQ(remedy(CellState::kStopped, unasked), "Reset connects and homes it.");
  EXPECT_EQ(remedy(CellState::kAborted, unasked), "Clear, then Reset connects and homes it.");
  EXPECT_EQ(remedy(CellState::kComplete, lost), "Reset tries to connect it again.");
  EXPECT_EQ(remedy(CellState::kAborted, lost), "Clear, then Reset tries to connect it again.");
  EXPECT_EQ(remedy(CellState::kIdle, astray), "Stop, then Reset homes it.");
  EXPECT_EQ(remedy(CellState::kAborting, astray), "Clear, then Reset homes it.");
  EXPECT_EQ(remedy(CellState::kResetting, astray), "Reset homes it.");
  EXPECT_EQ(remedy(CellState::kAborted, alarmed), "See that the head is free, then Clear and Reset.");
  EXPECT_EQ(remedy(CellState::kStopped, alarmed), "See that the head is free, then Reset.");
  // And Reset is taken there, or after what is named.
  for (const CellState state : {CellState::kStopped, CellState::kComplete, CellState::kAborted, CellState::kIdle}) {
    const std::string words = remedy(state, astray);
    EXPECT_EQ(words.starts_with("Reset"), after(state, CellCommand::kReset).has_value()) << to_string(state);
    EXPECT_EQ(words.starts_with("Clear"), after(state, CellCommand::kClear).has_value()) << to_string(state);
  }
}

TEST(Interlocks, ALaserThatIsNotConnectedHasTheRemedyOfItsOwnReason) {
  const auto told = [](const char* why, CellState state) {
    Chain chain;
    chain.view.state = state;
    chain.laser.connected = false, chain.laser.why_not_connected = why;
    const Interlock link = chain.link("machine");
    EXPECT_EQ(link.state, InterlockState::kBlocks);
    return link.sentence + " | " + link.remedy;
  };
  constexpr const char* kNoLaserMode =
      "the laser controller (Grbl 1.1h) cannot be used, because laser mode is off: set $32=1 so that the beam goes out "
      "at rest";
  EXPECT_EQ(told(kNoLaserMode, CellState::kStopped),
            "the laser controller (Grbl 1.1h) cannot be used, because laser mode is off | Set $32=1 so that the beam "
            "goes out at rest. Then Reset.");
  EXPECT_THAT(told(kNoLaserMode, CellState::kAborted), HasSubstr("goes out at rest. Then Clear and Reset."));
  constexpr const char* kGone =
      "the link /dev/ttyUSB0 is gone (closed by the other side): check the cable and the device's power";
  EXPECT_EQ(told(kGone, CellState::kStopped),
            "the link /dev/ttyUSB0 is gone (closed by the other side) | Check the cable and the device's power. Then "
            "Reset.");
  constexpr const char* kSilent = "the laser controller stopped answering: check its cable, then Clear and Reset";
  EXPECT_EQ(told(kSilent, CellState::kAborted),
            "the laser controller stopped answering | Check its cable, then Clear and Reset.");
  EXPECT_EQ(told(kSilent, CellState::kStopped),
            "the laser controller stopped answering | Check its cable, then Reset.");
  constexpr const char* kUntold = "it did not tell its setting $22: check the cable, then Clear and Reset";
  EXPECT_EQ(told(kUntold, CellState::kStopped), "it did not tell its setting $22 | Check the cable, then Reset.");
  EXPECT_EQ(told(kUntold, CellState::kAborted),
            "it did not tell its setting $22 | Check the cable, then Clear and Reset.");
  // What is read only as the daemon starts.
  EXPECT_EQ(told("the port does not open: give the daemon's user the group dialout, then restart veneerd",
                 CellState::kAborted),
            "the port does not open | Give the daemon's user the group dialout, then restart veneerd.");
  EXPECT_EQ(told("the board is gone: unplug it and plug it in again", CellState::kStopped),
            "the board is gone | Unplug it and plug it in again. Then Reset.");
}

TEST(Interlocks, NoLidSwitchIsDeniedThatNobodyHasDenied) {
  Chain chain;
  chain.laser.lid_open.reset();
  EXPECT_EQ(chain.link("lid").state, InterlockState::kUnknown);
  EXPECT_EQ(chain.link("lid").sentence, "the laser's controller has told of no lid switch");
}

TEST(Interlocks, WhileAPanelIsLoadedConsentIsWhatIsAskedFor) {
  Chain chain;
  chain.view.state = CellState::kSuspended;
  chain.view.load.emplace();
  chain.view.load->panel = PanelId{"P-0002"};
  EXPECT_EQ(chain.link("consent").remedy, "Lay panel P-0002 on the bed.");
  chain.view.load->found = true;
  chain.needs.confirm = {"exhaust", "air assist"};
  EXPECT_EQ(chain.link("consent").remedy, "See to exhaust, air assist, tick each, then say Unsuspend.");
  EXPECT_EQ(chain.link("consent").state, InterlockState::kBlocks);
  chain.view.state = CellState::kExecute;
  EXPECT_EQ(chain.link("consent").state, InterlockState::kGood);
}

TEST(Interlocks, ForAPatternGoWasSaidAndForNoPanel) {
  Chain chain;
  chain.view.alone = true;
  for (const CellState state : {CellState::kStarting, CellState::kExecute, CellState::kHeld, CellState::kUnholding}) {
    chain.view.state = state;
    EXPECT_EQ(chain.link("consent").state, InterlockState::kGood);
    EXPECT_EQ(chain.link("consent").sentence, "an operator has said go for what runs") << to_string(state);
  }
}

TEST(Interlocks, WhatIsHeldIsNamedAndSoIsWhatEndsIt) {
  Chain chain;
  chain.view.state = CellState::kHeld;
  EXPECT_EQ(chain.link("stop").sentence, "the cut is held");
  chain.view.alone = true;
  EXPECT_EQ(chain.link("stop").sentence, "the laser is held") << "no panel is cut";
  EXPECT_EQ(chain.link("stop").remedy, "Unhold once nothing stands in the way.");
  chain.view.only_stop = true;
  EXPECT_EQ(chain.link("stop").remedy, "Stop ends it.");
}

TEST(Interlocks, WhatIsMissedOnlyLaterWarns) {
  Chain chain;
  chain.facts.scanner.outcome = Error{ErrorCode::kDisconnected, "no scanner answers"};
  chain.facts.free_bytes = 1'300'000'000;
  chain.facts.backups = BackupsSeen{};
  EXPECT_EQ(chain.link("scanner").state, InterlockState::kWarns);
  EXPECT_EQ(chain.link("disk").state, InterlockState::kWarns);
  EXPECT_EQ(chain.link("disk").sentence, "1.3 GB are free");
  EXPECT_EQ(chain.link("backup").sentence, "no backup was made yet");
  chain.facts.backups->newest_at = kNow - std::chrono::hours(8 * 24);
  EXPECT_EQ(chain.link("backup").state, InterlockState::kWarns);
  chain.facts.backups_silent = "the disk of the backups does not answer";
  EXPECT_EQ(chain.link("backup").sentence, chain.facts.backups_silent);
  EXPECT_EQ(chain.link("backup").age_s, std::nullopt) << "nobody can say how old it is";
}

// Pictures keep coming, and no look believes them.
TEST(Interlocks, APictureThatProvesNothingIsInTheWay) {
  Chain chain;
  chain.facts.camera.behind = std::chrono::seconds(60);
  EXPECT_EQ(chain.link("camera").state, InterlockState::kGood);
  chain.facts.camera.behind = std::chrono::seconds(300);
  EXPECT_EQ(chain.link("camera").state, InterlockState::kBlocks);
  EXPECT_THAT(chain.link("camera").sentence, HasSubstr("300 s old already"));
  EXPECT_THAT(chain.link("camera").remedy, HasSubstr("the program that takes the camera's pictures runs"));
  chain.facts.camera.behind = {};
  chain.facts.picture_fresh = Error{ErrorCode::kUnavailable, "/dev/video0 gives the same picture again"};
  EXPECT_EQ(chain.link("camera").state, InterlockState::kBlocks);
  EXPECT_EQ(chain.link("camera").sentence, "/dev/video0 gives the same picture again");
  chain.facts.tell_why = false;
  EXPECT_THAT(chain.link("camera").sentence, Not(HasSubstr("/dev")));
}

TEST(Interlocks, NoStockIsCutByASimulatedEye) {
  Chain chain;
  chain.facts.stock_refusal = "the laser is a real one, but the camera is simulated: configure a real one";
  EXPECT_EQ(chain.link("camera").state, InterlockState::kBlocks);
  EXPECT_EQ(chain.link("camera").sentence, chain.facts.stock_refusal);
}

TEST(Interlocks, OnAFullDiskNothingIsCut) {
  Chain chain;
  chain.facts.free_bytes = 1'000'000;
  EXPECT_EQ(chain.link("disk").state, InterlockState::kBlocks);
  EXPECT_EQ(chain.link("disk").sentence + " | " + chain.link("disk").remedy,
            "the disk is nearly full, and soon no cut can be booked | Make room on the disk.");
  EXPECT_THAT(check_room(chain.facts.free_bytes).error().message, ::testing::StartsWith(chain.link("disk").sentence))
      << "as Start says it";
}

TEST(Interlocks, AScannersCertificateKeepsNobodyFromCutting) {
  Chain chain;
  chain.needs.certificates[0].state = CertificateState::kExpired;
  EXPECT_EQ(chain.link("certificates").state, InterlockState::kWarns);
  chain.needs.certificates[3].state = CertificateState::kExpired;
  EXPECT_EQ(chain.link("certificates").state, InterlockState::kBlocks);
}

TEST(Interlocks, AViewerIsToldNeitherPortsNorPaths) {
  Chain chain;
  chain.facts.tell_why = false;
  chain.laser.connected = false, chain.laser.why_not_connected = "the link /dev/ttyUSB0 is gone: look at /dev/ttyUSB0";
  chain.facts.camera.outcome = Error{ErrorCode::kTimeout, "/dev/video0 is silent"};
  EXPECT_EQ(chain.link("machine").sentence, kLaserIsNotConnected);
  EXPECT_EQ(chain.link("machine").remedy, "") << "they can do nothing about it, and it may name a port";
  EXPECT_THAT(chain.link("camera").sentence, Not(HasSubstr("/dev")));
}

// A device that was asked and did not answer is not the same as one that nobody has asked.
class OneAnswer final : public CameraDriver {
 public:
  explicit OneAnswer(Result<std::filesystem::path> answer,
                     std::optional<std::chrono::system_clock::time_point> taken_at = {})
      : answer_(std::move(answer)), taken_at_(taken_at) {}
  Result<std::filesystem::path> capture() override { return answer_; }
  std::optional<std::chrono::system_clock::time_point> taken_at() const override { return taken_at_; }
  std::string device() const override { return "test"; }
  void give_up() noexcept override { answer_ = Error{ErrorCode::kCancelled, "the program ends"}; }

 private:
  Result<std::filesystem::path> answer_;
  std::optional<std::chrono::system_clock::time_point> taken_at_;
};

TEST(NotedDevices, NoteHowTheLastPictureCameOut) {
  NotedCamera dead(std::make_unique<OneAnswer>(Error{ErrorCode::kTimeout, "silent"}));
  EXPECT_FALSE(dead.last().at.has_value());
  EXPECT_FALSE(dead.capture().ok());
  ASSERT_TRUE(dead.last().at.has_value());
  EXPECT_EQ(dead.last().outcome.error().message, "silent");
  NotedCamera slow(std::make_unique<OneAnswer>(std::filesystem::path("picture.png"),
                                               std::chrono::system_clock::now() - std::chrono::hours(1)));
  EXPECT_TRUE(slow.capture().ok());
  EXPECT_GE(slow.last().behind, std::chrono::hours(1));
  NotedCamera given_up(std::make_unique<OneAnswer>(Error{ErrorCode::kCancelled, "a look goes first"}));
  EXPECT_FALSE(given_up.glance({}).ok());
  EXPECT_FALSE(given_up.last().at.has_value()) << "somebody broke it off: that says nothing of the camera";
  slow.give_up();
  EXPECT_FALSE(slow.capture().ok()) << "the device itself is not told";
}

}  // namespace
}  // namespace veneer::daemon
