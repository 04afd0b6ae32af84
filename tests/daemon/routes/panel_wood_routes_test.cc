// Which wood of panels is free, through the API: area books, and the search for wood.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "base/polygon_ops.h"
#include "cli/render.h"
#include "tests/daemon/routes/panel_cell.h"
#include "tests/db/counted_statements.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::panel_square;

class PanelWood : public PanelCell {};

// The area book says the same at each step, and its classes are the panel.
void expect_book(SquareMillimetres whole, const json& panel, double reserved, double cut, double kerf) {
  const json& book = panel["area_book_mm2"];
  EXPECT_NEAR(book["panel"].get<double>(), 600, 1e-9);
  EXPECT_NEAR(book["reserved"].get<double>(), reserved, 1e-9);
  EXPECT_NEAR(book["cut"].get<double>(), cut, 1e-9);
  EXPECT_NEAR(book["kerf"].get<double>(), kerf, 1e-9);
  double sum = 0;
  for (const auto& [name, area] : book.items()) sum += name == "panel" ? 0 : area.get<double>();
  EXPECT_NEAR(sum, 600, 6e-4);
  const double beside = whole.count() - 600;  // these masks are a little larger than their panels
  EXPECT_GE(book["free"].get<double>() + beside, panel["free_mm2"].get<double>() - 1e-9) << "parts of pixels";
}

// It rose while pieces were cut, and counted what was cut until the next scan.
TEST_F(PanelWood, FreeWoodIsWhatNothingIsBookedOn) {
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], get("/panels/P-0002")["usable_mm2"]);
  const db::NewPlan plan = squares(6, {5, 15}, 5);
  std::vector<db::PieceRecord> pieces;
  change([&](Repositories& r) -> Status {
    const auto job = r.jobs.create(plan, kThen);
    if (!job) return job.error();
    auto all = r.jobs.pieces(*job);
    if (!all) return all.error();
    pieces = std::move(*all);
    return Ok();
  });
  // A pixel that is touched is not free, all around: 0.085 mm of 6.5 each.
  expect_book(kWhole, get("/panels/P-0002"), 2 * 6.5 * 6.5, 0, 0);
  const double reserved = get("/panels/P-0002")["free_mm2"];
  EXPECT_NEAR(reserved, kWhole.count() - 2 * 6.5 * 6.5, 2 * 4 * 6.7 * 0.17);
  EXPECT_LE(reserved, kWhole.count() - 2 * 6.5 * 6.5);
  change([&](Repositories& r) -> Status {
    const auto run = r.jobs.start_run(
        pieces[0].job, PanelId{"P-0002"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, kThen);
    if (!run) return run.error();
    if (Status cutting = r.jobs.mark_cutting(pieces[0].id, kThen); !cutting) return cutting;
    if (Status cut = r.jobs.book_piece(pieces[0].id, kThen); !cut) return cut;
    return r.jobs.finish_run(*run, false, kThen);
  });
  EXPECT_EQ(get("/panels/P-0002")["free_mm2"], reserved) << "what was cut is as little free as what is to be cut";
  expect_book(kWhole, get("/panels/P-0002"), 6.5 * 6.5, 36, 6.5 * 6.5 - 36);
  change([&](Repositories& r) { return r.jobs.cancel(pieces[0].job, kThen); });
  expect_book(kWhole, get("/panels/P-0002"), 0, 36, 6.5 * 6.5 - 36);
  EXPECT_NEAR(get("/panels/P-0002")["free_mm2"].get<double>(), (kWhole.count() + reserved) / 2, 1e-6);
}

