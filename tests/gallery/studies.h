// What the gallery shows: a list of studies in a JSON file (studies.json), read strictly.
//
// A study is a row of views. A view names what it shows and the plan that it shows it of: the picture and the wood by
// their names in the list, and options of `veneerctl plan` by theirs, on top of the list's `defaults`.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::gallery {

// A part of a picture, in shares of its width and height.
using Share = cv::Rect2d;

struct PictureEntry {
  std::string file;      // in the data folder
  Share crop;            // of that file
  Share otherwise_crop;  // of the picture that stands in where there is no data folder
};

struct WoodEntry {
  std::string file, mask;          // in the data folder; no mask: all is wood
  double dpi = 0;                  // of that file, and of wood that is grown
  std::vector<std::string> grown;  // species of the twin, side by side, where there is no data folder
  double width_mm = 0, height_mm = 0;
};

struct PlanOrder {
  std::string picture;
  std::vector<std::string> woods;
  int posterise = 0;                           // tones of the segmentation that is made of the picture; 0: none
  std::map<std::string, std::string> options;  // of `veneerctl plan`, without dashes; a switch is "true"
  // By which a plan is known: views that show the same plan share it.
  friend auto operator<=>(const PlanOrder&, const PlanOrder&) = default;
};

struct ViewEntry {
  std::string show;     // of view_kinds() (views.h)
  std::string caption;  // a few words
  PlanOrder plan;       // what the view needs of it: at least the picture
  std::string copy;     // letter of the copy, with the option repeat; empty: the first
  std::optional<Share> zoom;
};

struct Study {
  std::string key;     // in addresses and file names: "figure-8"
  std::string figure;  // "Figure 8"
  std::string title;
  std::string look_at;  // one plain sentence
  std::vector<ViewEntry> views;
  std::vector<std::string> not_there;  // what of the figure the planner cannot do, a sentence each
  int columns = 4;                     // views beside each other where the page is wide
};

struct Paper {
  std::string title, by;
  std::vector<Study> studies;
};

struct Studies {
  std::string title, lead;
  std::map<std::string, PictureEntry> pictures;
  std::map<std::string, WoodEntry> woods;
  std::vector<Paper> papers;
};

// kNotFound: no such file. kInvalidArgument: a key, a name or a value that means nothing; the message names the study.
Result<Studies> read_studies(const std::filesystem::path& file);

}  // namespace veneer::gallery
