#include "tests/demo/story.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <utility>

#include "base/files.h"
#include "cli/api_client.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Seconds = std::chrono::duration<double>;

double now_s() { return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// The simulated glass; panels larger than this are scanned in two tiles.
constexpr double kGlassWidth = 320, kGlassHeight = 300;

constexpr int kGridScans = 3;  // at different places: they cover the whole glass and average the noise

constexpr double kGridThickness = 0;  // of the AprilGrid sheet: it is a film
// Nearly as wide as the bed, and no higher than the glass, so that its kerf lines can be scanned.
constexpr double kBoardWidth = 490, kBoardHeight = 290;

Result<std::string> read_file(const fs::path& file) {
  if (auto bytes = read_whole(file)) return *std::move(bytes);
  return Error{ErrorCode::kNotFound, fmt::format("cannot read the picture {}: check the path", file.string())};
}

Status write_file(const fs::path& file, const std::string& bytes) {
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  if (out.flush()) return Ok();
  return Error{ErrorCode::kStorage, fmt::format("cannot write {}", file.string())};
}

Status as_status(const Result<json>& result) { return result ? Ok() : Status(result.error()); }

}  // namespace

Story::Story(SimulatedCell& cell, fs::path out, Narrator& narrator)
    : cell_(cell), out_(std::move(out)), narrator_(narrator) {}

void Story::resume(const std::map<std::string, StoryPanel>& panels, const std::vector<std::int64_t>& jobs) {
  for (const auto& [id, panel] : panels) {
    stock_.push_back(panel);
    sheet_of_panel_[id] = panel.sheet;
  }
  jobs_ = jobs;
}

Status Story::tell(const std::string& stage, const std::function<Result<std::string>()>& work) {
  stage_ = stage;
  const double began = now_s();
  auto text = work();
  if (!text) return text.error();
  narrator_.done(stage, *text, now_s() - began);
  return Ok();
}

Result<json> Story::task(const std::string& stage, const std::string& target, const json& body) {
  return cell_.api().post_and_wait(target, body, [&](const json& task) {
    narrator_.progress(stage, task.value("progress", 0.0), task.value("text", ""));
    return true;
  });
}

Status Story::place(const std::string& sheet, const std::string& on, const std::string& face, const std::string& part,
                    double height_mm) {
  return as_status(cell_.twin(
      {{"cmd", "place"}, {"sheet", sheet}, {"on", on}, {"face", face}, {"part", part}, {"height_mm", height_mm}}));
}

// ---- Calibration -------------------------------------------------------------------------------------------------

Status Story::calibrate() {
  if (auto made = cell_.twin({{"cmd", "new-grid"}, {"name", "grid"}}); !made) return made.error();
  Status told = tell("calibrate scanner", [&]() -> Result<std::string> {
    Result<json> last = json();
    for (int view = 1; view <= kGridScans; ++view) {
      if (const Status placed = place("grid", "scanner", "show"); !placed) return placed.error();
      last = task("calibrate scanner", "/calibration/scanner", {{"more", view < kGridScans}});
      if (!last) return last.error();
    }
    report_["calibration"]["scanner"] = last->value("rms_mm", 0.0);
    return fmt::format("{} scans of the AprilGrid sheet, {:.4f} mm rms", kGridScans, last->value("rms_mm", 0.0));
  });
  if (!told) return told;
  told = tell("calibrate camera", [&] { return calibrate_camera(); });
  if (!told) return told;
  return tell("calibrate laser", [&] { return calibrate_laser(); });
}

Result<std::string> Story::calibrate_camera() {
  constexpr int kViews = 6;
  Result<json> last = json();
  for (int view = 0; view < kViews; ++view) {
    const double block = view % 2 == 0 ? 0 : 12;  // on the bed, and on spacer blocks
    if (const Status placed = place("grid", "bed", "show", "whole", block); !placed) return placed.error();
    last = task("calibrate camera", "/calibration/camera",
                {{"more", view + 1 < kViews}, {"height_mm", block + kGridThickness}});
    if (!last) return last.error();
  }
  if (auto lifted = cell_.twin({{"cmd", "lift"}, {"from", "bed"}}); !lifted) return lifted.error();
  report_["calibration"]["camera"] = last->value("rms_mm", 0.0);
  return fmt::format("{} views at two heights, {:.4f} mm rms", kViews, last->value("rms_mm", 0.0));
}

