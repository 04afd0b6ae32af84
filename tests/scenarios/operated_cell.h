// A prepared cell with what an operator does at it between Start and the last piece.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "tests/demo/figures.h"
#include "tests/scenarios/prepared_cell.h"

namespace veneer::tests {

class OperatedCell : public PreparedCell {
 protected:
  void lay() {
    auto laid = cell_->twin({{"cmd", "place"}, {"sheet", "control"}, {"on", "bed"}, {"face", "back"}});
    ASSERT_TRUE(laid.ok()) << laid.error().message;
  }
  void lift() { ASSERT_TRUE(cell_->twin({{"cmd", "lift"}, {"from", "bed"}}).ok()); }
  void lid(bool open) { ASSERT_TRUE(cell_->twin({{"cmd", "lid"}, {"open", open}}).ok()); }
  nlohmann::json wait(const std::function<bool(const nlohmann::json&)>& good) {
    auto status = cell_->wait_status(good, std::chrono::seconds(90));
    EXPECT_TRUE(status.ok()) << status.error().message;
    return status ? *status : nlohmann::json();
  }
  nlohmann::json wait_state(const std::string& state) {
    return wait([&](const nlohmann::json& s) { return s["state"] == state; });
  }
  // The look that a run owes which was broken off has proven what it had cut: hands may lift the panel.
  void wait_proven() {
    wait([this](const nlohmann::json&) {
      const nlohmann::json audit = get("/audit?limit=100");  // newest first
      for (const auto& row : audit["entries"])
        if (const auto what = row["what"].get<std::string>(); what.starts_with("run.")) return what == "run.proven";
      return false;
    });
  }
  void wait_found() {
    wait([](const nlohmann::json& s) { return s["load"].is_object() && s["load"].value("found", false); });
  }
  std::string post(const std::string& target, const nlohmann::json& body = nlohmann::json::object()) {
    auto reply = cell_->api().post(target, body);
    return reply ? "" : reply.error().message;
  }
  // Reset, Start, and the panel found on the bed.
  void begin() {
    ASSERT_EQ(post("/commands/reset"), "");
    ASSERT_EQ(post(fmt::format("/jobs/{}/start", kJob)), "");
    lay();
    wait_found();
  }
  // Until three of sixteen pieces are cut and the fourth burns: the machine tells, so that nobody asks too late.
  void cut_some() {
    constexpr double kThreePiecesAndSome = 240;  // mm, their marks too
    begin();
    unsuspend_and_hear_of(kThreePiecesAndSome);
  }
  // What the beam has done to the panel: {"through_mm", "engraved_mm"}.
  nlohmann::json burnt() {
    auto log = cell_->twin({{"cmd", "burn-log"}});
    if (log)
      for (const auto& sheet : (*log)["sheets"])
        if (sheet["sheet"] == "control")
          return {{"through_mm", sheet["through_mm"]}, {"engraved_mm", sheet["engraved_mm"]}};
    return {{"through_mm", 0.0}, {"engraved_mm", 0.0}};
  }
  // What the twin's truth says of it all; scans the panel again first.
  std::vector<std::string> red() {
    if (const Status compared = story_->reconcile(kJob); !compared) ADD_FAILURE() << compared.error().message;
    if (const Status proven = story_->prove(bin_dir()); !proven) ADD_FAILURE() << proven.error().message;
    auto figures = red_figures(story_->report());
    // Counted by the demo's own way of loading only.
    std::erase_if(figures, [](const std::string& f) { return f.find("motion_without_consent") != std::string::npos; });
    return figures;
  }
};

}  // namespace veneer::tests
