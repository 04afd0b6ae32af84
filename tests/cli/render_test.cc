#include "cli/render.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "cli/progress.h"
#include "cli/text_table.h"

namespace veneer::cli {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(Render, TheStatusReadsLikeASentenceAndAFewFacts) {
  const json status = {
      {"state", "Execute"},
      {"reason", "Cutting Grace Hopper."},
      {"laser",
       {{"connected", true}, {"state", "Run"}, {"position_mm", {10.04, 20}}, {"beam_on", true}, {"homed", true}}},
      {"lid", "closed"},
      {"job",
       {{"id", 3},
        {"name", "Grace Hopper"},
        {"state", "running"},
        {"pieces", 306},
        {"cut", 142},
        {"suspect", 1},
        {"current_piece", "A3-12"},
        {"eta_s", 731}}},
      {"load", {{"panel", "P-0002"}, {"face_up", "back"}, {"found", true}, {"rms_mm", 0.031}, {"sentence", ""}}},
      {"panels", 4},
      {"calibration", {{"scanner", "valid"}, {"camera", "valid"}, {"axes", "expired"}, {"kerf", "missing"}}},
      {"tasks", json::array()}};
  EXPECT_EQ(
      render_status(status),
      "Execute\n"
      "  Cutting Grace Hopper.\n"
      "\n"
      "Job          3 \"Grace Hopper\" (running), 142 of 306 pieces cut, 1 SUSPECT, now A3-12, about 12 min left\n"
      "             [###########-------------]  46 %\n"
      "On the bed   P-0002, back up: found (0.031 mm)\n"
      "Laser        connected, Run, homed, at 10.0, 20.0 mm, BEAM ON\n"
      "Lid          closed\n"
      "Stock        4 panels\n"
      "Calibration  scanner valid, camera valid, axes EXPIRED, kerf MISSING\n");
}

// One more view costs little as long as the sheet lies there.
TEST(Render, ACalibrationSaysHowMuchItMeasured) {
  const json result = {{"device", "scanner"},
                       {"certificate", 7},
                       {"views", 2},
                       {"rms_mm", 0.004},
                       {"figures", {{"max_mm", 0.013}, {"measured_fraction", 0.634}, {"worst_predicted_mm", 0.1142}}}};
  const std::string told = render_calibration(result);
  EXPECT_THAT(told, HasSubstr("Measured     63 % of the glass\n"));
  EXPECT_THAT(told, HasSubstr("Predicted    0.114 mm at worst, one sigma\n"));
}

TEST(Render, AnOpenScanSaysHowItGoesOn) {
  json status = {{"state", "Stopped"}, {"open_scan", nullptr}};
  EXPECT_THAT(render_status(status), ::testing::Not(HasSubstr("Scan ")));
  status["open_scan"] = {{"panel", nullptr}, {"face", "show"}, {"tiles", 1}};
  EXPECT_THAT(render_status(status),
              HasSubstr("Scan         1 tile of the show face of a panel that was not named is scanned, and more is to "
                        "come: veneerctl "
                        "panel scan ends it with the last tile, --more goes on, --anew discards what is there\n"));
  status["open_scan"] = {{"panel", "P-0001"}, {"face", "back"}, {"tiles", 2}};
  EXPECT_THAT(render_status(status), HasSubstr("2 tiles of the back face of P-0001 are scanned"));
  EXPECT_THAT(render_status(status), HasSubstr("veneerctl panel scan --panel P-0001 --face back ends it"));
  status["open_scan"]["retag"] = true;
  EXPECT_THAT(render_status(status), HasSubstr("veneerctl panel scan --panel P-0001 --face back --retag ends it"));
}

TEST(Render, WhatIsInTheWayStandsWithItsRemedy) {
  const auto link = [](const char* name, const char* state, const char* sentence, json remedy = nullptr) {
    return json{{"name", name}, {"state", state}, {"sentence", sentence}, {"remedy", std::move(remedy)}};
  };
  json status = {{"state", "Idle"}, {"interlocks", json::array({link("lid", "good", "the lid is closed")})}};
  EXPECT_THAT(render_status(status), HasSubstr("In the way   nothing that this program knows of\n"));
  status["interlocks"].push_back(link("machine", "unknown", "nobody has connected the laser yet"));
  status["interlocks"].push_back(link("stop", "blocks", "the cut is held", "Unhold."));
  status["interlocks"].push_back(link("backup", "warns", "no backup was made yet", "Make one."));
  EXPECT_THAT(render_status(status), HasSubstr("In the way   stop: the cut is held. Unhold.\n"
                                               "             backup (later): no backup was made yet. Make one.\n"));
}

TEST(Render, WhatIsMissingIsLeftOut) {
  EXPECT_EQ(render_status({{"state", "Stopped"}, {"laser", {{"connected", false}}}, {"job", nullptr}, {"panels", 1}}),
            "Stopped\n"
            "  `veneerctl reset` homes the laser and makes the cell ready: hands off the machine.\n\n"
            "Job          none\n"
            "Laser        not connected yet: `veneerctl reset` connects and homes it\n"
            "Stock        1 panel\n");
}

TEST(Render, StatusSaysWhenNoLaserIsThere) {
  const auto laser_line = [](const char* controller) {
    return render_status({{"state", "Idle"},
                          {"laser", {{"connected", true}, {"state", "Idle"}, {"controller", controller}}},
                          {"job", nullptr},
                          {"panels", 1}});
  };
  EXPECT_THAT(laser_line("test"), HasSubstr("connected, Idle, a test controller, no laser\n"));
  EXPECT_THAT(laser_line("file"), HasSubstr("connected, Idle, it records to a file, no laser\n"));
  EXPECT_THAT(laser_line("real"), HasSubstr("connected, Idle\n"));
}

TEST(Render, StatusSaysOfALaserWhatIs) {
  const auto status = [](const json& laser, const char* lid) {
    return render_status({{"state", "Idle"}, {"laser", laser}, {"lid", lid}, {"panels", 0}});
  };
  EXPECT_THAT(status({{"connected", false}, {"why_not_connected", "laser mode is off; set $32=1"}}, "unknown"),
              ::testing::HasSubstr("NOT CONNECTED: laser mode is off; set $32=1\n"));
  const std::string bare = status({{"connected", true},
                                   {"homed", true},
                                   {"finds_home", false},
                                   {"overrides_wanted", {{"feed", 150}, {"rapid", 100}, {"power", 50}}}},
                                  "unknown");
  EXPECT_THAT(bare, ::testing::HasSubstr("counts from the corner it was given"));
  EXPECT_THAT(status({{"connected", true}, {"homed", false}, {"finds_home", false}}, "unknown"),
              ::testing::AllOf(::testing::HasSubstr("no homing switches: does not count from its corner yet"),
                               ::testing::Not(::testing::HasSubstr("not homed"))));
  EXPECT_THAT(status({{"connected", true}, {"homed", false}}, "unknown"), ::testing::HasSubstr("not homed"));
  EXPECT_THAT(bare, ::testing::HasSubstr("feed 150 %, power 50 % of what the job asks for"));
  EXPECT_THAT(bare, ::testing::HasSubstr("Lid          not known, the laser's controller has told of no lid switch\n"));
}

TEST(Render, NothingOfAnotherTypeThrows) {
  for (const json& odd :
       {json(nullptr), json(3), json::array({1}), json{{"panels", 7}, {"jobs", "x"}, {"tasks", {1, "a"}}},
        json{{"laser", 3}, {"job", {{"pieces", "many"}}}, {"load", "x"}, {"state", 1}}}) {
    for (const auto render :
         {render_status,       render_panels,     render_panel,    render_registration, render_scan_result,
          render_certificates, render_proposals,  render_proposal, render_refused,      render_edits,
          render_edited,       render_merged,     render_jobs,     render_job,          render_new_job,
          render_plans,        render_plan,       render_new_plan, render_tasks,        render_task,
          render_next,         render_state,      render_twin,     render_plain,        render_pieces,
          render_passport,     render_certificate}) {
      render(odd);
    }
  }
}

TEST(Render, PanelsLineUp) {
  const json reply = {{"panels",
                       {{{"id", "P-0001"},
                         {"width_mm", 420.2},
                         {"height_mm", 280},
                         {"area_book_mm2", {{"free", 81200}, {"reserved", 0}, {"cut", 1250}}},
                         {"faces", {"show", "back"}},
                         {"rms_mm", 0.0312}},
                        {{"id", "P-2"},
                         {"width_mm", 90},
                         {"height_mm", 80},
                         {"area_book_mm2", {{"free", 5000}}},
                         {"parent", "P-0001"}}}}};
  EXPECT_EQ(render_panels(reply),
            "PANEL           SIZE     FREE  RESERVED     CUT  FACES            FIT  FROM\n"
            "P-0001  420 x 280 mm  812 cm2     0 cm2  12 cm2  show, back  0.031 mm\n"
            "P-2       90 x 80 mm   50 cm2                                          P-0001\n");
}

// By which one looked for a panel, and finds it on the shelf.
TEST(Render, WhereWordsWereGivenPanelsHaveNameShelfAndWoods) {
  const json reply = {{"panels",
                       {{{"id", "P-0002"},
                         {"width_mm", 90},
                         {"height_mm", 80},
                         {"fitting_mm2", 4000},
                         {"area_book_mm2", {{"free", 5000}}},
                         {"name", "Burl"},
                         {"shelf", "Rack B7"},
                         {"woods", {"walnut", "maple"}}}}}};
  EXPECT_EQ(render_named_found(reply),
            "PANEL         SIZE  FITTING    FREE  FROM  NAME  SHELF    WOODS\n"
            "P-0002  90 x 80 mm   40 cm2  50 cm2        Burl  Rack B7  walnut, maple\n");
  EXPECT_THAT(render_named_panels(reply), HasSubstr("Burl  Rack B7  walnut, maple"));
  EXPECT_THAT(render_panels(reply), ::testing::Not(HasSubstr("Rack B7")));
}

TEST(Render, APieceTellsWhereOnThePanelItsOutlineIs) {
  json outline = {{30, 20}, {40, 20}, {40, 25}, {35, 28}, {30, 25}};
  const auto told = [&] { return render_passport({{"wood", {{"panel", "P-1"}, {"outline_mm", outline}}}}); };
  EXPECT_THAT(told(), ::testing::HasSubstr("Outline      5 corners, 10.0 x 8.0 mm from 30.0, 20.0 mm on, 65.0 mm2\n"
                                           "             30.00, 20.00; 40.00, 20.00; 40.00, 25.00; 35.00, 28.00; "
                                           "30.00, 25.00\n"));
  outline = json::array();
  for (int i = 0; i < 360; ++i)
    outline.push_back({50 + 10 * std::cos(i * M_PI / 180), 60 - 10 * std::sin(i * M_PI / 180)});
  EXPECT_THAT(told(), ::testing::HasSubstr("Outline      360 corners, 20.0 x 20.0 mm from 40.0, 50.0 mm on, 314.1 mm2\n"
                                           "Turned"))
      << "nobody reads so many";
  outline = {{30, "x"}, 3};
  EXPECT_THAT(told(), ::testing::Not(::testing::HasSubstr("Outline")));
}

TEST(Render, AReconciledScanNamesEachDifference) {
  const json result = {{"panel", "P-1"},
                       {"registration", {{"rms_mm", 0.0312}, {"max_mm", 0.07}}},
                       {"differences",
                        {{{"kind", "gone_not_booked"}, {"place_mm", {10, 20.04}}, {"area_mm2", 3.25}},
                         {{"kind", "booked_not_gone"},
                          {"place_mm", {41.7, 226.3}},
                          {"area_mm2", 23.9},
                          {"pieces", {{{"job", 2}, {"mark", "A6"}, {"state", "cut"}}}}}}}};
  EXPECT_EQ(
      render_scan_result(result),
      "Panel P-1\n"
      "Registered   RMS 0.031 mm, worst 0.070 mm\n"
      "Ledger       2 DIFFERENCES from the wood\n"
      "             wood is gone that is not booked as cut, at 10.0, 20.0 mm, 3.2 mm2\n"
      "             booked as cut, and still in the panel, at 41.7, 226.3 mm, 23.9 mm2, piece A6 of job 2, cut\n");
}

TEST(Render, WhatWasDecidedOfADifferenceNamesThePiecesItTouches) {
  const auto decided = [](const char* verdict) {
    return json{{"id", 1},
                {"kind", "gone_not_booked"},
                {"place_mm", {10, 20}},
                {"area_mm2", 9.5},
                {"decided", {{"verdict", verdict}, {"who", "uid 1000"}, {"note", ""}, {"at", "2026"}}}};
  };
  EXPECT_THAT(
      render_differences(
          {{"panel", "P-1"}, {"differences", {decided("written_off")}}, {"suspect", {{{"job", 2}, {"mark", "A6"}}}}}),
      HasSubstr("The wood of piece A6 of job 2 lies there: it is suspect. Say that it is lost with `veneerctl job "
                "settle 2 A6 scrap`, then `veneerctl job redo 2 A6` finds other wood.\n"));
  EXPECT_THAT(render_differences({{"panel", "P-1"}, {"differences", {decided("accepted")}}}),
              HasSubstr("Nothing is open on P-1; 1 accepted.\n"));
}

TEST(Render, AScanSaysWhatItLeavesOut) {
  const json warning = {{"name", "strip-1"}, {"text", "a strip is left out: it looks like the board"}};
  const json result = {{"panel", "P-1"}, {"warnings", {warning, 7}}};
  EXPECT_EQ(render_scan_result(result), "Panel P-1\nWarning strip-1: a strip is left out: it looks like the board\n");
}

TEST(Render, AScanThatWaitsSaysWhatItSawAndTheOneCommandThatTakesIt) {
  json seen = {{"proposal", 3}, {"new", true}, {"size_mm", {240.04, 159.98}}, {"usable_mm2", 20'000},
               {"zones", 6},    {"tiles", 1},  {"warnings", json::array()}};
  EXPECT_EQ(render_scan_result(seen),
            "Proposal 3: a new panel\n"
            "Size         240.0 x 160.0 mm\n"
            "Usable       200 cm2 in 6 strips\n"
            "Not in stock yet. Take it: `veneerctl panel accept 3`\n"
            "Its picture: `veneerctl panel proposals 3 --picture scan.png`. Drop it: `veneerctl panel refuse 3`\n");
  seen["warnings"] = {{{"name", "size"}, {"text", "not round"}}, {{"name", "strip-1"}, {"text", "in doubt"}}};
  EXPECT_THAT(render_scan_result(seen),
              ::testing::AllOf(HasSubstr("Warning size: not round\n"),
                               HasSubstr("`veneerctl panel accept 3 --override size --override strip-1`")));
  seen["number"] = 3, seen["made"] = "2026-05-01T07:30:00.000Z", seen["who"] = "uid 7", seen["decided"] = nullptr;
  EXPECT_THAT(render_proposal(seen), HasSubstr("--override size"));
  EXPECT_THAT(render_proposals({{"proposals", {seen}}}), HasSubstr("size, strip-1"));
  seen["decided"] = {{"verdict", "accepted"},
                     {"panel", "P-0004"},
                     {"who", "uid 7"},
                     {"at", "2026-05-01"},
                     {"overruled", {"size", "strip-1"}},
                     {"note", ""}};
  EXPECT_THAT(render_proposal(seen), ::testing::AllOf(HasSubstr("P-0004"), HasSubstr("Overruled    size, strip-1")));
}

TEST(Render, EditsOfAMaskSayWhatTheyDidAndHowToTakeThemBack) {
  EXPECT_EQ(
      render_edited({{"panel", "P-1"},
                     {"version", 4},
                     {"usable_mm2", 20'000},
                     {"changed_mm2", -250},
                     {"number", 2},
                     {"reserved", {{{"job", 3}, {"mark", "A1"}}}}}),
      "Panel P-1: 200 cm2 of usable wood, 2.5 cm2 less than before (version 4).\n"
      "Take it back: `veneerctl panel mask P-1 --remove 2`\n"
      "Pieces that are reserved there are cut all the same: A1 of job 3. Cancel their job if they must not be.\n");
}

TEST(Render, AScanProposesWhatBecameOfSuspectPieces) {
  const auto suspect = [](const char* mark, const char* seen, double share) {
    return json{
        {"job", 2}, {"mark", mark}, {"sighting", {{"seen", seen}, {"gone_share", share}, {"at", "2026-05-01T"}}}};
  };
  EXPECT_EQ(render_scan_result(
                {{"panel", "P-1"},
                 {"suspects",
                  {suspect("A1", "cut", 0.981), suspect("A2", "still_there", 0), suspect("A3", "unclear", 0.4)}}}),
            "Panel P-1\n"
            "Suspect      A1 of job 2: the scan of 2026-05-01 saw its wood gone (98 %), so it was cut. Look, then "
            "`veneerctl job settle 2 A1`\n"
            "Suspect      A2 of job 2: the scan of 2026-05-01 saw its wood still there. Look, then "
            "`veneerctl job settle 2 A2`\n"
            "Suspect      A3 of job 2: the scan of 2026-05-01 saw its wood gone in part (40 %). Look, then "
            "`veneerctl job settle 2 A3`\n");
}

TEST(Render, APartSaysWhatItTookOver) {
  const json result = {{"panel", "P-3"}, {"new", true}, {"part_of", "P-1"}, {"carried", 7}};
  EXPECT_THAT(render_scan_result(result), HasSubstr("P-1, with 7 places where its wood was gone"));
}

TEST(Render, AShelfOfRetiredPanelsSaysSo) {
  EXPECT_THAT(render_panels({{"panels", json::array()}, {"retired_left_out", 2}}), HasSubstr("panel list --all"));
}

TEST(Render, APanelThatLeavesTheStockSaysHowItComesBack) {
  EXPECT_EQ(render_retired({{"panel", "P-0002"}, {"retired", true}}),
            "Panel P-0002 is out of stock. `veneerctl panel restore P-0002` puts it back.\n");
  EXPECT_EQ(render_retired({{"panel", "P-0002"}, {"retired", false}}), "Panel P-0002 is in stock.\n");
  EXPECT_EQ(render_retired({{"panel", "P-0002"}, {"retired", true}, {"sawn", true}}),
            "Panel P-0002 is out of stock. Scan each of its parts: `veneerctl panel scan`.\n");
}

TEST(Render, AnEmptyShelfTellsWhatToDo) {
  EXPECT_NE(render_panels({{"panels", json::array()}}).find("veneerctl panel scan"), std::string::npos);
  EXPECT_THAT(render_found({{"panels", json::array()}}), HasSubstr("so much of this wood.\n"));
  EXPECT_THAT(render_named_found({{"panels", json::array()}}),
              HasSubstr("so much of this wood, of those with all of these words"))
      << "only a word may not fit";
  EXPECT_NE(render_jobs({{"jobs", json::array()}}).find("veneerctl job new"), std::string::npos);
}

TEST(Render, ANewJobTellsWhatThePlannerWarnsOf) {
  EXPECT_EQ(render_new_job({{"job", 7},
                            {"pieces", 4},
                            {"without_lead_in", 2},
                            {"warnings", {"\"sky\" is one plain tone", 3, "it is pale"}}}),
            "Job 7 (4 pieces) is planned and its wood reserved. Start it with `veneerctl job start 7`.\n"
            "2 of its pieces lie too close to others for a lead-in: their cuts begin on their edges.\n"
            "Warning: \"sky\" is one plain tone\n"
            "Warning: it is pale\n");
}

TEST(Render, ANewJobTellsWhatItsOptionsGained) {
  const auto told = [](const json& result) {
    const std::string text = render_new_job(result);
    return text.substr(text.find('\n') + 1);
  };
  EXPECT_EQ(told({{"job", 7},
                  {"global", {{"greedy_cost", 16}, {"greedy_unfilled", 0}, {"cost", 12}, {"stopped", false}}},
                  {"fine_rotation", {{"cost_before", 12}, {"cost", 11.4}, {"moved", 3}}}}),
            "Choosing together: cost 12.00 instead of 16.00 (25.0 % less).\n"
            "3 pieces turned finely: cost 11.40 instead of 12.00 (5.0 % less).\n");
  EXPECT_EQ(told({{"job", 7}, {"refined", {{"cost_before", 12}, {"cost_refined", 10}, {"cost", 9}, {"rounds", 2}}}}),
            "Borders follow the picture: cost 9.00 instead of 12.00 (25.0 % less), wood chosen again 2 times.\n");
  EXPECT_EQ(told({{"job", 7},
                  {"global", {{"greedy_unfilled", 2}, {"stopped", true}, {"iterations", 50}, {"budget", 90}}},
                  {"fine_rotation", nullptr}}),
            "Choosing together: 2 patches have wood that would have had none, stopped after 50 of 90 iterations.\n");
}

TEST(Render, AJobShowsItsPanelsAndWarnsOfSuspects) {
  const json job = {
      {"id", 3},
      {"name", "Grace"},
      {"state", "running"},
      {"pieces", 300},
      {"cut", 150},
      {"suspect", 2},
      {"width_mm", 200},
      {"height_mm", 250},
      {"options", {{"patch_mm", 12}}},
      {"refined", {{"cost_before", 12}, {"cost_refined", 9}, {"cost", 9}, {"rounds", 0}}},
      {"panels",
       {{{"panel", "P-0001"}, {"pieces", 200}, {"cut", 150}}, {{"panel", "P-2"}, {"pieces", 100}, {"cut", 0}}}}};
  EXPECT_EQ(render_job(job),
            "Job 3 \"Grace\"\n"
            "State        running\n"
            "Cut          [############------------]  50 %  150 of 300 pieces\n"
            "Suspect      2: look at these pieces before you use them\n"
            "Picture      200 x 250 mm, patches of 12.0 mm\n"
            "Borders      follow the picture: cost 9.00 instead of 12.00 (25.0 % less)\n"
            "  PANEL   PIECES  CUT\n"
            "  P-0001     200  150\n"
            "  P-2        100    0\n");
}

// What the ledger says of a job follows with the first piece: what the cell does is newer.
TEST(Render, AJobThatWaitsForItsPanelIsNotCalledAborted) {
  const json job = {{"id", 3},      {"name", "Grace"}, {"state", "aborted"},
                    {"pieces", 10}, {"cut", 4},        {"now", "waits for panel P-0002"}};
  const std::string list = render_jobs({{"jobs", {job}}});
  EXPECT_NE(list.find("waits for panel P-0002"), std::string::npos) << list;
  EXPECT_EQ(list.find("aborted"), std::string::npos) << list;
  EXPECT_NE(render_job(job).find("State        waits for panel P-0002\n"), std::string::npos);
  EXPECT_EQ(render_job(job).find("aborted"), std::string::npos) << render_job(job);
  EXPECT_NE(render_status({{"state", "Suspended"}, {"job", job}}).find("3 \"Grace\" (waits for panel P-0002)"),
            std::string::npos);
}

TEST(Render, SuspectsAreToldWithTheCommandThatSettlesOne) {
  const json job = {{"id", 3},
                    {"suspects", {{{"mark", "A1"}, {"panel", "P-0002"}}, {{"mark", "A4"}, {"panel", "P-0002"}}}}};
  EXPECT_EQ(render_suspects(job),
            "A1 on P-0002\n"
            "A4 on P-0002\n"
            "Look at each, and say what became of it: `veneerctl job settle 3 A1 cut` when it is good, `scrap` when it "
            "is lost, `released` when its wood is whole.\n");
  EXPECT_EQ(render_suspects({{"id", 3}, {"suspects", json::array()}}), "No piece of job 3 is suspect.\n");
}

TEST(Render, WhatIsLeftOfAJobIsSaidWithTheStatus) {
  const std::string text = render_status({{"state", "Aborted"}, {"next", "4 of 10 pieces are cut: Clear, then Reset"}});
  EXPECT_NE(text.find("Next         4 of 10 pieces are cut: Clear, then Reset\n"), std::string::npos) << text;
}

TEST(Render, TheNextStepIsOneSentenceAndItsCommand) {
  const json status = {{"state", "Stopped"},
                       {"next", nullptr},
                       {"next_step",
                        {{"step", "scan"},
                         {"sentence", "There is no wood in stock: lay a panel on the scanner."},
                         {"command", "veneerctl panel scan"}}}};
  EXPECT_EQ(render_next(status), "There is no wood in stock: lay a panel on the scanner.\n  veneerctl panel scan\n");
  EXPECT_THAT(
      render_status(status),
      HasSubstr("Next         There is no wood in stock: lay a panel on the scanner. (veneerctl panel scan)\n"));
  EXPECT_EQ(render_next({{"next_step", {{"sentence", "Wait."}, {"command", nullptr}}}}), "Wait.\n");
}

TEST(Render, WhatHasToBeKnownAndConfirmedBeforeMotion) {
  const std::string text = render_status({{"state", "Suspended"},
                                          {"load",
                                           {{"panel", "P-0002"},
                                            {"face_up", "back"},
                                            {"found", true},
                                            {"sentence", ""},
                                            {"estimate_s", 840.0},
                                            {"focus_mm", 2.1}}},
                                          {"confirm", {"exhaust", "air assist"}},
                                          {"recut", {{"panel", "P-0001"}, {"pieces", 12}}}});
  EXPECT_NE(text.find("Takes        about 14 min\n"), std::string::npos) << text;
  EXPECT_NE(text.find("Focus        2.1 mm above the bed"), std::string::npos) << text;
  EXPECT_NE(text.find("Confirm      exhaust, air assist\n"), std::string::npos) << text;
  EXPECT_NE(text.find("12 pieces of P-0001 can be cut again"), std::string::npos) << text;
}

TEST(Render, StatusTellsOfALookThatIsOwed) {
  const std::string text =
      render_status({{"state", "Aborted"},
                     {"owed_look", {{"job", 1}, {"panel", "P-0001"}, {"pieces", 3}, {"sentence", "leave it"}}}});
  EXPECT_NE(text.find("Owed         leave it\n"), std::string::npos) << text;
  EXPECT_EQ(render_status({{"state", "Idle"}, {"owed_look", nullptr}}).find("Owed"), std::string::npos);
}

TEST(Progress, ALineFitsItsTerminal) {
  EXPECT_EQ(progress_line(0.495, "matching patches", 80), "[###########-------------]  49 %  matching patches");
  EXPECT_EQ(progress_line(7, "", 40), "[########################] 100 %");
  for (int columns = 1; columns < 90; ++columns) {
    const std::string line = progress_line(0.5, std::string(200, 'x'), columns);
    EXPECT_LE(line.size(), std::max<std::size_t>(static_cast<std::size_t>(columns), 32U)) << columns;
  }
  EXPECT_EQ(width_of(progress_line(
                0.5, "\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4", 43)),
            42U);
}

TEST(Progress, PlainOutputIsOneLinePerChangeOfText) {
  std::ostringstream out;
  {
    Progress progress(out, Progress::Style::kPlain);
    progress.show(0, "scanning");
    progress.show(0.5, "scanning");
    progress.show(0.9, "stitching");
    progress.show(1, "");
  }
  EXPECT_EQ(out.str(), "scanning\nstitching\n");
}

TEST(Progress, ACountThatRunsIsToldEveryTenth) {
  std::ostringstream out;
  Progress progress(out, Progress::Style::kPlain);
  for (int i = 0; i <= 100; ++i) progress.show(i / 100.0, "placing pieces: " + std::to_string(i) + " of 100");
  const std::string text = out.str();
  EXPECT_GE(std::ranges::count(text, '\n'), 10);
  EXPECT_LE(std::ranges::count(text, '\n'), 11);
}

TEST(Progress, ATerminalsLineIsWrittenOverAndWipedAtTheEnd) {
  std::ostringstream out;
  {
    Progress progress(out, Progress::Style::kTerminal);
    progress.show(0.5, "scanning");
    progress.show(0.5, "scanning");
  }
  EXPECT_EQ(out.str().find('\n'), std::string::npos);
  EXPECT_TRUE(out.str().ends_with("\r\033[K"));
  EXPECT_EQ(out.str().find("scanning"), out.str().rfind("scanning"));
}

}  // namespace
}  // namespace veneer::cli
