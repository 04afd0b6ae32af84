// The story of the demo, step by step: what an operator does at the scanner, at the bed and at veneerctl, done through
// the daemon's API and the twin's socket. The negative controls and the scenario tests tell parts of the same story.
//
// Every step is a Status: the first that fails ends the story with the daemon's own sentence.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "tests/support/simulated_cell.h"

namespace veneer::tests {

struct StoryPanel {
  std::string sheet;  // the twin's name for it
  double width_mm = 0, height_mm = 0;
};

struct StoryJob {
  std::filesystem::path picture;
  std::string name;
  double size_mm = 0, patch_mm = 0;
  std::map<std::string, std::string> options = {};  // further ones of POST /jobs
};

// Says what a stage did and how long it took; `progress` while it lasts (0 to 1).
class Narrator {
 public:
  virtual ~Narrator() = default;
  virtual void progress(const std::string& stage, double fraction, const std::string& text) = 0;
  virtual void done(const std::string& stage, const std::string& text, double seconds) = 0;
};

class QuietNarrator final : public Narrator {
 public:
  void progress(const std::string&, double, const std::string&) override {}
  void done(const std::string&, const std::string&, double) override {}
};

class Story {
 public:
  Story(SimulatedCell& cell, std::filesystem::path out, Narrator& narrator);

  // Takes up a story that was begun before: panels in stock by id, and jobs planned.
  void resume(const std::map<std::string, StoryPanel>& panels, const std::vector<std::int64_t>& jobs);

  // Scanner, camera, axes and kerf from pictures alone; certificates are stored.
  Status calibrate();
  Status scan_panel(const StoryPanel& panel);
  // Plans from free stock and reserves; the job's number is appended to jobs().
  Status plan(const StoryJob& job);
  // Cuts the whole job, loading each panel the cell asks for.
  Status cut(std::int64_t job);
  // Scans every panel of the job again and compares with the ledger.
  Status reconcile(std::int64_t job);
  // What the cell claims, for veneer-proof, and the proof itself; fills the report.
  Status prove(const std::filesystem::path& bin_dir);
  // The scans, stock pictures and previews for people.
  Status save_pictures();

  const std::vector<std::int64_t>& jobs() const { return jobs_; }
  const std::map<std::string, std::string>& panels() const { return sheet_of_panel_; }  // panel id -> sheet
  nlohmann::json& report() { return report_; }
  const nlohmann::json& differences() const { return differences_; }  // that reconcile() was told so far
  // Called each time a panel lies on the bed, is found, and the cell waits for Unsuspend.
  std::function<Status()> before_unsuspend;

 private:
  Status tell(const std::string& stage, const std::function<Result<std::string>()>& work);
  Result<nlohmann::json> task(const std::string& stage, const std::string& target, const nlohmann::json& body);
  Status place(const std::string& sheet, const std::string& on, const std::string& face,
               const std::string& part = "whole", double height_mm = 0);
  Result<nlohmann::json> accept(const nlohmann::json& seen);
  Result<nlohmann::json> scan_face(const StoryPanel& panel, const std::string& face, const std::string& panel_id);
  Result<std::string> calibrate_camera();
  Result<std::string> calibrate_laser();
  Status clear_bed();
  Status load_panel(const std::string& panel_id);
  Result<nlohmann::json> claims();
  Status save_picture(const std::string& target, const std::string& file);

  SimulatedCell& cell_;
  std::filesystem::path out_;
  Narrator& narrator_;
  std::string stage_;
  std::vector<StoryPanel> stock_;
  std::map<std::string, std::string> sheet_of_panel_;
  std::vector<std::int64_t> jobs_;
  std::vector<nlohmann::json> loads_;  // poses in the order of loading: {"panel", "sheet_load"}
  std::map<std::int64_t, double> job_seconds_;
  nlohmann::json differences_ = nlohmann::json::array();  // as the cell tells them, and panel and job
  bool reconciled_ = false;
  nlohmann::json report_ = nlohmann::json::object();
};

}  // namespace veneer::tests
