// The bed as a test lays it, for tests of the unit: what the camera sees, and strokes without a planner.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/unit/bed_view.h"
#include "daemon/unit/run_planner.h"

namespace veneer::tests {

// The bed as a test lays it: one panel or none, any way up.
class LaidBed final : public daemon::BedView, public daemon::RunPlanner {
 public:
  explicit LaidBed(boost::asio::io_context& io) : io_(io) {}
  void look(std::function<void(Result<daemon::ProvenPose>)> reply) override {
    ++looks;
    cuts_at_look = cuts;
    Result<daemon::ProvenPose> now = seen;
    if (!before.empty()) now = std::move(before.front()), before.pop_front();
    boost::asio::post(io_, [now = std::move(now), reply = std::move(reply)] { reply(now); });
  }
  void hands_were_in() override { ++hands; }
  void was_cut() override { ++cuts; }
  void stock_in_sight(std::function<void(Result<daemon::StockSight>)> reply) override {
    ++looks;
    boost::asio::post(io_, [stock = stock, reply = std::move(reply)] { reply(stock); });
  }
  // One set-up for each panel, or as a test says.
  void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame>,
                   std::function<void(Result<std::vector<daemon::RunSetup>>)> reply) override {
    std::vector<daemon::RunSetup> out = setups;
    for (const auto& piece : pieces) {
      if (!setups.empty()) break;
      if (out.empty() || out.back().panel != *piece.panel) out.push_back({*piece.panel, {}, {}, 1, 1, {}});
      out.back().pieces.push_back(piece.id);
    }
    boost::asio::post(io_, [out = std::move(out), reply = std::move(reply)] { reply(out); });
  }
  void prepare(const daemon::ProvenPose&, std::vector<db::PieceRecord> pieces,
               const std::optional<LaserMotion>& machine,
               std::function<void(Result<daemon::PreparedRun>)> reply) override {
    told = machine;
    if (on_prepare) on_prepare();
    std::vector<daemon::PieceBurn> burns;
    for (const auto& piece : pieces) {
      Stroke mark;
      mark.piece = piece.id;
      mark.role = StrokeRole::kEngrave;
      mark.path = {point<MachineFrame>(12, 12), point<MachineFrame>(14, 12)};
      mark.speed = speed;
      mark.power = PowerFraction(0.2);
      Stroke cut = mark;
      cut.role = StrokeRole::kCut;
      cut.path = {point<MachineFrame>(10, 10), point<MachineFrame>(reach_x, 10), point<MachineFrame>(15, 20)};
      burns.push_back({piece.id, piece.mark, LaserJob{{mark, cut}}, 1});
    }
    boost::asio::post(io_, [burns = std::move(burns), reply = std::move(reply)] {
      reply(daemon::PreparedRun{
          burns, {{}, {CertificateId{1}, CertificateId{2}, CertificateId{3}}, R"([{"material": null}])"}});
    });
  }
  void lay(const std::string& panel, bool back_up = true, double x_mm = 300, double y_mm = 40) {
    seen = daemon::ProvenPose{PanelId{panel}, back_up,
                              Isometry2<BedFrame, PanelFrame>(Radians(0), point<BedFrame>(x_mm, y_mm),
                                                              back_up ? Handedness::kImproper : Handedness::kProper),
                              Millimetres(0.02)};
  }
  std::optional<LaserMotion> told;                // of the machine, last
  MmPerSecond speed{80};                          // of all strokes
  double reach_x = 20;                            // how far to the right each cut goes
  std::vector<daemon::RunSetup> setups;           // empty: one for each panel
  std::deque<Result<daemon::ProvenPose>> before;  // what is seen first
  Result<daemon::ProvenPose> seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  Result<daemon::StockSight> stock = daemon::StockSight{};  // of it, on the bed
  std::function<void()> on_prepare;
  int looks = 0;
  int hands = 0;         // how often they were said to have been in
  int cuts = 0;          // how often something was said to have been cut
  int cuts_at_look = 0;  // when the camera was asked last

 private:
  boost::asio::io_context& io_;
};

}  // namespace veneer::tests
