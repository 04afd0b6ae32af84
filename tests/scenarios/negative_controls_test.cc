// The proof is itself proven: each error injected alone turns its own figure of the report red.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "tests/demo/figures.h"
#include "tests/scenarios/prepared_cell.h"

namespace veneer::tests {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class NegativeControls : public PreparedCell {};

TEST_F(NegativeControls, WithoutAnErrorEveryFigureIsGreen) {
  cut_and_prove();
  EXPECT_THAT(red_figures(story_->report()), IsEmpty()) << story_->report().dump(2);
}

// What mixing the two pixel conventions does at 300 dpi: fiducials lie 42 um beside the wood they belong to.
TEST_F(NegativeControls, HalfAPixelOfOffsetTurnsTheRegistrationRed) {
  tamper({"fiducials_are_frozen"}, R"(UPDATE fiducials SET corners_um = (
    SELECT json_group_array(json_array(json_extract(value, '$[0]') + 42, json_extract(value, '$[1]') + 42))
    FROM json_each(fiducials.corners_um)))");
  // No scan afterwards: it would be fitted to the fiducials as they lie now, and agree with them.
  ASSERT_TRUE(story_->cut(kJob).ok());
  ASSERT_TRUE(story_->prove(bin_dir()).ok());
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/registration/0/rms_mm")));
}

TEST_F(NegativeControls, AKerfOfZeroTurnsTheEdgesRed) {
  tamper({}, R"(INSERT INTO certificates (kind, issued_at, expires_at, rms_mm, payload)
                VALUES ('kerf', strftime('%Y-%m-%dT%H:%M:%S.000Z', 'now', '+1 second'), '2999-01-01T00:00:00.000Z', 0,
                        '{"kerf_mm":0}'))");
  cut_and_prove();
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/jobs/0/edge_rms_mm")));
}

TEST_F(NegativeControls, AMachineThatIsThreePerMilleOffTurnsTheEdgesRed) {
  ASSERT_TRUE(cell_->twin({{"cmd", "fault"}, {"name", "axis_drift"}, {"value", 0.003}}).ok());
  cut_and_prove();
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/jobs/0/edge_rms_mm")));
}

// A back that was tied to the show face without its reflection. The proof itself sees mirrored marks and pieces
// (proof_figures_test); the cell never lets it come to that.
TEST_F(NegativeControls, AMirroredFaceIsNeverCut) {
  tamper({"fiducials_are_frozen"}, R"(UPDATE fiducials SET corners_um = (
    SELECT json_group_array(json_array(200000 - json_extract(value, '$[0]'), json_extract(value, '$[1]')))
    FROM json_each(fiducials.corners_um)) WHERE face = 'back')");
  ASSERT_TRUE(cell_->api().post("/commands/reset").ok());
  ASSERT_TRUE(cell_->api().post(fmt::format("/jobs/{}/start", kJob)).ok());
  ASSERT_TRUE(cell_->twin({{"cmd", "place"}, {"sheet", "control"}, {"on", "bed"}, {"face", "back"}}).ok());
  const auto looked = cell_->wait_status(
      [](const nlohmann::json& s) {
        const std::string sentence = s["load"].is_object() ? s["load"].value("sentence", "") : "";
        return sentence.find("(") != std::string::npos && sentence.find("no tags") == std::string::npos;
      },
      std::chrono::seconds(60));
  ASSERT_TRUE(looked.ok()) << looked.error().message;
  EXPECT_FALSE(cell_->api().post("/commands/unsuspend").ok());
  ASSERT_TRUE(story_->prove(bin_dir()).ok());
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/jobs/0/cut = 0")));
}

TEST_F(NegativeControls, TwoSwappedPiecesAreWrong) {
  const std::string swap = R"(
    UPDATE pieces SET mark = 'swap' WHERE job = 1 AND mark = 'A1-1';
    UPDATE pieces SET mark = 'A1-1' WHERE job = 1 AND mark = 'A4-3';
    UPDATE pieces SET mark = 'A4-3' WHERE job = 1 AND mark = 'swap';)";
  tamper({"pieces_are_never_edited"}, swap);
  ASSERT_TRUE(story_->cut(kJob).ok());
  tamper({}, swap);
  ASSERT_TRUE(story_->reconcile(kJob).ok());
  ASSERT_TRUE(story_->prove(bin_dir()).ok());
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/jobs/0/wrong_pieces = 2")));
}

TEST_F(NegativeControls, ADeletedRowOfTheLedgerNoLongerMatchesTheBurn) {
  ASSERT_TRUE(story_->cut(kJob).ok());
  tamper({}, "DELETE FROM allocations WHERE id = (SELECT max(id) FROM allocations WHERE state = 'cut')");
  ASSERT_TRUE(story_->prove(bin_dir()).ok());
  EXPECT_THAT(red_figures(story_->report()), Contains(HasSubstr("/jobs/0/ledger_matches_burn = false")));
}

TEST_F(NegativeControls, ALostOkLeavesOnePieceSuspectAndTheRestUncut) {
  story_->before_unsuspend = [&]() -> Status {
    auto set = cell_->twin({{"cmd", "fault"}, {"name", "drop_ok"}, {"value", 150}});
    return set ? Ok() : Status(set.error());
  };
  cut_and_prove();
  EXPECT_EQ(get("/status")["state"], "Aborted");
  const auto red = red_figures(story_->report());
  EXPECT_THAT(red, Contains(HasSubstr("/jobs/0/suspect = 1")));
  EXPECT_THAT(red, Contains(HasSubstr("/jobs/0/cut")));
}

}  // namespace
}  // namespace veneer::tests
