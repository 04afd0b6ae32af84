// The proof is itself proven: each fault, injected alone, turns its own figure red, and leaves the others green.
#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/json_schema.h"
#include "tests/support/proof_scene.h"

namespace veneer::proof {
namespace {

class ProofFigures : public ::testing::Test {
 protected:
  Proof judge(const SceneFaults& faults) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    dir_ = std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / info->name();
    ProofScene scene(faults, dir_);
    auto proof = prove(scene.truth, scene.claims, 2);
    EXPECT_TRUE(proof.ok()) << (proof.ok() ? "" : proof.error().message);
    return proof.ok() ? std::move(*proof) : Proof();
  }

  static void expect_green_registration(const Proof& p) { EXPECT_LT(p.registration.at(0).registration->rms, 0.005); }
  static void expect_green_pose(const Proof& p) { EXPECT_LT(p.poses.at(0).pose->rms, 0.001); }
  static void expect_green_edges(const Proof& p) {
    EXPECT_LT(p.jobs.at(0).edge.rms, 0.02);
    EXPECT_LT(p.jobs.at(0).edge.max, 0.10);
  }
  static void expect_green_marks(const Proof& p) {
    EXPECT_EQ(p.jobs.at(0).unreadable_ids, 0U) << ::testing::PrintToString(p.jobs.at(0).notes);
    EXPECT_EQ(p.jobs.at(0).mirrored_pieces, 0U) << ::testing::PrintToString(p.jobs.at(0).notes);
  }
  static void expect_green_picture(const Proof& p) {
    EXPECT_EQ(p.jobs.at(0).wrong_pieces, 0U) << ::testing::PrintToString(p.jobs.at(0).notes);
    EXPECT_GT(*p.jobs.at(0).picture_ssim, 0.95);
    EXPECT_GT(*p.jobs.at(0).picture_ssim_joints_filled, 0.95);
  }
  static void expect_green_ledger(const Proof& p) {
    EXPECT_TRUE(*p.ledger_matches.at(0)) << ::testing::PrintToString(p.notes);
  }