Result<std::string> Story::calibrate_laser() {
  if (auto made =
          cell_.twin({{"cmd", "new-board"}, {"name", "board"}, {"width_mm", kBoardWidth}, {"height_mm", kBoardHeight}});
      !made)
    return made.error();
  // Boards of one kind differ by some hundredths of a millimetre: an operator holds a caliper to this one.
  auto caliper = cell_.twin({{"cmd", "measure"}, {"sheet", "board"}});
  if (!caliper) return caliper.error();
  const double thickness = caliper->value("thickness_mm", 0.0);
  if (thickness <= 0) return Error{ErrorCode::kInternal, "the twin's caliper says nothing of the board's thickness"};
  if (const Status placed = place("board", "bed", "show"); !placed) return placed.error();
  if (auto homed = cell_.api().post("/commands/reset"); !homed) return homed.error();
  auto axes = task("calibrate laser", "/calibration/laser",
                   {{"height_mm", thickness},
                    {"board_width_mm", kBoardWidth},
                    {"board_height_mm", kBoardHeight},
                    {"confirmed", {"board on the bed"}}});
  if (!axes) return axes.error();
  if (const Status placed = place("board", "scanner", "show", "left"); !placed) return placed.error();
  auto kerf = task("calibrate laser", "/calibration/kerf", json::object());
  if (!kerf) return kerf.error();
  if (auto lifted = cell_.twin({{"cmd", "lift"}, {"from", "scanner"}}); !lifted) return lifted.error();
  report_["calibration"]["axes"] = axes->value("rms_mm", 0.0);
  const double width = (*kerf)["figures"].value("kerf_mm", 0.0);
  report_["calibration"]["kerf_mm"] = width;
  return fmt::format("burnt rings fitted to {:.4f} mm rms, board bowed by {:.2f} and {:.2f} mm, kerf {:.3f} mm",
                     axes->value("rms_mm", 0.0), (*axes)["figures"].value("bow_x_mm", 0.0),
                     (*axes)["figures"].value("bow_y_mm", 0.0), width);
}

// ---- Scanning ----------------------------------------------------------------------------------------------------

Result<json> Story::scan_face(const StoryPanel& panel, const std::string& face, const std::string& panel_id) {
  const bool two_tiles = panel.width_mm > kGlassWidth || panel.height_mm > kGlassHeight;
  const std::vector<std::string> parts =
      two_tiles ? std::vector<std::string>{"left", "right"} : std::vector<std::string>{"whole"};
  Result<json> last = json();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (const Status placed = place(panel.sheet, "scanner", face, parts[i]); !placed) return placed.error();
    json body = {{"face", face}, {"more", i + 1 < parts.size()}};
    if (!panel_id.empty()) body["panel"] = panel_id;
    last = task(stage_, "/scans", body);
    if (!last) return last;
  }
  if (auto lifted = cell_.twin({{"cmd", "lift"}, {"from", "scanner"}}); !lifted) return lifted.error();
  return last->contains("proposal") ? accept(*last) : last;
}

// As an operator would who looks at the picture: wood that is in doubt is left out, and the rest is taken. Any other
// warning of a sound sheet is a fault.
Result<json> Story::accept(const json& seen) {
  const std::string number = std::to_string(seen["proposal"].get<std::int64_t>());
  if (const Status saved =
          save_picture("/proposals/" + number + "/picture.png?width=1600", "proposal-" + number + ".png");
      !saved)
    return saved.error();
  json overruled = json::array();
  for (const json& warning : seen["warnings"]) {
    const std::string name = warning["name"];
    if (!name.starts_with("strip-") || name.starts_with("strip-missing"))
      return Error{ErrorCode::kRefused, fmt::format("the scan of proposal {} has the warning {}: {}", number, name,
                                                    warning["text"].get<std::string>())};
    overruled.push_back(name);
  }
  return task(stage_, "/proposals/" + number + "/accept", {{"override", overruled}});
}