// FREE of the list was what a plan may use, in whole pixels, and its CUT held kerf and scrap too.
TEST_F(PanelWood, FreeReservedAndCutAreTheSameWhereverTheyStand) {
  const db::NewPlan plan = squares(5, {2.03, 8.53, 15.03, 21.53}, 2.03);
  change([&](Repositories& r) -> Status {
    const auto job = r.jobs.create(plan, kThen);
    if (!job) return job.error();
    const auto pieces = r.jobs.pieces(*job);
    if (!pieces) return pieces.error();
    const auto run = r.jobs.start_run(
        *job, PanelId{"P-0002"},
        Isometry2<BedFrame, PanelFrame>(degrees(178), point<BedFrame>(40, 30), Handedness::kImproper), 0.04_mm, kThen);
    if (!run) return run.error();
    for (const std::size_t i : {0U, 1U}) {
      if (Status cutting = r.jobs.mark_cutting((*pieces)[i].id, kThen); !cutting) return cutting;
      if (i == 0)
        if (Status cut = r.jobs.book_piece((*pieces)[i].id, kThen); !cut) return cut;
    }
    if (Status broken = r.jobs.abort_run(*run, {}, "the lid was opened", kThen); !broken) return broken;
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(10, 12, 3)), "a knot", kThen);
  });
  const json shown = get("/panels/P-0002"), book = shown["area_book_mm2"];
  const json listed = get("/panels")["panels"][1], found = get("/panels?min_free_mm2=1")["panels"][0];
  for (const char* state : {"free", "reserved", "cut", "kerf", "suspect", "scrap"}) EXPECT_GT(book[state], 0) << state;
  EXPECT_EQ(listed["area_book_mm2"], book);
  EXPECT_EQ(found["area_book_mm2"], book);
  EXPECT_EQ(listed["mask"], "counted");
  // The same in tens of cm2, so that what people see differs where the figures do.
  const auto large = [](json panel) {
    for (auto& [name, area] : panel["area_book_mm2"].items()) area = 1000 * area.get<double>();
    for (const char* other : {"free_mm2", "reserved_mm2", "cut_mm2"}) panel[other] = 1000 * panel[other].get<double>();
    return panel;
  };
  const std::string one = cli::render_panel(large(shown)), all = cli::render_panels({{"panels", {large(listed)}}});
  for (const char* label : {"Free", "Reserved", "Cut"}) {
    const std::size_t line = one.find(fmt::format("\n{} ", label));
    ASSERT_NE(line, std::string::npos) << one;
    const std::string area = one.substr(line + 14, one.find('\n', line + 1) - line - 14);
    EXPECT_THAT(all, HasSubstr(" " + area)) << label;
    if (std::string(label) == "Free")
      EXPECT_THAT(cli::render_found({{"panels", {large(found)}}}), HasSubstr(" " + area));
  }
}

TEST_F(PanelWood, FindsThePanelsThatHaveTheWoodOneLooksFor) {
  // P-0002 is walnut on the left and maple on the right, and looks so. P-0001 has no wood left.
  cv::Mat map(kRows, kColumns, CV_8UC3, cv::Scalar(190, 220, 240));
  map.colRange(0, kColumns / 2) = cv::Scalar(40, 60, 80);
  const auto walnut_and_maple = cell->panel_library.store_picture(map, "panels", "both");
  const auto mask =
      cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "all");
  ASSERT_TRUE(walnut_and_maple.ok() && mask.ok());
  change([&](Repositories& r) -> Status {
    const auto version = r.panels.add_mask(
        {"P-0002"}, {0, walnut_and_maple->file, mask->file, walnut_and_maple->sha256, kThen, kWhole}, 1);
    if (!version) return version.error();
    return r.materials.add_zones(
        {"P-0002"}, {{1, Region<PanelFrame>(strip(0, 15)), "walnut"}, {2, Region<PanelFrame>(strip(15, 31)), "maple"}});
  });
  const auto found = [&](const std::string& query) {
    const json reply = get("/panels?" + query);
    std::string text;
    for (const json& panel : reply["panels"])
      text += fmt::format("{}{} {:.0f}", text.empty() ? "" : ", ", panel["id"].get<std::string>(),
                          panel["fitting_mm2"].get<double>());
    return text;
  };
  EXPECT_EQ(found("min_free_mm2=100"), "P-0002 619") << "P-0001 has none";
  EXPECT_EQ(found("min_free_mm2=700"), "");
  EXPECT_EQ(found("wood=oak"), "");
  EXPECT_EQ(found("wood=walnut&min_free_mm2=310"), "") << "it has 300";
  EXPECT_EQ(found("wood=walnut&patch_mm=16"), "") << "it is 15 mm wide";
  const std::string walnut = found("wood=walnut&patch_mm=14");
  EXPECT_THAT(walnut, HasSubstr("P-0002 30"));
  // Half of its wood each, but for what lies so near to the other half that it looks like neither.
  EXPECT_NEAR(get("/panels?tone=dark&patch_mm=14")["panels"][0].value("fitting_mm2", 0.0), 310 - 10, 15);
  EXPECT_NEAR(get("/panels?tone=light&patch_mm=14")["panels"][0].value("fitting_mm2", 0.0), 310 - 10, 15);
  EXPECT_EQ(found("tone=dark&patch_mm=16"), "");
  EXPECT_EQ(found("tone=dark&wood=maple&patch_mm=2"), "");
  // A knot in the walnut leaves strips of 4 and 5 mm on its sides, and 8 mm below and above it.
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(4, 8, 6)), "a knot", kThen);
  });
  EXPECT_EQ(found("wood=walnut&patch_mm=9"), "");
  EXPECT_THAT(found("wood=walnut&patch_mm=6"), HasSubstr("P-0002 2"));
  EXPECT_THAT(cli::render_found(get("/panels?wood=walnut&patch_mm=6")), HasSubstr("P-0002"));
  EXPECT_EQ(cli::render_found(get("/panels?wood=oak")), "No panel in stock has so much of this wood.\n");
  // Pages go on where the one before stopped.
  EXPECT_EQ(get("/panels?min_free_mm2=1&limit=1")["panels"].size(), 1U);
  EXPECT_TRUE(get("/panels?min_free_mm2=1&limit=1&cursor=2")["panels"].empty());
  ASSERT_EQ(post("/panels/P-0002/retire", {{"reason", "sold"}}).status, 200);
  EXPECT_EQ(found("min_free_mm2=1"), "") << "out of stock";
}

