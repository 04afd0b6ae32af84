#include "cli/guides_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "cli/command_context.h"
#include "cli/json_read.h"
#include "planner/pictures/pictures.h"

namespace veneer::cli {
namespace {

using nlohmann::json;
using planner::LayoutGuides;

Result<cv::Mat> grey_picture(const std::filesystem::path& file) {
  const Result<cv::Mat> picture = planner::load_picture(file);
  if (!picture.ok()) return picture.error();
  cv::Mat out;
  cv::cvtColor(*picture, out, cv::COLOR_BGR2GRAY);
  return out;
}

// A misspelt key would be a mask that nobody heeds.
Status only_keys(const json& object, std::initializer_list<std::string_view> keys, const std::string& what) {
  if (!object.is_object()) return unusable(what + " is not an object of JSON");
  for (const auto& it : object.items())
    if (std::find(keys.begin(), keys.end(), it.key()) == keys.end())
      return unusable(fmt::format("{} has \"{}\", but only {} belong there", what, it.key(), fmt::join(keys, ", ")));
  return Ok();
}

Result<planner::PinnedVertex> vertex_of(const json& it, const std::string& what) {
  if (Status status = only_keys(it, {"row", "column", "x_mm", "y_mm"}, what); !status.ok()) return status.error();
  if (!member(it, "row").is_number_integer() || !member(it, "column").is_number_integer() ||
      !member(it, "x_mm").is_number() || !member(it, "y_mm").is_number())
    return unusable(what + " must say its row and its column as whole numbers, and x_mm and y_mm");
  // What no int holds would come round as another vertex.
  for (const char* key : {"row", "column"})
    if (it[key] < 0 || it[key] > std::numeric_limits<int>::max())
      return unusable(fmt::format("{} has the {} {}: count from 0", what, key, it[key].dump()));
  return planner::PinnedVertex{it["row"].get<int>(),
                               it["column"].get<int>(),
                               {Millimetres(it["x_mm"].get<double>()), Millimetres(it["y_mm"].get<double>())}};
}

}  // namespace

Result<LayoutGuides> load_guides(const std::filesystem::path& file) {
  LayoutGuides out;
  if (file.extension() != ".json") {
    Result<cv::Mat> mask = grey_picture(file);
    if (!mask.ok()) return mask.error();
    out.large = *mask, out.fine = *mask;
    return out;
  }
  const Result<std::string> text = read_file(file);
  if (!text.ok()) return text.error();
  const json read = json::parse(*text, nullptr, false);
  const std::string what = fmt::format("the guides {}", file.string());
  if (read.is_discarded())
    return unusable(what + " are neither a picture nor JSON: end the name of a picture in .png, or mend the JSON");
  if (Status status = only_keys(read, {"schema_version", "large_edges", "fine_edges", "vertices"}, what); !status.ok())
    return status.error();
  if (read.contains("schema_version") && read["schema_version"] != 1)
    return unusable(what + " must have \"schema_version\": 1, or leave it out");
  for (const auto& [key, mask] : {std::pair("large_edges", &out.large), std::pair("fine_edges", &out.fine)}) {
    if (!read.contains(key)) continue;
    if (!read[key].is_string())
      return unusable(fmt::format("\"{}\" of {} must be the name of a picture beside it, in quotes", key, what));
    const Result<cv::Mat> picture = grey_picture(file.parent_path() / read[key].get<std::string>());
    if (!picture.ok()) return picture.error();
    *mask = *picture;
  }
  const json& vertices = member(read, "vertices");
  if (!vertices.is_null() && !vertices.is_array())
    return unusable(fmt::format("\"vertices\" of {} must be a list in square brackets", what));
  for (const json& it : vertices) {
    const Result<planner::PinnedVertex> vertex =
        vertex_of(it, fmt::format("vertex {} of {}", out.vertices.size() + 1, what));
    if (!vertex.ok()) return vertex.error();
    out.vertices.push_back(*vertex);
  }
  return out;
}

}  // namespace veneer::cli
