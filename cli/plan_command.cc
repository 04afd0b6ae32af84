#include "cli/plan_command.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "cli/progress.h"
#include "planner/pictures.h"
#include "planner/plan_files.h"
#include "planner/preview.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;
using planner::Artwork;
using planner::Plan;
using planner::PlanOptions;
using planner::StockPanel;
using Clock = std::chrono::steady_clock;

constexpr int kFailed = 1, kUnusableArguments = 2;

[[noreturn]] void end(int status, const std::string& sentence) {
  std::cerr << "veneerctl plan: " << sentence << "\n";
  throw CLI::RuntimeError(status);
}

// Unusable input is the caller's to mend; anything else is work that failed.
[[noreturn]] void end(const Error& error) {
  const bool input = error.code == ErrorCode::kInvalidArgument || error.code == ErrorCode::kNotFound;
  end(input ? kUnusableArguments : kFailed, error.message);
}

struct PlanArguments {
  std::vector<std::string> targets, panels;
  double size_mm = 360, patch_mm = 14, kerf_mm = 0.15;
  PlanOptions options;
  std::string layout = "grid", priority = "saliency", refine = "none", optimize = "greedy", formats = "svg,json";
  int adaptive_levels = 0;
  std::string out;
};

struct PanelArgument {
  std::string picture, mask, id;
  double dpi = 300;
};

double number_of(const std::string& text, const std::string& what) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || !std::isfinite(value))
    end(kUnusableArguments, fmt::format("{} is not a number: \"{}\"", what, text));
  return value;
}

// IMAGE[,mask=IMAGE][,dpi=300][,id=NAME]; a comma in a file's name is taken as part of it when no key follows.
PanelArgument panel_argument(const std::string& text) {
  PanelArgument panel;
  std::string* open = &panel.picture;
  std::string dpi;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    if (from == 0) {
      panel.picture = part;
    } else if (part.rfind("mask=", 0) == 0) {
      panel.mask = part.substr(5), open = &panel.mask;
    } else if (part.rfind("dpi=", 0) == 0) {
      dpi = part.substr(4), open = &dpi;
    } else if (part.rfind("id=", 0) == 0) {
      panel.id = part.substr(3), open = &panel.id;
    } else {
      *open += "," + part;
    }
    from = comma + 1;
  }
  if (panel.picture.empty()) end(kUnusableArguments, fmt::format("--panel {} names no picture", text));
  if (!dpi.empty()) panel.dpi = number_of(dpi, "the dpi of --panel " + text);
  if (panel.id.empty()) panel.id = fs::path(panel.picture).stem().string();
  return panel;
}

// Ids become parts of file names.
void check_ids(const std::vector<PanelArgument>& panels) {
  std::set<std::string> seen;
  for (const PanelArgument& panel : panels) {
    if (panel.id.empty() || panel.id.find('/') != std::string::npos || panel.id == "." || panel.id == "..")
      end(kUnusableArguments, fmt::format("\"{}\" cannot be the id of a panel", panel.id));
    if (!seen.insert(panel.id).second)
      end(kUnusableArguments,
          fmt::format("two panels have the id {}: give one of them another with id=NAME", panel.id));
  }
}

std::vector<StockPanel> load_panels(const std::vector<PanelArgument>& arguments) {
  std::vector<StockPanel> stock;
  for (const PanelArgument& argument : arguments) {
    if (!(argument.dpi >= 1 && argument.dpi <= 10000))
      end(kUnusableArguments, fmt::format("the dpi of panel {} must lie between 1 and 10000", argument.id));
    StockPanel panel;
    panel.id = {argument.id};
    Result<cv::Mat> picture = planner::load_picture(argument.picture);
    if (!picture.ok()) end(picture.error());
    panel.picture.pixels = *picture;
    panel.picture.resolution = ScanResolution::from_dpi(argument.dpi);
    panel.free.resolution = panel.picture.resolution;
    if (argument.mask.empty()) {
      panel.free.pixels = cv::Mat(picture->size(), CV_8UC1, cv::Scalar(255));
    } else {
      Result<cv::Mat> mask = planner::load_mask(argument.mask);
      if (!mask.ok()) end(mask.error());
      if (mask->size() != picture->size())
        end(kUnusableArguments, fmt::format("the mask {} has {} x {} pixels, its panel {} x {}", argument.mask,
                                            mask->cols, mask->rows, picture->cols, picture->rows));
      panel.free.pixels = *mask;
    }
    if (cv::countNonZero(panel.free.pixels) == 0)
      end(kUnusableArguments, fmt::format("panel {} has no usable wood: its mask is empty", argument.id));
    stock.push_back(std::move(panel));
  }
  return stock;
}

