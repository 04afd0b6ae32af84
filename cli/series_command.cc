#include "cli/series_command.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "cli/command_context.h"
#include "cli/plan_arguments.h"
#include "cli/plan_edits.h"
#include "cli/plan_support.h"
#include "planner/files/plan_files.h"
#include "planner/series/series.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;

struct SeriesArguments {
  PlanArguments plan;
  EditArguments edits;
  int pictures = 0;
  bool one_priority = false;
  std::string out;
};

// A table of what the curve shows.
std::string table_of(const std::vector<planner::SeriesColumn>& columns) {
  std::string out = "pictures  picture after picture     all together\n";
  const auto cell = [](const planner::SeriesCost& cost) {
    return fmt::format("{:>9} {:<14}", cost.last ? fmt::format("{:.5f}", *cost.last) : "-",
                       cost.unfilled_last > 0 ? fmt::format("({} unfilled)", cost.unfilled_last) : "");
  };
  for (std::size_t k = 0; k < columns.size(); ++k)
    out += fmt::format("{:>8}  {}  {}\n", k + 1, cell(columns[k].sequential), cell(columns[k].interleaved));
  return out;
}

// What `plan` can do and a series cannot, and how it is had.
struct OfPlanAlone {
  const char* name;
  const char* sentence;
};
constexpr OfPlanAlone kOfPlanAlone[] = {
    {"--repeat", "a series plans one picture again and again: say how often with --pictures, not with --repeat"},
    {"--interleave", "a series plans the pictures in turn and together in any case: leave --interleave out"},
    {"--reserve", "a series plans the pictures in turn and together, with nothing reserved: leave --reserve out"},
    {"--keep", "a series begins with all of the wood, around no plan that is there: leave --keep out"}};

// Not in the help, so that nobody tries them; whoever does is told why they are not there.
void refuse_options_of_plan(CLI::App& series) {
  for (const char* of_no_series : {"--optimize", "--optimize-seconds", "--optimize-iterations", "--alternatives"})
    series.get_option(of_no_series)->group("");  // check_series() refuses them
  for (const OfPlanAlone& it : kOfPlanAlone)
    series
        .add_option_function<std::string>(it.name, [&it](const std::string&) { end(kUnusableArguments, it.sentence); })
        ->expected(0, 1)
        ->group("");
}

void run_series(const SeriesArguments& arguments) {
  planner::PlanOptions options = or_end(plan_options(arguments.plan));
  if (const Status good = planner::check_series(options); !good.ok()) end(good.error());
  if (arguments.plan.targets.size() != 1) end(kUnusableArguments, "series plans one picture: give one --target");
  if (arguments.pictures < 0 || arguments.pictures > planner::kMostPictures)
    end(kUnusableArguments, fmt::format("--pictures must lie between 1 and {}, or be 0 for as many as the wood allows",
                                        planner::kMostPictures));
  planner::SeriesOptions how{arguments.pictures};
  if (arguments.one_priority) how.sequential = how.interleaved = options.priority;
  const auto artworks = or_end(load_artworks(arguments.plan));
  auto stock = or_end(load_panels(arguments.plan));
  if (const Status status = apply_edits(arguments.edits, stock, options); !status.ok()) end(status.error());
  const fs::path out = arguments.out;
  make_directory(out);
  std::optional<Result<planner::Series>> series;
  with_progress([&](const planner::Progress& progress, std::stop_token stop) {
    series = planner::make_series(artworks.front(), stock, options, how, progress, std::move(stop));
  });
  if (!series->ok()) end(series->error());
  const auto columns = planner::columns_of(**series);
  or_fail(write_picture(or_end(planner::series_strip(**series, stock)), out / "series.png"));
  or_fail(planner::write_text(planner::series_to_json(**series), out / "series.json"));
  or_fail(planner::write_text(planner::series_chart(columns), out / "series.svg"));
  std::cout << table_of(columns);
}

}  // namespace

void add_series_command(CLI::App& app) {
  auto arguments = std::make_shared<SeriesArguments>();
  CLI::App* series = app.add_subcommand(
      "series", "Plan one picture again and again from the same wood: one after another, and all together");
  add_plan_arguments(*series, arguments->plan);
  add_forbid_argument(*series, arguments->edits);
  CLI::Option* priority = series->get_option("--priority");
  priority
      ->description(
          "Which patches choose first: saliency or center (default: center where pictures are planned one after "
          "another, saliency where they are planned together)")
      ->default_str("");
  refuse_options_of_plan(*series);
  series->add_option("--pictures", arguments->pictures, "How many copies; 0: until one stays incomplete")
      ->capture_default_str();
  series->add_option("--out", arguments->out, "Directory for series.png, series.svg and series.json")->required();
  series->callback([arguments, priority] {
    arguments->one_priority = priority->count() > 0;
    run_series(*arguments);
  });
}

}  // namespace veneer::cli