// Who lists a thousand panels asks the database no more often than who lists two.
TEST_F(PanelWood, ManyPanelsAreListedAndSearchedWithAsFewQuestionsAsTwo) {
  db::StatementsOfReaders watched;
  // The readers are opened anew, and seen; nothing is left behind that the first cell has asked for.
  change([](Repositories&) { return Ok(); });
  reactor.restart();
  reactor.poll();
  cell.reset();
  open();
  const auto asked = [&](const std::string& path) {
    for (const char* panel : {"P-0001", "P-0002"}) until_what_is_left_is_booked(panel);
    get(path);  // what has to be counted once
    db::StatementsOfReaders::count();
    const json reply = get(path);
    EXPECT_TRUE(reply.contains("panels")) << reply;
    return db::StatementsOfReaders::count();
  };
  const std::string search = "/panels?wood=maple&patch_mm=6";
  change([&](Repositories& r) {
    return r.materials.add_zones({"P-0002"}, {{1, Region<PanelFrame>(strip(0, 15)), "maple"}});
  });
  EXPECT_EQ(asked("/panels"), 12);
  EXPECT_EQ(asked(search), 14);
  EXPECT_EQ(asked("/panels?text=p-00"), 14);
  change([&](Repositories& r) -> Status {
    for (const char* id : {"P-0003", "P-0004", "P-0005"}) {
      auto more = r.panels.find({"P-0002"});
      if (!more) return more.error();
      more->id = {id};
      if (Status added = r.panels.add(*more, {}, {}); !added) return added;
      if (Status named = r.materials.add_zones({id}, {{1, Region<PanelFrame>(strip(0, 15)), "maple"}}); !named)
        return named;
    }
    return Ok();
  });
  EXPECT_EQ(get("/panels")["panels"].size(), 5U);
  EXPECT_EQ(get(search)["panels"].size(), 4U);
  EXPECT_EQ(asked("/panels"), 12);
  EXPECT_EQ(asked(search), 14);
}