std::vector<Artwork> load_artworks(const PlanArguments& arguments) {
  std::vector<Artwork> artworks;
  for (const std::string& target : arguments.targets) {
    Result<cv::Mat> picture = planner::load_picture(target);
    if (!picture.ok()) end(picture.error());
    const auto size = planner::artwork_size(*picture, Millimetres(arguments.size_mm));
    artworks.push_back({target, planner::artwork_letter(artworks.size()), *picture, size.width, size.height});
  }
  return artworks;
}

// What CONTRACT.md promises for later versions is refused by name, so that a script never gets something else.
void refuse_what_is_not_there(const PlanArguments& a) {
  const auto unavailable = [](const std::string& option) {
    end(kUnusableArguments, option + " is not available yet in this version");
  };
  if (a.layout != "grid") unavailable("--layout " + a.layout);
  if (a.refine != "none") unavailable("--refine " + a.refine);
  if (a.optimize != "greedy") unavailable("--optimize " + a.optimize);
  if (a.adaptive_levels != 0) unavailable("--adaptive-levels " + std::to_string(a.adaptive_levels));
}

std::set<std::string> wanted_formats(const std::string& list) {
  std::set<std::string> formats;
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t comma = std::min(list.find(',', from), list.size());
    const std::string name = list.substr(from, comma - from);
    if (name == "dxf" || name == "eps" || name == "pdf" || name == "gcode" || name == "egv")
      end(kUnusableArguments, "--format " + name + " is not available yet in this version");
    if (name != "svg" && name != "json") end(kUnusableArguments, fmt::format("\"{}\" is no format of --format", name));
    formats.insert(name);
    from = comma + 1;
  }
  return formats;
}

void make_directory(const fs::path& out) {
  std::error_code failed;
  fs::create_directories(out, failed);
  if (failed || !fs::is_directory(out))
    end(kFailed, fmt::format("the directory {} cannot be made{}", out.string(), failed ? ": " + failed.message() : ""));
  // Found out now rather than after the planning.
  const fs::path probe = out / ".veneerctl-probe";
  if (Status status = planner::write_text("", probe); !status.ok())
    end(kFailed, fmt::format("the directory {} cannot be written to", out.string()));
  fs::remove(probe, failed);
}

std::int64_t peak_rss_bytes() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
}

Status write_previews(const Plan& plan, const std::vector<StockPanel>& stock, const fs::path& out) {
  for (std::size_t i = 0; i < plan.artworks.size(); ++i) {
    const auto preview = planner::assemble_preview(plan, i, stock, ScanResolution::from_dpi(plan.dpi));
    if (!preview.ok()) return preview.error();
    // Several pictures: preview.png is the first, the others carry their letter.
    const fs::path path = out / (i == 0 ? "preview.png" : fmt::format("preview-{}.png", plan.artworks[i].letter));
    bool written = false;
    try {
      written = cv::imwrite(path.string(), preview->pixels);
    } catch (const cv::Exception&) {
      written = false;
    }
    if (!written) return Error{ErrorCode::kStorage, fmt::format("{} cannot be written", path.string())};
  }
  return Ok();
}

Status write_files(const Plan& plan, const std::vector<StockPanel>& stock, const std::set<std::string>& formats,
                   const fs::path& out) {
  // plan.json is always there: everything else can be made from it again.
  if (Status status = planner::write_plan(plan, out / "plan.json"); !status.ok()) return status;
  if (Status status = write_previews(plan, stock, out); !status.ok()) return status;
  if (formats.count("svg") == 0) return Ok();
  for (const planner::PlanPanel& panel : plan.panels) {
    const Result<std::string> svg = planner::cut_svg(plan, panel);
    if (!svg.ok()) return svg.error();
    if (Status status = planner::write_text(*svg, out / fmt::format("cut-{}.svg", panel.id.value)); !status.ok())
      return status;
  }
  return Ok();
}

Result<Plan> plan_with_progress(const std::vector<Artwork>& artworks, const std::vector<StockPanel>& stock,
                                const PlanOptions& options) {
  const InterruptGuard interrupts;
  std::stop_source stop;
  Progress bar(std::cerr, Progress::style_of_stderr());
  const bool terminal = Progress::style_of_stderr() == Progress::Style::kTerminal;
  return planner::make_plan(
      artworks, stock, options,
      [&](double fraction, std::string_view text) {
        if (InterruptGuard::interrupted()) stop.request_stop();
        if (terminal) bar.show(fraction, std::string(text));
      },
      stop.get_token());
}

