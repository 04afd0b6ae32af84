#include "daemon/plans/job_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "daemon/api/idempotency.h"
#include "daemon/api/request_reader.h"
#include "daemon/orders/picture_paint.h"
#include "planner/drawings/flow_lines.h"
#include "planner/layout/pinned_vertices.h"
#include "planner/plan_options.h"
#include "planner/suggest/crops.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

constexpr NumberRange kSize{1, 1e5}, kPanels{1, 1e6}, kDrawing{1, 16 << 20};

Error unusable(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }

std::vector<std::string> parts_of(const std::string& text, char separator = ',') {
  std::vector<std::string> out;
  std::stringstream list(text);
  for (std::string part; std::getline(list, part, separator);)
    if (!part.empty()) out.push_back(part);
  return out;
}

// MATERIAL=NUMBER, separated by commas.
void read_wood_numbers(RequestReader& query, const char* name, std::vector<std::pair<std::string, double>>& out) {
  for (const std::string& part : parts_of(query.text(name).value_or(""))) {
    const std::size_t equals = std::min(part.rfind('='), part.size());
    const auto weight = parse_number(std::string_view(part).substr(std::min(equals + 1, part.size())));
    if (equals == 0 || !weight)
      return query.refuse(
          unusable(fmt::format("{} must be MATERIAL=NUMBER, separated by commas, not \"{}\": correct it", name, part)));
    out.emplace_back(part.substr(0, equals), *weight);
  }
}

void read_forbidden(RequestReader& query, JobRequest& job) {
  for (const std::string& part : parts_of(query.text("forbid").value_or(""), ';')) {
    auto wood = planner::forbidden_wood(part);
    if (!wood) return query.refuse(unusable("forbid: " + wood.error().message));
    job.forbidden.push_back(std::move(*wood));
  }
}

void read_planner_options(RequestReader& query, planner::PlanOptions& options) {
  for (const planner::NamedOption& option : planner::kNamedOptions) {
    const auto text = query.text(option.name);
    if (!text) continue;
    if (const Status set = planner::set_option(options, option.name, *text); !set) {
      query.refuse(unusable(set.error().message + ": correct it"));
      continue;
    }
    // The planner names an option in words, and checks all of them together at last. Beside the usual ones this one
    // alone can be out of its range.
    planner::PlanOptions alone;
    static_cast<void>(planner::set_option(alone, option.name, *text));
    if (const Status in_range = planner::check_options(alone); !in_range)
      query.refuse(unusable(fmt::format("{} is {}: {}", option.name, *text, in_range.error().message)));
  }
}

constexpr std::pair<const char*, std::string JobRequest::*> kEdges[] = {{"large_edges", &JobRequest::large_edges},
                                                                        {"fine_edges", &JobRequest::fine_edges}};

void read_paint(RequestReader& query, JobRequest& job) {
  for (const auto& [name, edges] : kEdges)
    if (const auto text = query.text(name)) {
      if (const auto mask = edge_mask(name, *text); !mask) query.refuse(mask.error());
      job.*edges = *text;
    }
  if (const auto text = query.text("importance")) {
    if (const auto mask = importance_mask("importance", *text); !mask) query.refuse(mask.error());
    job.importance = *text;
  }
  if (const auto text = query.text("cell_sizes")) {
    if (const auto mask = cell_size_mask("cell_sizes", *text); !mask) query.refuse(mask.error());
    job.cell_sizes = *text;
  }
  if (const auto text = query.text("flow_lines")) {
    if (const auto lines = planner::flow_drawing_of("flow_lines", *text); !lines) query.refuse(lines.error());
    job.flow_lines = *text;
  }
  if (const auto text = query.text("pinned_vertices")) {
    const auto vertices = planner::pinned_vertices_of("pinned_vertices", *text);
    if (!vertices) query.refuse(vertices.error());
    job.pinned_vertices = *text;
  }
}

// What somebody says of a layout, if it says anything.
struct Guide {
  const char* name;
  bool given;
  planner::LayoutKind layout;  // the one that heeds it
  const char* what;            // it says
};

