// What is burnt on the laser alone asks all that can be known before it homes: this cell is Stopped, and its laser's
// file still empty.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

struct Order {
  const char* name;
  const char* target;
  json body;
};

const Order kOrders[] = {
    {"TestPattern", "/api/v1/laser/test-pattern", {{"size_mm", 20}}},
    {"TestCard", "/api/v1/laser/test-card", {{"powers", {0.5}}, {"speeds_mm_s", {20}}, {"side_mm", 5}}},
    {"Drawing",
     "/api/v1/laser/run",
     {{"points_mm", {10, 10, 40, 10}}, {"strokes", {2}}, {"speeds_mm_s", {20}}, {"powers", {0.5}}}},
};

class BurntAlone : public testing::RoutedCell, public ::testing::WithParamInterface<Order> {
 protected:
  // No camera knows this panel by its face: a person has to say that what lies on the bed is scrap.
  void put_unmarked_panel_in_stock() {
    cell->database->call([](Repositories& r) {
      db::PanelRecord panel;
      panel.id = panel.root = PanelId{"P-0001"};
      panel.name = panel.id.value, panel.width = 420_mm, panel.height = 280_mm;
      panel.created_at = "2026-05-01T07:30:00.000Z";
      EXPECT_TRUE(r.panels.add(panel, {}, {}).ok());
      return 0;
    });
  }
  ApiReply burn(const json& more = json::object()) {
    json body = GetParam().body;
    body.update(more);
    return ask("POST", GetParam().target, body);
  }
  void expect_nothing_moved() {
    EXPECT_EQ(cell->runner->view().state, CellState::kStopped);
    EXPECT_FALSE(cell->runner->is_connected());
    std::error_code none;
    const auto bytes = std::filesystem::file_size(directory / "wire.bin", none);
    EXPECT_TRUE(none || bytes == 0) << bytes;
  }
};

TEST_P(BurntAlone, HomesNothingWhereStockMayLieOnTheBed) {
  put_unmarked_panel_in_stock();
  const TaskView task = ended(burn());
  ASSERT_EQ(task.state, TaskState::kFailed);
  EXPECT_THAT(task.error->message, HasSubstr("--confirm \"scrap on the bed\""));
  expect_nothing_moved();
}

TEST_P(BurntAlone, HomesOnceAPersonHasSaidThatItIsScrap) {
  put_unmarked_panel_in_stock();
  const ApiReply begun = burn({{"confirmed", {"scrap on the bed"}}});
  ASSERT_EQ(begun.status, 202) << begun.body;
  while (cell->runner->view().state == CellState::kStopped && !cell->tasks.running().empty()) {
    reactor.restart();
    reactor.run_one_for(std::chrono::seconds(10));
  }
  EXPECT_EQ(cell->runner->view().state, CellState::kResetting);
}

// As while the camera looks, which takes up to a minute.
TEST_P(BurntAlone, HomesNothingOnceCancelled) {
  const ApiReply begun = burn();
  ASSERT_EQ(begun.status, 202) << begun.body;
  const std::string task = std::to_string(body_of(begun).value("task", std::int64_t{0}));
  ASSERT_EQ(ask("DELETE", "/api/v1/tasks/" + task).status, 200);
  EXPECT_EQ(ended(begun).state, TaskState::kCancelled);
  expect_nothing_moved();
}

// After an abort a person looks first: neither a pattern nor a dry one clears the cell by itself.
TEST_P(BurntAlone, NothingIsHomedOutOfAnAbort) {
  cell->runner->abort("STOP");
  while (cell->runner->view().state != CellState::kAborted) {
    reactor.restart();
    reactor.run_one_for(std::chrono::seconds(10));
  }
  for (const bool dry : {false, true}) {
    const ApiReply refused = burn({{"dry", dry}, {"confirmed", {"scrap on the bed"}}});
    EXPECT_EQ(refused.status, 409) << refused.body;
    EXPECT_THAT(refused.body, HasSubstr("Clear it first"));
  }
  EXPECT_EQ(cell->runner->view().state, CellState::kAborted);
}

// With the beam off nothing is asked of the bed.
TEST_P(BurntAlone, ADryRunHomesAtOnce) {
  put_unmarked_panel_in_stock();
  ASSERT_EQ(burn({{"dry", true}}).status, 202);
  reactor.restart(), reactor.poll();
  EXPECT_EQ(cell->runner->view().state, CellState::kResetting);
}

INSTANTIATE_TEST_SUITE_P(Each, BurntAlone, ::testing::ValuesIn(kOrders),
                         [](const auto& order) { return std::string(order.param.name); });

}  // namespace
}  // namespace veneer::daemon
