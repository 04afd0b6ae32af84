#include "cli/new_job.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "cli/layout_files.h"
#include "cli/named_option.h"
#include "cli/painted_mask.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

std::string content_type_of(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (extension == ".png") return "image/png";
  if (extension == ".jpg" || extension == ".jpeg") return "image/jpeg";
  return "application/octet-stream";
}

// The planner's options go into the query under their own names; on the command line '-' stands for '_'.
struct NewJob {
  std::int64_t plan = 0;  // a job of this plan; then nothing else is given
  std::string picture, crop;
  std::string name;
  std::vector<std::string> panels, woods, wood_weights, wood_limits, forbidden;
  std::optional<double> size_mm;
  std::optional<std::uint32_t> max_panels;
  std::optional<bool> remnants_first;
  std::map<std::string, std::string> options;  // of the planner, those that are given
  LayoutFiles files;

  std::string title() const { return name.empty() ? std::filesystem::path(picture).stem().string() : name; }

  std::string query() const {
    std::string text = "?name=" + url_encode(title());
    const auto add_list = [&](const char* key, const std::vector<std::string>& list, const char* between = ",") {
      if (!list.empty()) text += fmt::format("&{}={}", key, url_encode(fmt::format("{}", fmt::join(list, between))));
    };
    if (!crop.empty()) text += "&crop=" + url_encode(crop);
    add_list("panels", panels);
    add_list("wood", woods);
    add_list("wood_weight", wood_weights);
    add_list("wood_limit", wood_limits);
    add_list("forbid", forbidden, ";");
    if (size_mm) text += fmt::format("&size_mm={}", *size_mm);
    if (max_panels) text += fmt::format("&max_panels={}", *max_panels);
    if (remnants_first) text += fmt::format("&remnants_first={}", *remnants_first ? 1 : 0);
    for (const auto& [key, value] : options) text += fmt::format("&{}={}", key, url_encode(value));
    return text;
  }

  std::string layout() const {
    const auto found = options.find("layout");
    return found == options.end() ? "grid" : found->second;
  }
};

// What the files that say how a picture is cut up are to the API.
struct SentFiles {
  std::string query;    // its part for them, each parameter with "&" before it
  std::string drawing;  // goes behind the picture
};

Result<SentFiles> sent_files(const NewJob& wanted) {
  if (const Status good = check_layout_files(wanted.files, 1, wanted.layout()); !good) return good.error();
  const auto files = layout_files_of(wanted.files, 0);
  if (!files) return files.error();
  SentFiles out;
  for (const auto& [key, file, read] : {std::tuple("importance", &files->importance, &importance_from_picture),
                                        std::tuple("large_edges", &files->large_edges, &edges_from_picture),
                                        std::tuple("fine_edges", &files->fine_edges, &edges_from_picture),
                                        std::tuple("cell_sizes", &files->cell_sizes, &sizes_from_picture)}) {
    if (file->empty()) continue;
    const Result<std::string> mask = read(*file);
    if (!mask) return mask.error();
    out.query += fmt::format("&{}={}", key, url_encode(*mask));
  }
  std::string vertices;
  for (const planner::PinnedVertex& pin : files->vertices)
    vertices += fmt::format("{}{},{},{},{}", vertices.empty() ? "" : ";", pin.row, pin.column, pin.at.x.count(),
                            pin.at.y.count());
  if (!vertices.empty()) out.query += "&pinned_vertices=" + url_encode(vertices);
  if (!files->flow_lines.empty())
    out.query += "&flow_lines=" + url_encode(planner::flow_text({files->flow_lines, files->flow_page}));
  if (files->segmentation.empty()) return out;
  auto drawing = read_file(files->segmentation);
  if (!drawing) return drawing.error();
  out.query += fmt::format("&segmentation_bytes={}", drawing->size());
  out.drawing = std::move(*drawing);
  return out;
}

void add_planner_option(CLI::App& command, const planner::NamedOption& option, NewJob& job) {
  CLI::Option* added = add_named_option(
      command, option, [&job, key = std::string(option.name)](const std::string& text) { job.options[key] = text; });
  if (option.kind == planner::OptionKind::kWhole)
    added->check(CLI::TypeValidator<std::uint64_t>("whole").description(""));
  if (option.kind == planner::OptionKind::kNumber) added->check(CLI::TypeValidator<double>("number").description(""));
}