std::vector<Guide> guides_of(const JobRequest& job) {
  using planner::LayoutKind;
  return {{"large_edges", job.large_edges != kAllEdges, LayoutKind::kMorph, "which edges a morphed grid follows"},
          {"fine_edges", job.fine_edges != kAllEdges, LayoutKind::kMorph, "which edges a morphed grid follows"},
          {"pinned_vertices", !job.pinned_vertices.empty(), LayoutKind::kMorph, "where a morphed grid's lines meet"},
          {"cell_sizes", job.cell_sizes != kSalientSizes, LayoutKind::kMosaic, "where a mosaic's cells are small"},
          {"flow_lines", !job.flow_lines.empty(), LayoutKind::kMosaic, "along which lines a mosaic's cells lie"},
          {"segmentation_bytes", job.segmentation_bytes > 0, LayoutKind::kSegmentation,
           "that a drawing's regions become the pieces"}};
}

// What somebody painted or drew is never passed over in silence.
void refuse_idle_guides(RequestReader& query, const JobRequest& job) {
  for (const Guide& guide : guides_of(job)) {
    if (!guide.given || guide.layout == job.options.layout) continue;
    planner::PlanOptions heeding;
    heeding.layout = guide.layout;
    query.refuse(unusable(fmt::format(
        "{} says {}, and the layout {} does not heed it: choose the layout {}, or leave "
        "it out",
        guide.name, guide.what, planner::option_text(job.options, "layout"), planner::option_text(heeding, "layout"))));
  }
}

void read_drawing(RequestReader& query, std::size_t body, JobRequest& job) {
  const auto bytes = query.whole("segmentation_bytes", kDrawing);
  if (!bytes) return;
  if (static_cast<std::size_t>(*bytes) > body)
    return query.refuse(unusable(fmt::format(
        "segmentation_bytes is {}, and the whole body has {}: send the drawing behind the picture", *bytes, body)));
  job.segmentation_bytes = static_cast<std::size_t>(*bytes);
}

}  // namespace

Result<JobRequest> read_job_request(const ApiRequest& request) {
  JobRequest job;
  job.options.dpi = 75;  // what an eye resolves at arm's length; sixteen times faster than 300
  auto query = RequestReader::query_of(request);
  job.name = query.text("name").value_or("picture");
  job.crop = query.text("crop").value_or("");
  if (!job.crop.empty())
    if (const auto crop = planner::crop_of(job.crop); !crop) query.refuse(crop.error());
  read_paint(query, job);
  if (const auto size = query.number("size_mm", kSize)) job.size = Millimetres(*size);
  for (const std::string& id : parts_of(query.text("panels").value_or(""))) job.panels.push_back(PanelId{id});
  if (const auto count = query.whole("max_panels", kPanels)) job.max_panels = static_cast<std::size_t>(*count);
  job.remnants_first = query.flag("remnants_first");
  job.woods = parts_of(query.text("wood").value_or(""));
  read_wood_numbers(query, "wood_weight", job.wood_weights);
  read_wood_numbers(query, "wood_limit", job.wood_limits);
  for (const auto& [material, share] : job.wood_limits) job.options.material_limits.push_back({material, share});
  read_forbidden(query, job);
  read_planner_options(query, job.options);
  read_drawing(query, request.body.size(), job);
  refuse_idle_guides(query, job);
  if (const Status read = query.end(); !read) return read.error();
  if (!request.idempotency_key.empty())
    job.keyed = db::KeyedRequest{request.caller.who, "newJob", request.idempotency_key, fingerprint_of(request)};
  job.files = request.body;
  if (job.picture().empty()) return unusable("the picture is missing: send the file as the request's body");
  if (const Status usable = planner::check_options(job.options); !usable) return usable.error();
  return job;
}

void choose_as_configured(JobRequest& request, const PlannerConfig& planner) {
  if (planner.remnants_first && request.panels.empty() && !request.remnants_first) request.remnants_first = true;
}

Status wants_no_guides(const JobRequest& request, std::string_view what) {
  for (const Guide& guide : guides_of(request))
    if (guide.given) return unusable(fmt::format("{} does not heed {}: leave it out", what, guide.name));
  if (request.options.flow_lines_only)
    return unusable(fmt::format("{} does not heed flow_lines_only: leave it out", what));
  return Ok();
}

Status wants_no_drawing(const JobRequest& request, std::string_view what) {
  if (request.segmentation_bytes == 0) return Ok();
  return unusable(fmt::format("{} does not heed segmentation_bytes: leave it out", what));
}

