#include "cli/layout_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/command_context.h"
#include "cli/json_read.h"

namespace veneer::cli {
namespace {

using nlohmann::json;
using planner::PinnedVertex;

struct LayoutOption {
  const char* name;
  std::vector<std::string> LayoutFiles::*files;
  const char* layout;  // the one that heeds it; "": all
  const char* says;
  const char* help;
};

constexpr LayoutOption kImportance{"--importance", &LayoutFiles::importance, "", "",
                                   "A mask over {}: white where it matters most, black where any wood will do"};
constexpr LayoutOption kLayoutOptions[] = {
    {"--segmentation", &LayoutFiles::segmentation, "segmentation", "says where pieces end",
     "With --layout segmentation: a picture whose areas of one colour, or an SVG drawing whose closed regions, become "
     "the pieces (a straight stroke parts those that it crosses), stretched over the whole picture. "
     "Without it: areas of about one tone"},
    {"--guides", &LayoutFiles::guides, "morph", "say where a morphed grid's lines go",
     "With --layout morph: a mask over {}, white where its edges count, or a JSON file with such pictures and with "
     "vertices of the grid that are pinned"},
    {"--large-edges", &LayoutFiles::large_edges, "morph", "says which edges a morphed grid follows",
     "With --layout morph: a mask over {}, white where the grid follows large edges [everywhere]"},
    {"--fine-edges", &LayoutFiles::fine_edges, "morph", "says which edges a morphed grid follows",
     "The same for fine edges [everywhere]"},
    {"--cell-sizes", &LayoutFiles::cell_sizes, "mosaic", "says where a mosaic's cells are small",
     "With --layout mosaic: a mask over {}, in its shape: white where cells are small, black where they are large "
     "[small where the eye looks first]"},
    {"--flow-lines", &LayoutFiles::flow_lines, "mosaic", "draws lines that a mosaic's cells lie along",
     "With --layout mosaic: an SVG drawing over {}, along whose lines cells lie, and along the edges that are found or "
     "(--flow-lines-only) instead of them"},
};

void add(CLI::App& command, const LayoutOption& option, std::string_view laid_over, LayoutFiles& files) {
  // One file each time, or it would take the PICTURE behind it too.
  command.add_option(option.name, files.*option.files, fmt::format(fmt::runtime(option.help), laid_over))
      ->allow_extra_args(false);
}

std::string nth(const std::vector<std::string>& files, std::size_t picture) {
  return picture < files.size() ? files[picture] : "";
}

// A misspelt key would be a mask that nobody heeds.
Status only_keys(const json& object, std::initializer_list<std::string_view> keys, const std::string& what) {
  if (!object.is_object()) return unusable(what + " is not an object of JSON");
  for (const auto& it : object.items())
    if (std::find(keys.begin(), keys.end(), it.key()) == keys.end())
      return unusable(fmt::format("{} has \"{}\", but only {} belong there", what, it.key(), fmt::join(keys, ", ")));
  return Ok();
}

Result<PinnedVertex> vertex_of(const json& it, const std::string& what) {
  if (Status status = only_keys(it, {"row", "column", "x_mm", "y_mm"}, what); !status.ok()) return status.error();
  if (!member(it, "row").is_number_integer() || !member(it, "column").is_number_integer() ||
      !member(it, "x_mm").is_number() || !member(it, "y_mm").is_number())
    return unusable(what + " must say its row and its column as whole numbers, and x_mm and y_mm");
  // What no int holds would come round as another vertex.
  for (const char* key : {"row", "column"})
    if (it[key] < 0 || it[key] > std::numeric_limits<int>::max())
      return unusable(fmt::format("{} has the {} {}: count from 0", what, key, it[key].dump()));
  return PinnedVertex{it["row"].get<int>(),
                      it["column"].get<int>(),
                      {Millimetres(it["x_mm"].get<double>()), Millimetres(it["y_mm"].get<double>())}};
}

Result<LayoutFilesOf> read_guides(const std::filesystem::path& file) {
  LayoutFilesOf out;
  if (file.extension() != ".json") {
    out.large_edges = out.fine_edges = file.string();
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
  for (const auto& [key, mask] :
       {std::pair("large_edges", &out.large_edges), std::pair("fine_edges", &out.fine_edges)}) {
    if (!read.contains(key)) continue;
    if (!read[key].is_string())
      return unusable(fmt::format("\"{}\" of {} must be the name of a picture beside it, in quotes", key, what));
    *mask = (file.parent_path() / read[key].get<std::string>()).string();
  }
  const json& vertices = member(read, "vertices");
  if (!vertices.is_null() && !vertices.is_array())
    return unusable(fmt::format("\"vertices\" of {} must be a list in square brackets", what));
  for (const json& it : vertices) {
    const Result<PinnedVertex> vertex = vertex_of(it, fmt::format("vertex {} of {}", out.vertices.size() + 1, what));
    if (!vertex.ok()) return vertex.error();
    out.vertices.push_back(*vertex);
  }
  return out;
}

Status read_flow_lines(const std::string& file, LayoutFilesOf& out) {
  const Result<std::string> text = read_file(file);
  if (!text.ok()) return text.error();
  const auto named = [&](const Error& error) {
    return unusable(fmt::format("--flow-lines {}: {}", file, error.message));
  };
  const auto drawing = planner::read_svg(*text, planner::kMostDrawnFlowPoints);
  if (!drawing.ok()) return named(drawing.error());
  auto lines = planner::flow_lines_of_drawing(*drawing);
  if (!lines.ok()) return named(lines.error());
  for (const std::string& warning : drawing->warnings)
    std::cerr << fmt::format("veneerctl: warning: --flow-lines {}: {}\n", file, warning);
  out.flow_lines = std::move(*lines), out.flow_page = drawing->page;
  return Ok();
}

}  // namespace

void add_importance_option(CLI::App& command, std::string_view laid_over, LayoutFiles& files) {
  add(command, kImportance, laid_over, files);
}

void add_layout_options(CLI::App& command, std::string_view laid_over, LayoutFiles& files) {
  add_importance_option(command, laid_over, files);
  for (const LayoutOption& option : kLayoutOptions) add(command, option, laid_over, files);
}

Status check_layout_files(const LayoutFiles& files, std::size_t pictures, std::string_view layout) {
  const auto check = [&](const LayoutOption& option) -> Status {
    const std::vector<std::string>& given = files.*option.files;
    if (std::ranges::count(given, "") > 0) return unusable(fmt::format("{} \"\" names no file", option.name));
    if (given.size() > pictures)
      return unusable(fmt::format("there are more {} than pictures to rebuild: give one for each", option.name));
    if (!given.empty() && *option.layout != '\0' && layout != option.layout)
      return unusable(fmt::format("{} {}: add --layout {}", option.name, option.says, option.layout));
    return Ok();
  };
  if (Status status = check(kImportance); !status.ok()) return status;
  for (const LayoutOption& option : kLayoutOptions)
    if (Status status = check(option); !status.ok()) return status;
  return Ok();
}

Result<LayoutFilesOf> layout_files_of(const LayoutFiles& files, std::size_t picture) {
  LayoutFilesOf out;
  if (const std::string guides = nth(files.guides, picture); !guides.empty()) {
    Result<LayoutFilesOf> read = read_guides(guides);
    if (!read.ok()) return read.error();
    out = std::move(*read);
  }
  out.importance = nth(files.importance, picture);
  out.segmentation = nth(files.segmentation, picture);
  out.cell_sizes = nth(files.cell_sizes, picture);
  if (const std::string drawing = nth(files.flow_lines, picture); !drawing.empty())
    if (Status status = read_flow_lines(drawing, out); !status.ok()) return status.error();
  for (const auto& [name, option, mask] : {std::tuple("--large-edges", &files.large_edges, &out.large_edges),
                                           std::tuple("--fine-edges", &files.fine_edges, &out.fine_edges)}) {
    const std::string given = nth(*option, picture);
    if (!given.empty() && !mask->empty())
      return unusable(fmt::format("{} and --guides name edges of one kind: give one of them", name));
    if (!given.empty()) *mask = given;
  }
  return out;
}

}  // namespace veneer::cli