// As the shelf of the console finds them.
TEST_F(PanelWood, PanelsAreFoundByNumberNameShelfAndWoods) {
  change([&](Repositories& r) -> Status {
    if (Status named = r.materials.add_zones({"P-0002"}, {{1, Region<PanelFrame>(strip(0, 15)), "Juglans nigra"}});
        !named)
      return named;
    return r.facts.set_panel({"P-0002"}, {"Rack B7", {}, {}, "local:1000", kThen}, {});
  });
  const auto found = [&](const std::string& query) {
    const json reply = get("/panels?" + query);
    std::string ids;
    for (const json& panel : reply["panels"]) ids += panel["id"].get<std::string>() + " ";
    return ids;
  };
  EXPECT_EQ(found("text=b7"), "P-0002 ");
  EXPECT_EQ(found("text=JUGLANS"), "P-0002 ");
  EXPECT_EQ(found("text=juglans%20rack%20p-0002"), "P-0002 ") << "all words, wherever they stand";
  EXPECT_EQ(found("text=juglans%20B8"), "");
  EXPECT_EQ(found("text=p-00"), "P-0001 P-0002 ");
  EXPECT_EQ(found("text=b7&limit=1"), "P-0002 ") << "the second of all";
  EXPECT_EQ(found("text=p-00&limit=1&cursor=1"), "P-0002 ");
  const std::string listed = cli::render_named_panels(get("/panels?text=b7"));
  EXPECT_THAT(listed, HasSubstr("P-0002"));
  EXPECT_THAT(listed, HasSubstr("Rack B7")) << "by which somebody fetches it";
  EXPECT_THAT(listed, HasSubstr("Juglans nigra"));
  EXPECT_THAT(cli::render_named_panels(get("/panels?text=b8")), HasSubstr("No panel has all of these words"));
  EXPECT_EQ(found("text=p-0001&min_free_mm2=1"), "") << "it has no free wood";
  EXPECT_EQ(found("text=b7&min_free_mm2=1"), "P-0002 ");
  EXPECT_EQ(ask("GET", "/api/v1/panels?text=a%20b%20c%20d%20e%20f%20g%20h%20i%20j%20k").status, 400);
  change([](Repositories& r) {
    return r.facts.set_panel({"P-0002"}, {"Übersee ŻÓŁW ×", {}, {}, "local:1000", kThen}, {});
  });
  EXPECT_EQ(found("text=%C3%BCbersee"), "P-0002 ") << "u with two dots, small";
  EXPECT_EQ(found("text=%C3%9CBERSEE"), "P-0002 ") << "and large";
  EXPECT_EQ(found("text=%C5%BC%C3%B3%C5%82w"), "P-0002 ") << "in Polish letters";
  EXPECT_EQ(found("text=%C3%B7"), "") << "division is no small multiplication";
}