Result<JobRequest> job_request_again(const std::string& name, SharedText picture, const std::string& options_json) {
  const Error damaged{ErrorCode::kStorage,
                      "what the plan was asked for cannot be read any more: plan the picture anew"};
  const json kept = json::parse(options_json, nullptr, false);
  if (!kept.is_object()) return damaged;
  // As a client would have asked.
  ApiRequest request;
  request.body = std::move(picture);
  request.query["name"] = name;
  const auto text = [](const json& value) {
    return value.is_string()    ? value.get<std::string>()
           : value.is_boolean() ? value.get<bool>() ? "1" : "0"
                                : value.dump();
  };
  const auto joined = [&](const json& list, const char* separator) {
    std::string out;
    for (const auto& item : list) out += (out.empty() ? "" : separator) + text(item);
    return out;
  };
  for (const char* whole : {"crop", "size_mm", "large_edges", "fine_edges", "pinned_vertices", "cell_sizes",
                            "flow_lines", "importance", "max_panels", "remnants_first"})
    if (const auto value = kept.find(whole); value != kept.end() && !value->is_null())
      request.query[whole] = text(*value);
  for (const planner::NamedOption& option : planner::kNamedOptions)
    if (const auto value = kept.find(option.name); value != kept.end())
      request.query[std::string(option.name)] = text(*value);
  for (const auto& [list, separator] : {std::pair("panels", ","), std::pair("wood", ","), std::pair("forbid", ";")})
    if (const auto value = kept.find(list); value != kept.end() && !value->empty())
      request.query[list] = joined(*value, separator);
  for (const char* numbers : {"wood_weight", "wood_limit"})
    if (const auto of = kept.find(numbers); of != kept.end() && of->is_object()) {
      std::string all;
      for (const auto& [wood, number] : of->items()) all += (all.empty() ? "" : ",") + wood + "=" + number.dump();
      if (!all.empty()) request.query[numbers] = all;
    }
  auto again = read_job_request(request);
  if (!again) return damaged;
  again->kept_drawing = kept_drawing(options_json);
  return again;
}

std::optional<KeptDrawing> kept_drawing(const std::string& options_json) {
  const json kept = json::parse(options_json, nullptr, false);
  if (!kept.is_object()) return std::nullopt;
  const auto bytes = kept.find("segmentation_bytes"), file = kept.find(kDrawingFile);
  if (bytes == kept.end() || !bytes->is_number_unsigned()) return std::nullopt;
  KeptDrawing out;
  out.bytes = bytes->get<std::size_t>();
  if (file != kept.end() && file->is_string()) out.file = file->get<std::string>();
  return out;
}

json options_json(const JobRequest& request) {
  json out = {{"size_mm", request.size.count()}};
  for (const planner::NamedOption& option : planner::kNamedOptions) {
    const std::string text = planner::option_text(request.options, option.name);
    json& value = out[std::string(option.name)];
    if (option.kind == planner::OptionKind::kWord)
      value = text;
    else if (option.kind == planner::OptionKind::kSwitch)
      value = text == "1";
    else
      value = json::parse(text);
  }
  out["large_edges"] = request.large_edges;
  out["fine_edges"] = request.fine_edges;
  out["pinned_vertices"] = request.pinned_vertices;
  out["cell_sizes"] = request.cell_sizes;
  out["flow_lines"] = request.flow_lines;
  out["segmentation_bytes"] = request.segmentation_bytes > 0 ? json(request.segmentation_bytes) : json();
  if (request.kept_drawing) {
    out["segmentation_bytes"] = request.kept_drawing->bytes;
    if (!request.kept_drawing->file.empty()) out[kDrawingFile] = request.kept_drawing->file;
  }
  out["importance"] = request.importance;
  out["crop"] = request.crop.empty() ? json() : json(request.crop);
  out["panels"] = json::array();
  for (const PanelId& panel : request.panels) out["panels"].push_back(panel.value);
  out["max_panels"] = request.max_panels ? json(*request.max_panels) : json();
  out["remnants_first"] = request.remnants_first ? json(*request.remnants_first) : json();
  out["wood"] = request.woods;
  out["wood_weight"] = json::object();
  for (const auto& [wood, weight] : request.wood_weights) out["wood_weight"][wood] = weight;
  out["wood_limit"] = json::object();
  for (const auto& [wood, share] : request.wood_limits) out["wood_limit"][wood] = share;
  out["forbid"] = json::array();
  for (const auto& [panel, region] : request.forbidden)
    out["forbid"].push_back(fmt::format("{},{},{},{},{}", panel.value, region.min.x.count(), region.min.y.count(),
                                        region.width().count(), region.height().count()));
  return out;
}

}  // namespace veneer::daemon
