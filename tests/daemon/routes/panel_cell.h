// A cell with two panels of 30 x 20 mm in stock, all of them wood; a second scan of the first one saw 100 mm2 of it.
#pragma once

#include <fmt/format.h>

#include <opencv2/core/mat.hpp>
#include <stdexcept>
#include <vector>

#include "tests/support/panel_shapes.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {

class PanelCell : public testing::RoutedCell {
 protected:
  static constexpr const char* kThen = "2026-05-01T07:30:00.000Z";
  static constexpr int kColumns = 360, kRows = 240;
  static constexpr SquareMillimetres kWhole{kColumns * kRows / (kMapResolution.px_per_mm * kMapResolution.px_per_mm)};

  PanelCell() {
    for (const char* id : {"P-0001", "P-0002"}) {
      db::PanelRecord panel;
      panel.id = {id}, panel.name = id, panel.width = 30_mm, panel.height = 20_mm, panel.created_at = kThen;
      const auto picture =
          cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(255)), "panels", "all");
      const auto map =
          cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC3, cv::Scalar::all(255)), "panels", "map");
      if (!picture || !map) throw std::runtime_error("the panel's pictures are not stored");
      panel.map_file = map->file, panel.mask_file = picture->file, panel.map_hash = map->sha256;
      panel.usable = kWhole;
      change([&](Repositories& r) { return r.panels.add(panel, {}, {}); });
    }
    // A second scan of the first one sees half of its wood only.
    const auto map = cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC3, cv::Scalar::all(254)),
                                                       "panels", "second-map");
    const auto less =
        cell->panel_library.store_picture(cv::Mat(kRows, kColumns, CV_8UC1, cv::Scalar(0)), "panels", "less");
    if (!less || !map) throw std::runtime_error("the second scan's pictures are not stored");
    change([&](Repositories& r) -> Status {
      const auto version =
          r.panels.add_mask({"P-0001"}, {0, map->file, less->file, map->sha256, kThen, SquareMillimetres(100)}, 1);
      return version ? Ok() : Status(version.error());
    });
  }

  // A plan of squares A1, A2, ... of panel P-0002, with their left sides there, all as high.
  static db::NewPlan squares(double side_mm, const std::vector<double>& left_mm, double top_mm) {
    db::NewPlan plan;
    plan.name = "portrait", plan.who = "local:1000", plan.plan_json = "{}", plan.options_json = "{}";
    for (const double x : left_mm) {
      db::PlannedPatch& patch = plan.pieces.emplace_back();
      patch.mark = fmt::format("A{}", plan.pieces.size());
      for (const auto& p : testing::panel_square(0, 0, side_mm))
        patch.artwork_outline.push_back(point<ArtworkFrame>(p.x.count(), p.y.count()));
      patch.panel = PanelId{"P-0002"};
      patch.panel_outline = testing::panel_square(x, top_mm, side_mm);
      patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
      patch.panel_from_artwork = Isometry2<PanelFrame, ArtworkFrame>(Radians(0), point<PanelFrame>(x, top_mm));
    }
    plan.planned_on = {{PanelId{"P-0002"}, 1}};
    return plan;
  }

  // A zone of a panel 20 mm high.
  static Ring<PanelFrame> strip(double left_mm, double right_mm) {
    return {point<PanelFrame>(left_mm, 0), point<PanelFrame>(right_mm, 0), point<PanelFrame>(right_mm, 21),
            point<PanelFrame>(left_mm, 21)};
  }
  template <class F>
  void change(F work) {
    const Status done = cell->database->call([&](Repositories& r) -> Status { return work(r); });
    if (!done) throw std::runtime_error(done.error().message);
  }
  nlohmann::json get(const std::string& path) { return body_of(ask("GET", "/api/v1" + path)); }
  // The cell books what it finds at its start, behind all else: a test of what is booked begins after that.
  void until_what_is_left_is_booked(const std::string& panel) {
    for (nlohmann::json it = get("/panels/" + panel); it["remnant"]["booked"].is_null(); it = get("/panels/" + panel))
      if (!it["remnant"].is_object()) throw std::runtime_error("nothing is known of what is left: " + it.dump());
  }
  ApiReply post(const std::string& path, const nlohmann::json& body = nlohmann::json::object()) {
    return ask("POST", "/api/v1" + path, body);
  }
};

}  // namespace veneer::daemon