// Whoever asks for all panels, whose masks have to be looked at, keeps nobody from what is known.
TEST_F(PanelWood, AMaskIsLookedAtAmongThePicturesAndWhatIsKnownIsToldAtOnce) {
  // Its remnant may be booked at any time.
  const auto panel = [this] {
    json told = get("/panels/P-0001");
    told.erase("remnant");
    return told;
  };
  cell->remnant_clerk.reset();  // it would look at the other one
  const json known = panel();
  EXPECT_TRUE(known["area_book_mm2"].is_object()) << known;
  ApiRequest question;
  question.caller = {Role::kAdmin, "uid 1000", TransportKind::kUnix};
  std::promise<void> looking, looked;
  cell->pictures->ask(
      question, [](const ApiReply&) {},
      [&looking, seen = looked.get_future().share()](Repositories&) {
        looking.set_value();
        seen.wait();
        return ApiReply();
      });
  looking.get_future().wait();
  EXPECT_EQ(panel(), known);
  const auto answer = begin_asking("GET", "/api/v1/panels/P-0002");
  reactor.restart();
  while (!*answer && cell->pictures->waiting() == 0 && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  EXPECT_FALSE(*answer) << "it did not wait its turn";
  EXPECT_EQ(cell->pictures->waiting(), 1U);
  looked.set_value();
  while (!*answer && reactor.run_one_for(std::chrono::seconds(10)) > 0) {
  }
  ASSERT_TRUE(*answer);
  EXPECT_TRUE(body_of(**answer)["remnant"].is_object());
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009").status, 404);
}

// One file that is lost must not hide the whole stock, and nobody may take its wood for used up.
TEST_F(PanelWood, AMaskThatCannotBeReadIsToldInWordsAndTheOthersAreListed) {
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0001"}, Region<PanelFrame>(panel_square(5, 5, 6)), "burnt", kThen);
  });
  std::filesystem::remove(cell->panel_library.path_of(
      cell->database->call([](Repositories& r) { return r.panels.find({"P-0001"}); })->mask_file));
  const json all = get("/panels");
  ASSERT_EQ(all["panels"].size(), 2U) << all.dump();
  for (const char* unknown : {"free_mm2", "area_book_mm2"})
    EXPECT_TRUE(all["panels"][0][unknown].is_null()) << all["panels"][0];
  EXPECT_EQ(all["panels"][0]["mask"], "unreadable");
  EXPECT_GT(all["panels"][1]["free_mm2"], 0);
  EXPECT_EQ(all["panels"][1]["mask"], "counted");
  const std::string listed = cli::render_panels(all);
  EXPECT_THAT(listed,
              HasSubstr("P-0001: its mask cannot be read, so that nobody knows what of it is free: put the file "
                        "back from a backup, or scan the panel"));
  const std::size_t row = listed.find("P-0001");
  EXPECT_THAT(listed.substr(row, listed.find('\n', row) - row), ::testing::Not(HasSubstr("cm2")));
  const json shown = get("/panels/P-0001");
  EXPECT_TRUE(shown["area_book_mm2"].is_null());
  EXPECT_THAT(cli::render_panel(shown), HasSubstr("its mask cannot be read"));
  EXPECT_THAT(cli::render_panel(shown), ::testing::Not(HasSubstr("Free ")));
  const json found = get("/panels?patch_mm=3");
  EXPECT_EQ(found["panels"].size(), 1U);
  EXPECT_EQ(found["not_searched"], json::parse(R"([{"panel": "P-0001", "why": "unreadable"}])"));
  EXPECT_THAT(cli::render_found(found), HasSubstr("P-0001 was not looked at, its mask or map cannot be read: "));
}

// Of the tone of wood a map tells.
TEST_F(PanelWood, ASearchForATonePassesNoPanelOverInSilenceWhoseMapIsLost) {
  const auto map_file = cell->database->call([](Repositories& r) { return r.panels.find({"P-0002"}); })->map_file;
  cell->remnant_clerk.reset();  // it may have counted before
  std::filesystem::remove(cell->panel_library.path_of(map_file));
  std::filesystem::remove_all(cell->panel_library.small_dir());
  EXPECT_EQ(get("/panels?tone=light&patch_mm=3")["not_searched"],
            json::parse(R"([{"panel": "P-0002", "why": "unreadable"}])"));
  EXPECT_EQ(get("/panels?patch_mm=3")["panels"].size(), 1U) << "for that the mask is enough";
}

// It decoded the mask of each such panel, at every search, to find then that it has no map.
TEST_F(PanelWood, ASearchForATonePassesMasksByWhoseMapsAreLost) {
  cell->remnant_clerk.reset();
  const auto of = cell->database->call([](Repositories& r) { return r.panels.find({"P-0002"}); });
  for (int i = 0; i < 2; ++i) get("/panels");
  std::filesystem::remove(cell->panel_library.path_of(of->map_file));
  std::filesystem::remove(cell->panel_library.path_of(of->mask_file));  // whoever looks at it notes that
  std::filesystem::remove_all(cell->panel_library.small_dir());
  EXPECT_EQ(get("/panels?tone=light&patch_mm=3")["not_searched"],
            json::parse(R"([{"panel": "P-0002", "why": "unreadable"}])"));
  EXPECT_TRUE(cell->stock_memory.is_readable(of->mask_file));
}