void run(const PlanArguments& arguments) {
  const auto start = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  refuse_what_is_not_there(arguments);
  const auto formats = wanted_formats(arguments.formats);
  std::vector<PanelArgument> panels;
  for (const std::string& panel : arguments.panels) panels.push_back(panel_argument(panel));
  check_ids(panels);
  if (!(arguments.size_mm > 0 && arguments.size_mm <= 1e5))
    end(kUnusableArguments, "--size-mm must lie between 0 and 100000");

  PlanOptions options = arguments.options;
  options.patch = Millimetres(arguments.patch_mm);
  options.kerf = Millimetres(arguments.kerf_mm);
  options.priority = arguments.priority == "center" ? planner::Priority::kCentre : planner::Priority::kSaliency;
  if (options.threads <= 0) options.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));

  const std::vector<Artwork> artworks = load_artworks(arguments);
  const std::vector<StockPanel> stock = load_panels(panels);
  make_directory(arguments.out);
  planner::ReportSeconds spent;
  spent.load = seconds();
  const Result<Plan> plan = plan_with_progress(artworks, stock, options);
  if (!plan.ok()) end(plan.error());
  if (Status status = write_files(*plan, stock, formats, arguments.out); !status.ok())
    end(kFailed, status.error().message);
  spent.total = seconds();
  const std::string report = planner::report_to_json(*plan, spent, peak_rss_bytes(), options.threads);
  if (Status status = planner::write_text(report, fs::path(arguments.out) / "report.json"); !status.ok())
    end(kFailed, status.error().message);
  if (const std::size_t empty = planner::unfilled(*plan); empty > 0)
    std::cerr << fmt::format("veneerctl plan: warning: no free wood was left for {} of {} patches\n", empty,
                             plan->pieces.size());
}

}  // namespace

void add_plan_command(CLI::App& app) {
  auto arguments = std::make_shared<PlanArguments>();
  CLI::App* plan = app.add_subcommand("plan", "Plan pictures from panel pictures, without a cell");
  plan->add_option("--target", arguments->targets, "A picture to rebuild (repeatable)")->required();
  plan->add_option("--panel", arguments->panels, "IMAGE[,mask=IMAGE][,dpi=300][,id=NAME] (repeatable)")->required();
  plan->add_option("--size-mm", arguments->size_mm, "Shorter side of the picture")->capture_default_str();
  plan->add_option("--patch-mm", arguments->patch_mm, "Side of a patch")->capture_default_str();
  plan->add_option("--rotations", arguments->options.rotations, "Turns of the wood that are tried")
      ->capture_default_str();
  plan->add_option("--dpi", arguments->options.dpi, "Working resolution")->capture_default_str();
  plan->add_option("--w-intensity", arguments->options.w_intensity, "Weight of brightness, 0 to 1")
      ->capture_default_str();
  plan->add_option("--w-edge", arguments->options.w_edge, "Weight of edges, 0 to 1")->capture_default_str();
  plan->add_option("--w-hist", arguments->options.w_hist, "How far tones are mapped to the wood's, 0 to 1")
      ->capture_default_str();
  plan->add_option("--adaptive-levels", arguments->adaptive_levels, "Doublings of the patch size")
      ->capture_default_str();
  plan->add_option("--layout", arguments->layout, "How the picture is cut into patches")
      ->check(CLI::IsMember({"grid", "morph", "mosaic", "segmentation"}))
      ->capture_default_str();
  plan->add_option("--priority", arguments->priority, "Which patches choose first")
      ->check(CLI::IsMember({"saliency", "center"}))
      ->capture_default_str();
  plan->add_option("--refine", arguments->refine, "How borders between patches are refined")
      ->check(CLI::IsMember({"none", "dp"}))
      ->capture_default_str();
  plan->add_option("--optimize", arguments->optimize, "How places are chosen")
      ->check(CLI::IsMember({"greedy", "global"}))
      ->capture_default_str();
  plan->add_option("--kerf-mm", arguments->kerf_mm, "Full width that the beam burns away")->capture_default_str();
  plan->add_option("--seed", arguments->options.seed, "For choices that are drawn")->capture_default_str();
  plan->add_option("--threads", arguments->options.threads, "0: as many as the machine has")->capture_default_str();
  plan->add_option("--format", arguments->formats, "svg, json")->capture_default_str();
  plan->add_option("--out", arguments->out, "Directory for the results")->required();
  plan->callback([arguments] { run(*arguments); });
}

}  // namespace veneer::cli