  std::filesystem::path dir_;
};

TEST_F(ProofFigures, AreGreenForAFaultlessCell) {
  const Proof proof = judge({});
  expect_green_registration(proof);
  expect_green_pose(proof);
  expect_green_edges(proof);
  expect_green_marks(proof);
  expect_green_picture(proof);
  expect_green_ledger(proof);
  EXPECT_EQ(proof.jobs.at(0).pieces, 4U);
  EXPECT_EQ(proof.jobs.at(0).cut, 4U);
  EXPECT_EQ(proof.unclaimed_cuts, 0U);
  EXPECT_EQ(proof.unattributed_scans, 0U);
  EXPECT_EQ(proof.wood_used_twice, 0U);
  EXPECT_EQ(proof.jobs.at(0).holed_pieces, 0U) << "the panel's hole lies beside the pieces";
  ASSERT_TRUE(write_proof(proof, dir_).ok());
  EXPECT_TRUE(std::filesystem::exists(dir_ / "side-by-side-7.png"));
  const nlohmann::json json = to_json(proof);
  EXPECT_EQ(json["jobs"][0]["ledger_matches_burn"], true);
  EXPECT_EQ(json["jobs"][0]["wrong_pieces"], 0);
  EXPECT_THAT(veneer::testing::schema_errors(json, "demo-report.schema.json"), ::testing::IsEmpty());
}

TEST_F(ProofFigures, SeeHalfAPixelOfShiftInAScan) {
  const Proof proof = judge({.lattice_shift_px = 0.5});
  EXPECT_GT(proof.registration.at(0).registration->rms, 0.03);
  expect_green_edges(proof);
  expect_green_marks(proof);
  expect_green_picture(proof);
  expect_green_ledger(proof);
}

TEST_F(ProofFigures, SeeAScaleThatIsOffByThreeInAThousand) {
  const Proof proof = judge({.scale = 1.003});
  EXPECT_GT(proof.registration.at(0).registration->rms, 0.08);
  EXPECT_GT(proof.poses.at(0).pose->rms, 0.08);
  expect_green_marks(proof);
}

TEST_F(ProofFigures, SeeAPoseThatIsOff) {
  const Proof proof = judge({.pose_shift_mm = 0.3});
  EXPECT_NEAR(proof.poses.at(0).pose->rms, 0.3, 0.01);
  expect_green_registration(proof);
}

TEST_F(ProofFigures, SeeKerfThatWasNotMadeUpFor) {
  const Proof proof = judge({.kerf_offset_mm = 0.13});
  EXPECT_GT(proof.jobs.at(0).edge.rms, 0.11);
  expect_green_registration(proof);
  expect_green_marks(proof);
}

TEST_F(ProofFigures, SeeWoodThatTheBeamBrowned) {
  const double clean = *judge({}).jobs.at(0).picture_ssim;
  const Proof proof = judge({.browned_mm = 0.5});
  EXPECT_LT(*proof.jobs.at(0).picture_ssim, clean - 0.05);
  EXPECT_EQ(proof.jobs.at(0).wrong_pieces, 0U) << "char is no other wood";
  expect_green_edges(proof);
  expect_green_marks(proof);
}

TEST_F(ProofFigures, SeeTwoSwappedMarks) {
  const Proof proof = judge({.swap_marks = true});
  EXPECT_EQ(proof.jobs.at(0).wrong_pieces, 2U);
  EXPECT_LT(*proof.jobs.at(0).picture_ssim, 0.9);
  expect_green_edges(proof);
  expect_green_marks(proof);
  expect_green_ledger(proof);
}

TEST_F(ProofFigures, SeeAMirroredMark) {
  const Proof proof = judge({.mirror_mark = true});
  EXPECT_EQ(proof.jobs.at(0).mirrored_pieces, 1U);
  EXPECT_EQ(proof.jobs.at(0).unreadable_ids, 0U);
  expect_green_edges(proof);
  expect_green_ledger(proof);
}

TEST_F(ProofFigures, SeeAPieceOfTheMirroredFace) {
  const Proof proof = judge({.mirror_picture = true});
  EXPECT_EQ(proof.jobs.at(0).mirrored_pieces, 1U);
  expect_green_edges(proof);
}

TEST_F(ProofFigures, SeeAMissingMark) {
  const Proof proof = judge({.no_mark = true});
  EXPECT_EQ(proof.jobs.at(0).unreadable_ids, 1U);
  EXPECT_EQ(proof.jobs.at(0).wrong_pieces, 0U);
}

TEST_F(ProofFigures, SeeAScrewHoleInAPiece) {
  const Proof proof = judge({.screw_hole = true});
  EXPECT_EQ(proof.jobs.at(0).holed_pieces, 1U);
  EXPECT_THAT(proof.jobs.at(0).notes, ::testing::Contains(::testing::HasSubstr("A1-9 has a hole of the panel in it")));
  EXPECT_EQ(to_json(proof)["jobs"][0]["holed_pieces"], 1);
  EXPECT_THAT(veneer::testing::schema_errors(to_json(proof), "demo-report.schema.json"), ::testing::IsEmpty());
  expect_green_edges(proof);
  expect_green_marks(proof);
  expect_green_picture(proof);
  expect_green_ledger(proof);
}

// One that touches a piece, or grazes it by less than edges err, leaves it whole.
TEST_F(ProofFigures, SeeHolesThatBiteAPiecesSideAndNoneThatTouchIt) {
  const Proof proof = judge({.holes_at_sides = true});
  EXPECT_EQ(proof.jobs.at(0).holed_pieces, 2U);
  using ::testing::Contains, ::testing::HasSubstr;
  for (const char* bitten : {"A1-9 has a hole", "A1-10 has a hole"})
    EXPECT_THAT(proof.jobs.at(0).notes, Contains(HasSubstr(bitten)));
}

TEST_F(ProofFigures, SeeADeletedLedgerRow) {
  const Proof proof = judge({.delete_ledger_row = true});
  EXPECT_FALSE(*proof.ledger_matches.at(0));
  expect_green_edges(proof);
  expect_green_marks(proof);
  expect_green_picture(proof);
}

TEST_F(ProofFigures, SeeWoodThatWasCutThoughItIsOnlyLeased) {
  const Proof proof = judge({.lease_ledger_row = true});
  EXPECT_FALSE(*proof.ledger_matches.at(0));
  EXPECT_THAT(*proof.untrue_panels, ::testing::ElementsAre("P-0001"));
}

TEST_F(ProofFigures, SeeAPieceThatIsBookedButStillThere) {
  const Proof proof = judge({.skip_cut = true});
  EXPECT_FALSE(*proof.ledger_matches.at(0));
  EXPECT_EQ(proof.jobs.at(0).cut, 3U);
  expect_green_edges(proof);
}

TEST_F(ProofFigures, SeeWoodThatTwoJobsUse) {
  const Proof proof = judge({.book_twice = true});
  EXPECT_EQ(proof.wood_used_twice, 1U);
  EXPECT_THAT(proof.notes, ::testing::Contains(::testing::HasSubstr("of job 8 on P-0001")));
}

TEST_F(ProofFigures, SeeAScanThatWasNeverTaken) { EXPECT_EQ(judge({.forget_capture = true}).unattributed_scans, 1U); }

TEST_F(ProofFigures, SeeAPieceThatNobodyClaims) {
  EXPECT_EQ(judge({.forget_piece = true}).unclaimed_cuts, 1U);
  EXPECT_EQ(judge({.lost_piece = true}).unclaimed_cuts, 0U) << "made again from other wood, it is in the ledger";
}

TEST_F(ProofFigures, LayAPieceWhoseMarkHadToBeTurned) {
  const Proof proof = judge({.quarter_turned_mark = true});
  expect_green_marks(proof);
  expect_green_picture(proof);
}

TEST_F(ProofFigures, AreNullForStagesThatWereNotRun) {
  ProofScene scene({}, std::filesystem::path(::testing::TempDir()) / "veneer-proof-test" / "null");
  scene.claims.ledger.reset();
  scene.claims.jobs->front().preview_file.clear();
  scene.claims.panels.front().registration.clear();
  const auto proof = prove(scene.truth, scene.claims, 2);
  ASSERT_TRUE(proof.ok());
  const nlohmann::json json = to_json(*proof);
  EXPECT_TRUE(json["registration"][0]["rms_mm"].is_null());
  EXPECT_TRUE(json["jobs"][0]["picture_ssim"].is_null());
  EXPECT_TRUE(json["jobs"][0]["wrong_pieces"].is_null());
  EXPECT_TRUE(json["jobs"][0]["ledger_matches_burn"].is_null());
  EXPECT_EQ(json["jobs"][0]["unreadable_ids"], 0);
}

}  // namespace
}  // namespace veneer::proof