Status Story::scan_panel(const StoryPanel& panel) {
  return tell("scan " + panel.sheet, [&]() -> Result<std::string> {
    if (auto made = cell_.twin({{"cmd", "new-panel"},
                                {"name", panel.sheet},
                                {"width_mm", panel.width_mm},
                                {"height_mm", panel.height_mm}});
        !made)
      return made.error();
    auto show = scan_face(panel, "show", "");
    if (!show) return show.error();
    const std::string id = (*show)["panel"];
    auto back = scan_face(panel, "back", id);
    if (!back) return back.error();
    stock_.push_back(panel);
    sheet_of_panel_[id] = panel.sheet;
    const json tiles = (*show)["registration"]["rms_mm"], faces = (*back)["registration"]["rms_mm"];
    return fmt::format(
        "panel {}: {} tile(s){}, faces tied to {:.3f} mm, {:.0f} cm2 of usable wood in {} strips", id,
        show->value("tiles", 0), tiles.is_number() ? fmt::format(" agree to {:.3f} mm", tiles.get<double>()) : "",
        faces.is_number() ? faces.get<double>() : 0.0, show->value("usable_mm2", 0.0) / 100, show->value("zones", 0));
  });
}

// ---- Jobs --------------------------------------------------------------------------------------------------------

Status Story::plan(const StoryJob& job) {
  return tell("plan " + job.name, [&]() -> Result<std::string> {
    auto picture = read_file(job.picture);
    if (!picture) return picture.error();
    const double began = now_s();
    std::string target =
        fmt::format("/jobs?name={}&size_mm={}&patch_mm={}", cli::url_encode(job.name), job.size_mm, job.patch_mm);
    for (const auto& [name, value] : job.options) target += fmt::format("&{}={}", name, cli::url_encode(value));
    auto started = cell_.api().request("POST", target, *picture, "application/octet-stream");
    if (!started) return started.error();
    auto planned = cell_.api().wait_task((*started)["task"], [&](const json& task) {
      narrator_.progress(stage_, task.value("progress", 0.0), task.value("text", ""));
      return true;
    });
    if (!planned) return planned.error();
    const std::int64_t id = (*planned)["job"];
    jobs_.push_back(id);
    job_seconds_[id] += now_s() - began;
    for (const auto& [panel, sheet] : sheet_of_panel_)
      if (const Status saved = save_picture("/panels/" + panel + "/stock.png?width=1600",
                                            fmt::format("stock-{}-reserved-{}.png", panel, id));
          !saved)
        return saved.error();
    std::string from;
    for (const auto& p : (*planned)["panels"])
      from += fmt::format("{}{} from {}", from.empty() ? "" : ", ", p.value("pieces", 0), p.value("panel", ""));
    return fmt::format("job {}: {} pieces ({}), reserved", id, planned->value("pieces", 0), from);
  });
}

Status Story::clear_bed() {
  auto sheets = cell_.twin({{"cmd", "status"}});
  if (!sheets) return sheets.error();
  for (const auto& sheet : (*sheets)["sheets"])
    if (sheet["where"] == "bed") return as_status(cell_.twin({{"cmd", "lift"}, {"from", "bed"}}));
  return Ok();
}

Status Story::load_panel(const std::string& panel_id) {
  const auto sheet = sheet_of_panel_.find(panel_id);
  if (sheet == sheet_of_panel_.end())
    return Error{ErrorCode::kInternal, fmt::format("the cell asks for panel {}, which nobody scanned", panel_id)};
  auto before = cell_.twin({{"cmd", "burn-log"}});
  if (!before) return before.error();
  const auto rest = cell_.api().get("/status");
  if (!rest) return rest.error();
  if (Status placed = place(sheet->second, "bed", "back"); !placed) return placed;
  auto found = cell_.wait_status(
      [](const json& s) {
        return s["state"] != "Suspended" || (s["load"].is_object() && s["load"].value("found", false));
      },
      std::chrono::seconds(60));
  if (!found) return found.error();
  if ((*found)["state"] != "Suspended")
    return Error{ErrorCode::kDeviceFault,
                 fmt::format("the cell went {}: {}", found->value("state", ""), found->value("reason", ""))};
  // Hands were in the machine until now: neither head nor beam may have stirred.
  auto after = cell_.twin({{"cmd", "burn-log"}});
  if (!after) return after.error();
  if (*before != *after || (*rest)["laser"]["position_mm"] != (*found)["laser"]["position_mm"])
    report_["motion_without_consent"] = report_.value("motion_without_consent", 0) + 1;
  if (auto picture = cell_.api().get_bytes("/bed.jpg"))
    if (Status saved = write_file(out_ / fmt::format("bed-{}-{}.jpg", jobs_.back(), panel_id), *picture); !saved)
      return saved;
  if (before_unsuspend)
    if (Status ready = before_unsuspend(); !ready) return ready;
  return as_status(cell_.api().post("/commands/unsuspend"));
}

