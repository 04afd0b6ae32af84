#include "daemon/job_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "planner/plan_options.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;

Error unusable(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message)}; }

std::vector<std::string> parts_of(const std::string& text, char separator = ',') {
  std::vector<std::string> out;
  std::stringstream list(text);
  for (std::string part; std::getline(list, part, separator);)
    if (!part.empty()) out.push_back(part);
  return out;
}

Status read_size(const ApiRequest& request, JobRequest& job) {
  const auto size = request.query_number("size_mm");
  if (!size) return size.error();
  if (!*size) return Ok();
  if (!(**size > 0 && **size <= 1e5)) return unusable("size_mm must lie between 0 and 100000");
  job.size = Millimetres(**size);
  return Ok();
}

Status read_max_panels(const ApiRequest& request, JobRequest& job) {
  const auto count = request.query_number("max_panels");
  if (!count) return count.error();
  if (!*count) return Ok();
  if (!(**count >= 1 && **count <= 1e6) || **count != static_cast<double>(static_cast<std::size_t>(**count)))
    return unusable("max_panels must be a whole number from 1");
  job.max_panels = static_cast<std::size_t>(**count);
  return Ok();
}

Status read_panels(const ApiRequest& request, JobRequest& job) {
  for (const std::string& id : parts_of(request.query_value("panels").value_or(""))) job.panels.push_back(PanelId{id});
  return Ok();
}

Status read_wood(const ApiRequest& request, JobRequest& job) {
  job.woods = parts_of(request.query_value("wood").value_or(""));
  return Ok();
}

Status read_wood_weights(const ApiRequest& request, JobRequest& job) {
  for (const std::string& part : parts_of(request.query_value("wood_weight").value_or(""))) {
    const std::size_t equals = std::min(part.rfind('='), part.size());
    ApiRequest number;  // the same reading of a number as everywhere
    number.query["wood_weight"] = part.substr(std::min(equals + 1, part.size()));
    const auto weight = number.query_number("wood_weight");
    if (equals == 0 || !weight)
      return unusable(fmt::format("wood_weight must be WOOD=NUMBER, separated by commas, not \"{}\"", part));
    job.wood_weights.emplace_back(part.substr(0, equals), **weight);
  }
  return Ok();
}

Status read_forbidden(const ApiRequest& request, JobRequest& job) {
  for (const std::string& part : parts_of(request.query_value("forbid").value_or(""), ';')) {
    auto wood = planner::forbidden_wood(part);
    if (!wood) return unusable("forbid: " + wood.error().message);
    job.forbidden.push_back(std::move(*wood));
  }
  return Ok();
}

// What is not the planner's own.
struct Parameter {
  std::string_view name;
  Status (*read)(const ApiRequest&, JobRequest&);
};
constexpr Parameter kParameters[] = {
    {"name",
     [](const ApiRequest& request, JobRequest& job) -> Status {
       job.name = *request.query_value("name");
       return Ok();
     }},
    {"size_mm", read_size},
    {"panels", read_panels},
    {"max_panels", read_max_panels},
    {"wood", read_wood},
    {"wood_weight", read_wood_weights},
    {"forbid", read_forbidden},
};

Status read_parameter(const ApiRequest& request, const std::string& name, const std::string& text, JobRequest& job) {
  for (const Parameter& parameter : kParameters)
    if (parameter.name == name) return parameter.read(request, job);
  for (const planner::NamedOption& option : planner::kNamedOptions)
    if (option.name == name) return planner::set_option(job.options, name, text);
  return unusable(fmt::format("a new job has no parameter {}: see docs/openapi.json", name));
}

}  // namespace

Result<JobRequest> read_job_request(const ApiRequest& request) {
  JobRequest job;
  job.name = "picture";
  job.picture = request.body;
  if (job.picture.empty()) return unusable("the picture is missing: send the file as the request's body");
  job.options.dpi = 75;  // what an eye resolves at arm's length; sixteen times faster than 300
  for (const auto& [name, text] : request.query)
    if (Status read = read_parameter(request, name, text, job); !read) return read.error();
  if (Status usable = planner::check_options(job.options); !usable) return usable.error();
  return job;
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
  out["panels"] = json::array();
  for (const PanelId& panel : request.panels) out["panels"].push_back(panel.value);
  out["max_panels"] = request.max_panels ? json(*request.max_panels) : json();
  out["wood"] = request.woods;
  out["wood_weight"] = json::object();
  for (const auto& [wood, weight] : request.wood_weights) out["wood_weight"][wood] = weight;
  out["forbid"] = json::array();
  for (const auto& [panel, region] : request.forbidden)
    out["forbid"].push_back(fmt::format("{},{},{},{},{}", panel.value, region.min.x.count(), region.min.y.count(),
                                        region.width().count(), region.height().count()));
  return out;
}

}  // namespace veneer::daemon