// What a picture is planned with; `wanted` outlives the command.
CLI::Option* add_planning_options(CLI::App& command, NewJob& wanted) {
  CLI::Option* picture = command.add_option("PICTURE", wanted.picture, "The picture file");
  command.add_option("--name", wanted.name, "Its name in the lists [the file's]");
  command.add_option("--crop", wanted.crop,
                     "X,Y,WIDTH,HEIGHT: only this part of the picture, in pixels from its upper left corner");
  command.add_option("--size-mm", wanted.size_mm, "Shorter side of the picture");
  command.add_option("--panels", wanted.panels, "Only these panels, separated by commas")->delimiter(',');
  command.add_option("--max-panels", wanted.max_panels,
                     "Use no more than this many panels: those with the most free wood");
  command.add_flag("--remnants-first,!--no-remnants-first", wanted.remnants_first,
                   "No fresh panel while remnants have twice the picture's wood [as configured for the cell; where "
                   "nothing is configured, off]");
  command.add_option("--material,--wood", wanted.woods, "Use only zones of this material (repeatable)");
  command.add_option("--material-weight,--wood-weight", wanted.wood_weights,
                     "MATERIAL=F: favour (above 1) or avoid (below 1) this material's tones when the picture's are "
                     "mapped to the wood's (repeatable)");
  command.add_option(
      "--material-limit", wanted.wood_limits,
      "MATERIAL=F: no more than this share of the picture's area, 0 to 1, is of this material (repeatable)");
  command.add_option(
      "--forbid", wanted.forbidden,
      "PANEL,X,Y,WIDTH,HEIGHT: use no wood there, in mm from the panel's lower left corner (repeatable)");
  for (const planner::NamedOption& option : planner::kNamedOptions) add_planner_option(command, option, wanted);
  return picture;
}

// Masks are sent as a few cells, and a veneerctl that starts at once reads PNG alone.
constexpr const char* kLaidOver = "the picture or its crop (PNG)";

// The daemon knows a picture by its name in the lists, and a drawing by its parameter; who sent them knows the files.
Error of_the_file(Error error, const NewJob& wanted) {
  constexpr std::string_view kLines = "flow_lines: ";
  if (error.message.starts_with(kLines) && !wanted.files.flow_lines.empty())
    error.message =
        fmt::format("--flow-lines {}: {}", wanted.files.flow_lines.front(), error.message.substr(kLines.size()));
  for (const std::string before : {"", "the picture "})
    if (const std::string begin = before + wanted.title(); error.message.starts_with(begin + " is "))
      error.message = before + wanted.picture + error.message.substr(begin.size());
  return error;
}

// Sends the picture to `path` and waits for what becomes of it.
void plan_picture(const CommandContext& context, const char* path, const NewJob& wanted,
                  const CommandContext::Render& render) {
  const auto picture = read_file(wanted.picture);
  if (!picture) return context.finish(picture.error(), render, kUnusableArguments);
  const auto files = sent_files(wanted);
  if (!files) return context.finish(files.error(), render, kUnusableArguments);
  const auto started = context.client().request("POST", path + wanted.query() + files->query, *picture + files->drawing,
                                                content_type_of(wanted.picture));
  const auto made = context.run_task(started);
  context.finish(made ? made : Result<json>(of_the_file(made.error(), wanted)), render);
}

