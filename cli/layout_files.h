// Files that say how a picture is to be cut up, beside the options that say it in a word: one set of options for
// `plan`, `series`, `job plan` and `job new`. Files of masks and guides are named here and read by whoever plans.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "planner/drawings/flow_lines.h"
#include "planner/layout/pinned_vertices.h"

namespace veneer::cli {

// The n-th file belongs to the n-th picture.
struct LayoutFiles {
  std::vector<std::string> importance, segmentation, guides, large_edges, fine_edges, cell_sizes, flow_lines;

  // Is anything said of a morphed grid?
  bool guide_a_grid() const { return !guides.empty() || !large_edges.empty() || !fine_edges.empty(); }
  // Or of a mosaic's cells?
  bool guide_a_mosaic() const { return !cell_sizes.empty() || !flow_lines.empty(); }
};

// What they are for one picture; "": none.
struct LayoutFilesOf {
  std::string importance, segmentation, large_edges, fine_edges, cell_sizes;
  std::vector<planner::PinnedVertex> vertices;
  std::vector<planner::FlowLine> flow_lines;
  planner::DrawingPoint flow_page{};  // of their drawing, in its millimetres; stretched over the whole picture
};

// `files` outlives the command; `laid_over` is what masks are stretched over: "the target". Importance counts whatever
// the layout, in squares too: advice has no more than it.
void add_importance_option(CLI::App& command, std::string_view laid_over, LayoutFiles& files);
void add_layout_options(CLI::App& command, std::string_view laid_over, LayoutFiles& files);

// kInvalidArgument: there are more files of one kind than pictures, or `layout` heeds none of that kind.
Status check_layout_files(const LayoutFiles& files, std::size_t pictures, std::string_view layout);

// Reads a file of guides (docs/FILES.md), whose pictures are looked for beside it, and a drawing of flow lines; says on
// standard error what a person should know of how that was read.
// kInvalidArgument: it is no such file, or guides and an option name edges of one kind; which vertices the grid has,
// the planner says.
Result<LayoutFilesOf> layout_files_of(const LayoutFiles& files, std::size_t picture);

}  // namespace veneer::cli