// Pictures that cannot be read are looked at as few at once as others.
TEST_F(PanelWood, ASearchLooksAtFewPanelsItselfWhoseMapsAreLost) {
  cell->remnant_clerk.reset();
  std::string map_file;
  change([&](Repositories& r) -> Status {
    for (int number = 3; number <= 20; ++number) {
      auto more = r.panels.find({"P-0002"});
      if (!more) return more.error();
      more->id = {fmt::format("P-{:04}", number)};
      map_file = more->map_file;
      if (Status added = r.panels.add(*more, {}, {}); !added) return added;
    }
    return Ok();
  });
  std::filesystem::remove(cell->panel_library.path_of(map_file));
  std::filesystem::remove_all(cell->panel_library.small_dir());
  get("/panels?tone=light&patch_mm=3");
  const auto counted = cell->database->call([&](Repositories& r) -> Result<int> {
    int known = 0;
    const auto panels = r.panels.list();
    if (!panels) return panels.error();
    for (const auto& panel : *panels) {
      const auto knows = cell->panel_figures.knows(r, panel);
      if (!knows) return knows.error();
      known += *knows ? 1 : 0;
    }
    return known;
  });
  ASSERT_TRUE(counted);
  EXPECT_LE(*counted, 4);
}

// After an import nobody has counted anything: a search of a thousand panels took minutes, and was given up on.
TEST_F(PanelWood, ASearchAnswersFromWhatIsCountedAndSaysWhatIsNot) {
  cell->remnant_clerk.reset();
  change([](Repositories& r) -> Status {
    for (int number = 3; number <= 20; ++number) {
      auto more = r.panels.find({"P-0002"});
      if (!more) return more.error();
      more->id = {fmt::format("P-{:04}", number)};
      if (Status added = r.panels.add(*more, {}, {}); !added) return added;
    }
    return Ok();
  });
  const auto search = "/panels?patch_mm=3";
  const json first = get(search);
  EXPECT_LE(first["panels"].size(), 4U) << "it counts few itself";
  EXPECT_GE(first["not_searched"].size(), 15U);
  EXPECT_EQ(first["not_searched"].back(), json::parse(R"({"panel": "P-0020", "why": "uncounted"})"));
  EXPECT_THAT(cli::render_found(first), HasSubstr(fmt::format("{} panels are not counted yet: ask again in a while",
                                                              first["not_searched"].size())));
  const json listed = get("/panels")["panels"];
  ASSERT_EQ(listed.size(), 20U);
  EXPECT_EQ(listed.back()["mask"], "uncounted");
  EXPECT_TRUE(listed.back()["area_book_mm2"].is_null());
  EXPECT_EQ(listed.back()["free_mm2"], listed.back()["usable_mm2"]) << "nothing is booked on it";
  EXPECT_THAT(cli::render_panels({{"panels", listed}}), HasSubstr(" panels are not counted yet: ask again in a while"));
  // In life it is the request that wakes whoever counts.
  RemnantClerk(*cell->database, cell->panel_library, cell->remnants, cell->panel_figures, cell->stock_memory, cell->log)
      .book_due();
  const json then = get(search);
  EXPECT_EQ(then["panels"].size(), 19U) << "P-0001 has no wood";
  EXPECT_TRUE(then["not_searched"].empty()) << then["not_searched"];
  const json counted = get("/panels")["panels"];
  for (const json& panel : counted) EXPECT_EQ(panel["mask"], "counted");
}

TEST_F(PanelWood, WhatASearchDidNotCountIsCountedBehindIt) {
  for (const char* panel : {"P-0001", "P-0002"}) until_what_is_left_is_booked(panel);
  until_counted();
  change([](Repositories& r) -> Status {
    for (int number = 3; number <= 12; ++number) {
      auto more = r.panels.find({"P-0002"});
      if (!more) return more.error();
      more->id = {fmt::format("P-{:04}", number)};
      if (Status added = r.panels.add(*more, {}, {}); !added) return added;
    }
    return Ok();
  });
  const json found = get("/panels?patch_mm=3");
  EXPECT_LT(found["panels"].size(), 11U);
  // Nobody asks for the last one.
  const auto is_known = [&] {
    const auto known = cell->database->call([&](Repositories& r) -> Result<bool> {
      const auto panel = r.panels.find({"P-0012"});
      return panel ? cell->panel_figures.knows(r, *panel) : Result<bool>(panel.error());
    });
    return known && *known;
  };
  const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!is_known() && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
  EXPECT_TRUE(is_known()) << "P-0012, which the search left out, is not counted a minute later";
}

}  // namespace
}  // namespace veneer::daemon
