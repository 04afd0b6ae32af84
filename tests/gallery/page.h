// What a gallery that was made consists of, as a page for people and as JSON for programs.
#pragma once

#include <filesystem>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/gallery/plan_runs.h"
#include "tests/gallery/studies.h"

namespace veneer::gallery {

struct ShownView {
  std::string caption;
  // Files below the gallery's folder, with slashes; empty when the view failed.
  std::string picture, full;
  cv::Size size;                       // of `picture`
  std::optional<PlanFigures> figures;  // of a view of a plan
  std::string command;                 // that made it
  std::string error;                   // why there is no picture
};

struct ShownStudy {
  const Study* study = nullptr;
  std::vector<ShownView> views;
};

struct ShownPaper {
  const Paper* paper = nullptr;
  std::vector<ShownStudy> studies;
};

struct Gallery {
  std::string title, lead;
  std::string made_of;  // a sentence: whose pictures and wood
  double seconds = 0;   // of the whole run
  std::vector<ShownPaper> papers;
};

std::size_t failures(const Gallery& gallery);

// index.html; it needs page.css beside it.
Status write_page(const Gallery& gallery, const std::filesystem::path& file);
Status write_report(const Gallery& gallery, const std::filesystem::path& file);

}  // namespace veneer::gallery