void add_plans_list(CLI::App& job, CommandContext& context) {
  struct Options {
    std::int64_t id = 0;
    std::string preview, plan, segmentation;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* plans = job.add_subcommand("plans", "All plans, or one of them");
  CLI::Option* id = plans->add_option("PLAN", options->id, "The number of one")->check(positive_number());
  plans->add_option("--preview", options->preview, "Save its picture as planned (PNG)")->needs(id);
  plans->add_option("--plan", options->plan, "Save it as a file (JSON)")->needs(id);
  plans->add_option("--segmentation", options->segmentation, "Save the drawing that its layout was made of")->needs(id);
  plans->callback([options, &context] {
    if (options->id == 0) return context.finish(context.client().get_all("/plans", "plans"), render_plans);
    const std::string target = "/plans/" + std::to_string(options->id);
    const auto view = context.client().get(target);
    if (view)
      save_parts(context, target,
                 {{options->preview, "/preview.png"},
                  {options->plan, "/plan.json"},
                  {options->segmentation, "/segmentation"}});
    context.finish(view, render_plan);
  });
}

void add_change(CLI::App& job, CommandContext& context) {
  struct Options {
    std::int64_t id = 0;
    std::string name;
    std::map<std::string, std::vector<std::string>> lists;
    int alternatives = 0;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* change = job.add_subcommand(
      "change", "Plan again with changes: another plan, in which what is not named keeps its place; the old one stays");
  change->add_option("PLAN", options->id, "Its number")->required()->check(positive_number());
  change->add_option("--name", options->name, "The new plan's name [the same]");
  for (const auto& [name, help] :
       {std::pair("pin", "MARK: keep only these in their places, plan all others anew (repeatable)"),
        std::pair("replan", "MARK: plan this piece anew (repeatable)"),
        std::pair("swap", "MARK,MARK: these two change places (repeatable)"),
        std::pair("take", "MARK=NUMBER: the piece moves to its alternative of that number, from 1 (repeatable)"),
        std::pair("forbid",
                  "PANEL,X,Y,WIDTH,HEIGHT: use no wood there, in mm from the panel's lower left corner (repeatable)")})
    change->add_option(std::string("--") + name, options->lists[name], help);
  const CLI::Option* alternatives =
      change
          ->add_option("--alternatives", options->alternatives,
                       "List up to this many alternatives for each piece of the new plan [as the plan itself]")
          ->check(CLI::Range(0, 1000));
  change->callback([options, alternatives, &context] {
    json body = json::object();
    if (alternatives->count() > 0) body["alternatives"] = options->alternatives;
    if (!options->name.empty()) body["name"] = options->name;
    for (const auto& [name, list] : options->lists)
      if (!list.empty()) body[name] = list;
    context.finish(context.run_task(context.client().post(fmt::format("/plans/{}/changes", options->id), body)),
                   render_new_plan);
  });
}

// lease, release: a plan's wood.
void add_leases(CLI::App& job, CommandContext& context) {
  struct Options {
    std::int64_t id = 0, days = 7;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* lease = job.add_subcommand("lease", "Keep a plan's wood for it: no other plan or job gets it meanwhile");
  CLI::App* release = job.add_subcommand("release", "Give back the wood that a plan leases; the plan stays");
  for (CLI::App* command : {lease, release})
    command->add_option("PLAN", options->id, "Its number")->required()->check(positive_number());
  lease->add_option("--days", options->days, "For how long, from now on; a lease that the plan has already is renewed")
      ->check(CLI::Range(1, 90))
      ->capture_default_str();
  lease->callback([options, &context] {
    context.finish_step(context.client().post(fmt::format("/plans/{}/lease", options->id), {{"days", options->days}}),
                        render_plan);
  });
  release->callback([options, &context] {
    context.finish_step(context.client().request("DELETE", fmt::format("/plans/{}/lease", options->id), "", ""),
                        render_plan);
  });
}

}  // namespace

void add_new_job(CLI::App& job, CommandContext& context) {
  const auto wanted = std::make_shared<NewJob>();
  CLI::App* command =
      job.add_subcommand("new", "Plan a picture from free stock and reserve its wood; or reserve that of a plan");
  add_planning_options(*command, *wanted);
  add_layout_options(*command, kLaidOver, wanted->files);
  command
      ->add_option("--plan", wanted->plan,
                   "Make the job from this plan (see `job plans`), without a picture or other options")
      ->check(positive_number());
  command->callback([wanted, command, &context] {
    if (wanted->plan == 0 && wanted->picture.empty())
      fail(unusable("say which PICTURE, or --plan N"), kUnusableArguments);
    if (wanted->plan == 0) return plan_picture(context, "/jobs", *wanted, render_new_job);
    const auto options = command->get_options();
    if (std::count_if(options.begin(), options.end(), [](const CLI::Option* option) { return option->count() > 0; }) >
        1)
      fail(unusable("a plan has its picture and options already: give --plan alone"), kUnusableArguments);
    context.finish(context.run_task(context.client().post("/jobs", {{"plan", wanted->plan}})), render_new_job);
  });
}

void add_plans(CLI::App& job, CommandContext& context) {
  const auto wanted = std::make_shared<NewJob>();
  CLI::App* plan = job.add_subcommand("plan", "Plan a picture from free stock and keep the plan; no wood is reserved");
  add_planning_options(*plan, *wanted)->required();
  add_layout_options(*plan, kLaidOver, wanted->files);
  plan->callback([wanted, &context] { plan_picture(context, "/plans", *wanted, render_new_plan); });
  const auto asked = std::make_shared<NewJob>();
  CLI::App* advise = job.add_subcommand(
      "advise",
      "Say at which crop, size, patches and layout a picture is recognisable in the free wood; nothing is kept");
  add_planning_options(*advise, *asked)->required();
  add_importance_option(*advise, kLaidOver, asked->files);
  advise->callback([asked, &context] { plan_picture(context, "/plans/advice", *asked, render_advice); });
  add_plans_list(job, context);
  add_change(job, context);
  add_leases(job, context);
}

}  // namespace veneer::cli
