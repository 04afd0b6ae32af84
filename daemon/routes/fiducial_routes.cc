// Sheets to print before there is anything to scan.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "calib/fiducial_sheet.h"
#include "calib/tag_pattern.h"
#include "daemon/calibration/fiducial_print.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/routes/request_ranges.h"

namespace veneer::daemon {
namespace {

ApiReply printed(const std::vector<calib::FiducialSheet>& pages, planner::PageFormat format) {
  auto bytes = print_sheets(pages, format);
  if (!bytes) return ApiReply::error(bytes.error());
  return ApiReply::bytes(std::move(*bytes), planner::content_type_of(format));
}

planner::PageFormat read_format(RequestReader& query) {
  return planner::page_format(query.word("format", {"pdf", "svg", "png"}).value_or("pdf"));
}

// What new panels' tags begin with unless somebody says so: no panel has had it, retired ones neither.
Result<int> unused_tag(Repositories& r) {
  const auto highest = r.panels.highest_tag();
  if (!highest) return highest.error();
  const calib::AprilGrid grid;
  return std::max(highest->value_or(0), grid.first_id + grid.tags() - 1) + 1;
}

struct PanelTagsWanted {
  Millimetres width{0}, height{0};
  int panels = 1;
  std::optional<int> first;
  planner::PageFormat format = planner::PageFormat::kPdf;
};

Result<std::vector<calib::FiducialSheet>> sheets_of(Repositories& r, const PanelTagsWanted& wanted) {
  int first = 0;
  if (wanted.first) {
    first = *wanted.first;
  } else {
    const auto unused = unused_tag(r);
    if (!unused) return unused.error();
    first = *unused;
  }
  std::vector<calib::FiducialSheet> pages;
  for (int i = 0; i < wanted.panels; ++i) {
    const auto plan = calib::plan_fiducials(wanted.width, wanted.height, first);
    if (!plan) return plan.error();
    first = plan->next_id();
    auto of_panel = calib::panel_sheets(*plan);
    pages.insert(pages.end(), std::make_move_iterator(of_panel.begin()), std::make_move_iterator(of_panel.end()));
  }
  if (wanted.format != planner::PageFormat::kPdf && pages.size() > 1)
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("these are {} pages, and SVG and PNG have one: print them as PDF, or for one smaller panel",
                    pages.size())};
  return pages;
}

void reply_panel_sheets(QueryPool& pictures, const ApiRequest& request, const Reply& reply) {
  auto query = RequestReader::query_of(request);
  PanelTagsWanted wanted;
  wanted.format = read_format(query);
  const auto width = query.number("width_mm", ranges::kBoardSide);
  const auto height = query.number("height_mm", ranges::kBoardSide);
  if (const auto panels = query.whole("panels", ranges::kPrintedPanels)) wanted.panels = static_cast<int>(*panels);
  if (const auto first = query.whole("first_tag", ranges::kTag)) wanted.first = static_cast<int>(*first);
  query.require("width_mm");
  query.require("height_mm");
  if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
  wanted.width = Millimetres(*width), wanted.height = Millimetres(*height);
  pictures.ask(request, reply, [wanted](Repositories& r) {
    const auto pages = sheets_of(r, wanted);
    return pages ? printed(*pages, wanted.format) : ApiReply::error(pages.error());
  });
}

}  // namespace

void bind_fiducial_routes(Router& router, QueryPool& pictures) {
  router.bind("printGrid", [&pictures](const ApiRequest& request, const Reply& reply) {
    auto query = RequestReader::query_of(request);
    const planner::PageFormat format = read_format(query);
    if (const Status read = query.end(); !read) return reply(ApiReply::error(read.error()));
    pictures.ask(request, reply, [format](Repositories&) { return printed({calib::grid_sheet()}, format); });
  });
  router.bind("printPanelTags", [&pictures](const ApiRequest& request, const Reply& reply) {
    reply_panel_sheets(pictures, request, reply);
  });
}

}  // namespace veneer::daemon