Status Story::cut(std::int64_t job) {
  report_["motion_without_consent"] = report_.value("motion_without_consent", 0);
  const double began = now_s();
  const Status told = tell(fmt::format("cut job {}", job), [&]() -> Result<std::string> {
    auto status = cell_.api().get("/status");
    if (!status) return status.error();
    if ((*status)["state"] != "Idle")
      if (auto homed = cell_.api().post("/commands/reset"); !homed) return homed.error();
    if (auto started = cell_.api().post(fmt::format("/jobs/{}/start", job)); !started) return started.error();
    for (;;) {
      status = cell_.wait_status(
          [&](const json& s) {
            if (s["job"].is_object() && s["job"].value("pieces", 0) > 0)
              narrator_.progress(stage_, s["job"].value("cut", 0) / s["job"].value("pieces", 1.0),
                                 fmt::format("{} of {} pieces", s["job"].value("cut", 0), s["job"].value("pieces", 0)));
            return s["state"] == "Suspended" || s["state"] == "Complete" || s["state"] == "Aborted" ||
                   s["state"] == "Stopped";
          },
          std::chrono::seconds(900));
      if (!status) return status.error();
      // What lies on the bed has been cut, or was left there by somebody: hands take it off.
      if (const Status cleared = clear_bed(); !cleared) return cleared.error();
      if ((*status)["state"] != "Suspended") break;
      if (const Status loaded = load_panel((*status)["load"]["panel"]); !loaded) return loaded.error();
    }
    const json& state = (*status)["job"];
    if ((*status)["state"] != "Complete")
      return Error{ErrorCode::kDeviceFault,
                   fmt::format("job {} ended {}: {}", job, status->value("state", ""), status->value("reason", ""))};
    return fmt::format("{} pieces engraved, cut and booked", state.value("cut", 0));
  });
  job_seconds_[job] += now_s() - began;
  return told;
}

Status Story::reconcile(std::int64_t job) {
  return tell(fmt::format("reconcile job {}", job), [&]() -> Result<std::string> {
    auto record = cell_.api().get(fmt::format("/jobs/{}", job));
    if (!record) return record.error();
    int differences = 0, panels = 0;
    for (const auto& used : (*record)["panels"]) {
      const std::string id = used["panel"];
      for (const auto& panel : stock_) {
        if (panel.sheet != sheet_of_panel_[id]) continue;
        auto again = scan_face(panel, "show", id);
        if (!again) return again.error();
        for (const auto& difference : (*again)["differences"]) {
          differences_.push_back(difference);
          differences_.back()["panel"] = id;
          differences_.back()["after_job"] = job;
          ++differences;
        }
        ++panels;
      }
    }
    reconciled_ = true;
    return fmt::format("{} panel(s) scanned again, {} difference(s) between wood and ledger", panels, differences);
  });
}

// ---- The proof ---------------------------------------------------------------------------------------------------

Result<json> Story::claims() {
  json out = {{"panels", json::array()}, {"poses", json::array()}, {"jobs", json::array()}, {"ledger", json::array()}};
  for (const auto& [id, sheet] : sheet_of_panel_) {
    auto panel = cell_.api().get("/panels/" + id);
    if (!panel) return panel.error();
    auto registration = cell_.api().get("/panels/" + id + "/registration");
    if (!registration) return registration.error();
    auto ledger = cell_.api().get_all("/panels/" + id + "/ledger", "allocations");
    if (!ledger) return ledger.error();
    json claim = {{"id", id},
                  {"tags", json::array()},
                  {"fiducials", json::array()},
                  {"registration", json::array()},
                  {"width_mm", (*panel)["width_mm"]},
                  {"height_mm", (*panel)["height_mm"]}};
    for (const auto& f : (*panel)["fiducials"]) {
      if (f["kind"] == "tag") claim["tags"].push_back(f["tag_id"]);
      claim["fiducials"].push_back({{"kind", f["kind"]},
                                    {"tag_id", f["tag_id"]},
                                    {"face", f["face"]},
                                    {"x_mm", f["centre_mm"][0]},
                                    {"y_mm", f["centre_mm"][1]}});
    }
    for (const auto& scan : (*registration)["scans"]) {
      const std::string device = scan["device"];
      claim["registration"].push_back(
          {{"capture", device.substr(device.find(':') + 1)}, {"face", scan["face"]}, {"lattice", scan["lattice"]}});
    }
    out["panels"].push_back(std::move(claim));
    for (const auto& a : (*ledger)["allocations"])
      out["ledger"].push_back({{"panel", id},
                               {"mark", a["mark"]},
                               {"job", a["job"]},
                               {"state", a["state"]},
                               {"outline_mm", a["outline_mm"]},
                               {"allocation_mm", a["allocation_mm"]}});
  }
  std::map<std::string, int> loads;  // how often each panel has been loaded
  for (const std::int64_t job : jobs_) {
    auto record = cell_.api().get(fmt::format("/jobs/{}", job));
    if (!record) return record.error();
    auto pieces = cell_.api().get_all(fmt::format("/jobs/{}/pieces", job), "pieces");
    if (!pieces) return pieces.error();
    auto preview = cell_.api().get_bytes(fmt::format("/jobs/{}/preview.png", job));
    if (!preview) return preview.error();
    const fs::path file = out_ / fmt::format("preview-{}.png", job);
    if (const Status saved = write_file(file, *preview); !saved) return saved.error();
    for (const auto& run : (*record)["runs"])
      out["poses"].push_back(
          {{"panel", run["panel"]}, {"sheet_load", loads[run["panel"]]++}, {"bed_from_panel", run["bed_from_panel"]}});
    json claim = {{"job", job},
                  {"preview_file", fs::absolute(file).string()},
                  {"preview_px_per_mm", record->value("/options/preview_dpi"_json_pointer, 0.0) / 25.4},
                  {"width_mm", (*record)["width_mm"]},
                  {"height_mm", (*record)["height_mm"]},
                  {"pieces", (*pieces)["pieces"]}};
    out["jobs"].push_back(std::move(claim));
  }
  return out;
}

Status Story::prove(const fs::path& bin_dir) {
  return tell("proof", [&]() -> Result<std::string> {
    auto claimed = claims();
    if (!claimed) return claimed.error();
    const fs::path file = out_ / "claims.json";
    if (const Status saved = write_file(file, claimed->dump()); !saved) return saved.error();
    const Finished finished =
        run_program({(bin_dir / "veneer-proof").string(), "--twin-state", cell_.twin_dir().string(), "--claims",
                     file.string(), "--out", out_.string()});
    if (finished.status != 0)
      return Error{ErrorCode::kInternal, fmt::format("the proof could not be made: {}", finished.output)};
    auto text = read_file(out_ / "proof.json");
    if (!text) return text.error();
    const json proof = json::parse(*text, nullptr, false);
    if (!proof.is_object()) return Error{ErrorCode::kInternal, "proof.json is not JSON"};
    report_["schema_version"] = 1;
    report_["registration"] = proof.value("registration", json());
    report_["pose"] = proof.value("pose", json());
    report_["jobs"] = proof.value("jobs", json());
    for (const char* count : {"unclaimed_cuts", "unattributed_scans", "wood_used_twice"})
      report_[count] = proof.value(count, json());
    for (std::size_t i = 0; i < jobs_.size() && report_["jobs"].is_array() && i < report_["jobs"].size(); ++i)
      report_["jobs"][i]["seconds"] = job_seconds_[jobs_[i]];
    report_["reconcile"]["differences"] = reconciled_ ? json(differences_.size()) : json();
    report_["reconcile"]["places"] = differences_;
    report_["remnant_area_mm2"] = json::array();
    for (const auto& [id, sheet] : sheet_of_panel_) {
      auto panel = cell_.api().get("/panels/" + id);
      report_["remnant_area_mm2"].push_back(
          panel ? json(std::max(0.0, (*panel)["usable_mm2"].get<double>() - (*panel)["reserved_mm2"].get<double>()))
                : json());
    }
    return std::string("what was really cut is judged by the twin's own truth");
  });
}

Status Story::save_picture(const std::string& target, const std::string& file) {
  auto bytes = cell_.api().get_bytes(target);
  if (!bytes) return bytes.error();
  return write_file(out_ / file, *bytes);
}

Status Story::save_pictures() {
  for (const auto& [id, sheet] : sheet_of_panel_) {
    if (Status saved = save_picture("/panels/" + id + "/map.png?width=1600", "map-" + id + ".png"); !saved)
      return saved;
    if (Status saved = save_picture("/panels/" + id + "/stock.png?width=1600", "stock-" + id + ".png"); !saved)
      return saved;
  }
  return Ok();
}

}  // namespace veneer::tests
