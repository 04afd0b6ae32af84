#include "cli/plan_command.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/hash.h"
#include "cli/command_context.h"
#include "cli/plan_arguments.h"
#include "cli/plan_edits.h"
#include "cli/plan_suggestions.h"
#include "cli/plan_support.h"
#include "planner/cutting/cut_drawing.h"
#include "planner/files/as_built.h"
#include "planner/files/plan_files.h"
#include "planner/files/plan_journal.h"
#include "planner/files/plan_report.h"
#include "planner/files/preview.h"
#include "planner/files/tile_picture.h"
#include "planner/grain/grain_coherence.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;
using planner::Artwork;
using planner::Plan;
using planner::PlanOptions;
using planner::StockPanel;
using Clock = std::chrono::steady_clock;

struct PlanCommandArguments {
  PlanArguments plan;
  EditArguments edits;
  std::string formats = "svg,json";
  std::string out;
  bool best_so_far = false;  // where Ctrl-C stops it
  bool suggest = false, as_built = false, full_preview = false, cut_lines = false, tiles = false, mean_colours = false;
  double distance_m = 0;
  std::string putty;
  std::string tile_colour = "area", grout;
};

std::string known_formats() {
  std::string names;
  for (const planner::CutFormat& format : planner::kCutFormats) names += fmt::format("{}, ", format.name);
  return names + "json";
}

std::set<std::string> wanted_formats(const std::string& list) {
  std::set<std::string> formats;
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t comma = std::min(list.find(',', from), list.size());
    const std::string name = list.substr(from, comma - from);
    const bool known = name == "json" || std::any_of(std::begin(planner::kCutFormats), std::end(planner::kCutFormats),
                                                     [&](const auto& format) { return format.name == name; });
    if (!known)
      end(kUnusableArguments, fmt::format("\"{}\" is no format of --format: there are {}", name, known_formats()));
    formats.insert(name);
    from = comma + 1;
  }
  return formats;
}

// How pictures are to be shown beside preview.png.
struct Looks {
  std::optional<planner::AsBuilt> as_built{};
  bool full = false, cut_lines = false, mean_colours = false;
  std::optional<planner::TileLook> tiles{};
};

Looks wanted_looks(const PlanCommandArguments& arguments) {
  Looks looks;
  looks.full = arguments.full_preview, looks.cut_lines = arguments.cut_lines;
  looks.mean_colours = arguments.mean_colours;
  if (arguments.tiles) {
    looks.tiles.emplace();
    looks.tiles->colour = arguments.tile_colour == "point" ? planner::TileColour::kPoint : planner::TileColour::kArea;
    if (!arguments.grout.empty()) looks.tiles->grout = or_end(planner::colour_of(arguments.grout));
  }
  if (!arguments.as_built) return looks;
  looks.as_built.emplace();
  looks.as_built->distance = Millimetres(arguments.distance_m * 1000);
  if (!arguments.putty.empty()) looks.as_built->putty = or_end(planner::colour_of(arguments.putty));
  return looks;
}

std::int64_t peak_rss_bytes() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
}

constexpr double kTileDpi = 96;  // at least, of tiles.png: it shows no wood, and borders ask for pixels

struct Previews {
  planner::PreviewCost cost;
  planner::GrainCoherence grain;
};

// Several pictures: preview.png is of the first, the others' carry their letters.
fs::path picture_file(const fs::path& out, const Plan& plan, std::size_t artwork, std::string_view name,
                      std::string_view ending = "png") {
  return out / (artwork == 0 ? fmt::format("{}.{}", name, ending)
                             : fmt::format("{}-{}.{}", name, plan.artworks[artwork].letter, ending));
}

Status write_tiles(const Plan& plan, const std::vector<Artwork>& artworks, const planner::TileLook& look,
                   const fs::path& out) {
  for (const planner::MosaicTiling& tiling : plan.tilings) {
    const planner::PlanArtwork& artwork = plan.artworks[tiling.artwork];
    const cv::Mat& picture = artworks[tiling.artwork].picture;
    const cv::Mat drawn =
        planner::draw_tiles(tiling, artwork, picture, look, ScanResolution::from_dpi(std::max(plan.dpi, kTileDpi)));
    if (Status status = write_picture(drawn, picture_file(out, plan, tiling.artwork, "tiles")); !status.ok())
      return status;
    if (Status status = planner::write_text(planner::tiles_svg(tiling, artwork, picture, look),
                                            picture_file(out, plan, tiling.artwork, "tiles", "svg"));
        !status.ok())
      return status;
  }
  return Ok();
}

Status write_full_preview(const Plan& plan, std::size_t artwork, const std::vector<StockPanel>& stock, bool cut_lines,
                          const fs::path& path) {
  const auto resolution = planner::full_resolution(plan, artwork);
  if (!resolution.ok()) return resolution.error();
  auto preview = planner::assemble_preview(plan, artwork, stock, *resolution);
  if (!preview.ok()) return preview.error();
  if (cut_lines)
    if (Status status = planner::draw_cut_lines(plan, artwork, *preview); !status.ok()) return status;
  return write_picture(preview->pixels, path);
}

// Adds what the previews say to `figures`.
Status write_previews(const Plan& plan, const std::vector<StockPanel>& stock, const PlanOptions& options,
                      const Looks& looks, const fs::path& out, Previews& figures) {
  for (std::size_t i = 0; i < plan.artworks.size(); ++i) {
    const auto preview = planner::assemble_preview(plan, i, stock, ScanResolution::from_dpi(plan.dpi));
    if (!preview.ok()) return preview.error();
    const auto own_cost = planner::preview_cost(plan, i, *preview, options);
    if (!own_cost.ok()) return own_cost.error();
    figures.cost += *own_cost;
    figures.grain += planner::grain_coherence(plan, i, *preview);
    if (Status status = write_picture(preview->pixels, picture_file(out, plan, i, "preview")); !status.ok())
      return status;
    if (looks.full)
      if (Status status = write_full_preview(plan, i, stock, looks.cut_lines, picture_file(out, plan, i, "full"));
          !status.ok())
        return status;
    if (looks.mean_colours) {
      const auto means = planner::in_mean_colours(plan, i, *preview);
      if (!means.ok()) return means.error();
      if (Status status = write_picture(*means, picture_file(out, plan, i, "mean")); !status.ok()) return status;
    }
    if (!looks.as_built) continue;
    const auto built = planner::as_built(plan, i, preview->pixels, *looks.as_built);
    if (!built.ok()) return built.error();
    if (Status status = write_picture(*built, picture_file(out, plan, i, "as-built")); !status.ok()) return status;
  }
  return Ok();
}

Status write_cut_drawings(const Plan& plan, const std::set<std::string>& formats, const fs::path& out,
                          std::vector<std::string>& warnings) {
  for (const planner::PlanPanel& panel : plan.panels) {
    const Result<planner::CutDrawing> drawing = planner::draw_cuts(plan, panel);
    if (!drawing.ok()) return drawing.error();
    for (const std::string& warning : drawing->warnings)
      warnings.push_back(plan.panels.size() > 1 ? fmt::format("panel {}: {}", panel.id.value, warning) : warning);
    for (const planner::CutFormat& format : planner::kCutFormats) {
      if (formats.count(std::string(format.name)) == 0) continue;
      const fs::path path = out / fmt::format("cut-{}.{}", panel.id.value, format.name);
      if (Status status = planner::write_text(format.write(*drawing), path); !status.ok()) return status;
    }
  }
  return Ok();
}

// Adds to the plan's warnings what the cut files had to leave out, and to `figures` what the previews say.
Status write_files(Plan& plan, const std::vector<StockPanel>& stock, const PlanOptions& options, const Looks& looks,
                   const std::set<std::string>& formats, const fs::path& out, Previews& figures) {
  std::vector<std::string> left_out;
  auto drawn = std::async(std::launch::async, [&] {
    return formats == std::set<std::string>{"json"} ? Status(Ok()) : write_cut_drawings(plan, formats, out, left_out);
  });
  Status shown = write_previews(plan, stock, options, looks, out, figures);
  if (Status status = drawn.get(); !status.ok()) return status;
  plan.warnings.insert(plan.warnings.end(), left_out.begin(), left_out.end());
  return shown;
}

// A run that was killed goes on where it was: the same command again, in the same directory. `settings`: of the rest.
Plan plan_with_journal(const std::vector<Artwork>& artworks, const std::vector<StockPanel>& stock,
                       const PlanOptions& options, const std::string& settings, planner::OnStop on_stop,
                       const fs::path& path) {
  // Another build of this program may choose otherwise.
  const std::string program = or_end(sha256_hex_of_file("/proc/self/exe"));
  planner::PlanJournal journal = or_end(planner::PlanJournal::open(path, planner::plan_key(settings, program)));
  if (journal.goes_on()) std::cerr << "veneerctl: going on where an earlier run stopped\n";
  std::optional<Result<Plan>> plan;
  with_progress([&](const planner::Progress& progress, const std::stop_token& stop) {
    plan = planner::make_plan(artworks, stock, options, progress, stop, &journal, nullptr, on_stop);
  });
  if (plan->ok()) return std::move(**plan);
  if (plan->error().code == ErrorCode::kCancelled)
    end({ErrorCode::kCancelled, plan->error().message + ": the same command goes on where it stopped"});
  std::error_code ignored;
  fs::remove(path, ignored);
  end(plan->error());
}

// Ends the command where a better plan stays.
void keep_better_plan(const Plan& plan, const std::string& settings, const fs::path& out) {
  const fs::path file = out / "plan.json", report = out / "report.json";
  const auto there = planner::read_report(report);
  std::error_code ignored;
  if (!there || !plan.stopped || there->hashes.inputs != settings || !fs::exists(file, ignored)) return;
  // Changed by hand, say, or of a run that was killed before its report: nobody knows whether it is the better one.
  if (!planner::is_of(*there, file))
    end({ErrorCode::kCancelled,
         fmt::format(
             "planning was cancelled, no result was written, and {0} stays: {1} is of another plan, so it is "
             "not known which of the two is better; move {0} elsewhere, or let the same command go on to its end",
             file.string(), report.string())});
  if (!planner::stays(*there, planner::figures_of(plan), settings)) return;
  end({ErrorCode::kCancelled,
       fmt::format("planning was cancelled, no result was written, and {} stays, {} of the same pictures, wood and "
                   "options: the same command goes on where it stopped",
                   file.string(), there->figures.stopped ? "a better plan" : "the whole plan")});
}

// The first few; the report has them all.
void warn(const std::vector<std::string>& warnings) {
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, warnings.size()); ++i)
    std::cerr << "veneerctl: warning: " << warnings[i] << "\n";
  if (warnings.size() > kShown)
    std::cerr << fmt::format("veneerctl: {} more warnings are in report.json\n", warnings.size() - kShown);
}

// What the global optimisation did, in a sentence.
void tell_gain(const planner::GlobalReport& global) {
  const std::string stopped =
      global.stopped ? fmt::format(", stopped after {} of {} iterations", global.iterations, global.budget) : "";
  if (global.unfilled < global.greedy_unfilled) {
    std::cerr << fmt::format("veneerctl: {} patches more than greedy are filled{}\n",
                             global.greedy_unfilled - global.unfilled, stopped);
  } else {
    std::cerr << fmt::format("veneerctl: cost {:.2f} instead of greedy's {:.2f} ({:.1f} % less){}\n", global.cost,
                             global.greedy_cost,
                             global.greedy_cost > 0 ? 100 * (1 - global.cost / global.greedy_cost) : 0.0, stopped);
  }
}

// For the end of such a sentence.
const char* if_stopped(bool stopped) { return stopped ? ", stopped before the end" : ""; }

void tell_gain(const planner::RefineReport& refined) {
  if (refined.stopped && refined.cost_refined == refined.cost_before) {
    std::cerr << "veneerctl: borders are as they were, stopped before they were refined\n";
    return;
  }
  const auto less = [&](double cost) { return refined.cost_before > 0 ? 100 * (1 - cost / refined.cost_before) : 0.0; };
  std::cerr << fmt::format("veneerctl: borders refined, cost {:.2f} instead of {:.2f} ({:.1f} % less){}\n",
                           refined.cost_refined, refined.cost_before, less(refined.cost_refined),
                           if_stopped(refined.stopped));
  if (!refined.rounds.empty())
    std::cerr << fmt::format(
        "veneerctl: wood chosen again {} times for the refined shapes, cost {:.2f} ({:.1f} % less)\n",
        refined.rounds.size(), refined.cost, less(refined.cost));
}

void tell_gain(const planner::FineReport& fine) {
  std::cerr << fmt::format("veneerctl: {} pieces turned finely, cost {:.2f} instead of {:.2f} ({:.1f} % less){}\n",
                           fine.moved, fine.cost, fine.cost_before,
                           fine.cost_before > 0 ? 100 * (1 - fine.cost / fine.cost_before) : 0.0,
                           if_stopped(fine.stopped));
}

void tell_tiles(const planner::TilesReport& tiles) {
  std::cerr << fmt::format(
      "veneerctl: tiles with joints cover {:.0f} % of the picture; {:.1f} % of their area overlaps, they lie {:.1f} "
      "degrees off the lines (median), an edge runs through {:.1f} %\n",
      100 * tiles.coverage, 100 * tiles.overlap, tiles.deviation_deg, 100 * tiles.straddling);
}

void run_plan(const PlanCommandArguments& arguments) {
  const auto start = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  if (arguments.out.empty()) end(kUnusableArguments, "--out \"\" names no directory");
  const auto formats = wanted_formats(arguments.formats);
  const Looks looks = wanted_looks(arguments);
  PlanOptions options = or_end(plan_options(arguments.plan));
  if (arguments.plan.copies < 1 || arguments.plan.copies > 1000)
    end(kUnusableArguments, "--repeat must lie between 1 and 1000");
  if (!arguments.edits.keep.empty() && arguments.plan.files.guide_a_grid())
    end(kUnusableArguments, "a plan that is kept keeps its borders: leave --guides out, and what names edges");
  if (!arguments.edits.keep.empty() && arguments.plan.files.guide_a_mosaic())
    end(kUnusableArguments, "a plan that is kept keeps its borders: leave --cell-sizes and --flow-lines out");
  if (!arguments.edits.keep.empty() && (options.cell_aspect != 1 || options.flow_lines_only))
    end(kUnusableArguments, "a plan that is kept keeps its borders: leave --cell-aspect and --flow-lines-only out");
  if (!arguments.edits.keep.empty() && !arguments.plan.files.segmentation.empty())
    end(kUnusableArguments, "a plan that is kept keeps its borders: leave --segmentation out");
  if (arguments.tiles && (options.layout != planner::LayoutKind::kMosaic || !arguments.edits.keep.empty()))
    end(kUnusableArguments, "--tiles draws the tiles of a new mosaic: add --layout mosaic, and leave --keep out");
  // The wood's pictures are the large ones: they are read beside the targets.
  auto panels = std::async(std::launch::async, [&] { return load_panels(arguments.plan); });
  Result<std::vector<Artwork>> targets = load_artworks(arguments.plan);
  Result<std::vector<StockPanel>> wood = panels.get();
  std::vector<Artwork> artworks = or_end(std::move(targets));
  for (Artwork& artwork : artworks) artwork.tiles_with_joints = arguments.tiles;
  std::vector<StockPanel> stock = or_end(std::move(wood));
  if (const Status status = apply_edits(arguments.edits, stock, options); !status.ok()) end(status.error());
  make_directory(arguments.out);
  planner::ReportSeconds spent;
  spent.load = seconds();
  const fs::path journal = fs::path(arguments.out) / "plan.journal", told = fs::path(arguments.out) / "report.json";
  const std::string settings = planner::settings_key(artworks, stock, options);
  Plan plan =
      plan_with_journal(artworks, stock, options, settings,
                        arguments.best_so_far ? planner::OnStop::kBestSoFar : planner::OnStop::kCancel, journal);
  keep_better_plan(plan, settings, arguments.out);
  // plan.json is always there: everything else can be made from it again.
  const std::string text = planner::plan_to_json(plan);
  or_fail(planner::write_text_whole(text, fs::path(arguments.out) / "plan.json"));
  std::error_code ignored;
  fs::remove(told, ignored);  // of the plan before; should it outlive this, its hash says so
  Previews preview;
  or_fail(write_files(plan, stock, options, looks, formats, arguments.out, preview));
  if (looks.tiles) or_fail(write_tiles(plan, artworks, *looks.tiles, arguments.out));
  spent.total = seconds();
  const std::string report = planner::report_to_json(plan, spent, peak_rss_bytes(), options.threads,
                                                     {preview.cost.per_pixel(), preview.grain.mean()},
                                                     {settings, sha256_hex(std::as_bytes(std::span(text)))});
  or_fail(planner::write_text_whole(report, told));
  if (plan.mosaic && plan.mosaic->with_joints) tell_tiles(*plan.mosaic->with_joints);
  if (plan.global) tell_gain(*plan.global);
  if (plan.fine) tell_gain(*plan.fine);
  if (plan.refined) tell_gain(*plan.refined);
  warn(plan.warnings);
  if (plan.stopped) {
    std::cerr << "veneerctl: this is the best plan so far, not the whole: the same command goes on from there\n";
    return;
  }
  fs::remove(journal, ignored);
}

// As a shell takes it.
std::string quoted(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./,=:+@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// What was named on the command line, but for what a suggestion decides.
std::string given_options(const CLI::App& plan) {
  static const std::set<std::string> kDecided{"--suggest", "--out", "--crop", "--layout", "--size-mm", "--patch-mm"};
  std::string out;
  for (const CLI::Option* option : plan.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || kDecided.count(name) == 1) continue;
    const bool is_switch = option->get_items_expected_max() == 0;
    for (const std::string& value : option->results()) {
      if (!out.empty()) out += ' ';
      out += is_switch ? name : name + ' ' + quoted(value);
    }
  }
  return out;
}

}  // namespace

void add_plan_command(CLI::App& app) {
  auto arguments = std::make_shared<PlanCommandArguments>();
  CLI::App* plan = app.add_subcommand("plan", "Plan pictures from panel pictures, without a cell");
  add_plan_arguments(*plan, arguments->plan);
  plan->add_option("--repeat", arguments->plan.copies, "How many times to plan each picture")->capture_default_str();
  plan->add_flag(
      "--interleave", arguments->plan.options.interleave,
      "Let the patches of all pictures choose together, the most salient first, instead of picture after picture");
  plan->add_option(
          "--reserve", arguments->plan.options.reserve,
          "Without --interleave: the share of each picture's patches, its most salient, that choose before all "
          "others")
      ->capture_default_str();
  add_edit_arguments(*plan, arguments->edits);
  plan->add_option(
          "--format", arguments->formats,
          "What to write, of " + known_formats() + "; svg, dxf and eps are cut files; plan.json is always written")
      ->capture_default_str();
  CLI::Option* as_built = plan->add_flag(
      "--as-built", arguments->as_built,
      "Draw as-built.png too: the picture with its joints and the wood that the beam browns beside them");
  plan->add_option("--distance-m", arguments->distance_m,
                   "With --as-built: the distance it is seen from, in metres; 0: from close by")
      ->needs(as_built)
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  plan->add_option("--putty", arguments->putty,
                   "With --as-built: colour of what fills the joints, as RRGGBB [they stay open]")
      ->needs(as_built);
  CLI::Option* full = plan->add_flag(
      "--full-preview", arguments->full_preview,
      "Draw full.png too: the picture with every pixel that the panels' pictures have, whatever --dpi is");
  plan->add_flag("--cut-lines", arguments->cut_lines, "With --full-preview: draw where the laser cuts")->needs(full);
  plan->add_flag("--mean-colours", arguments->mean_colours,
                 "Draw mean.png too: the picture with each piece in one colour, the mean of its wood, to see what its "
                 "grain adds");
  CLI::Option* tiles = plan->add_flag(
      "--tiles", arguments->tiles,
      "With --layout mosaic: draw tiles.png and tiles.svg too, the same mosaic as tiles in flat colours with joints "
      "between them");
  plan->add_option("--tile-colour", arguments->tile_colour,
                   "With --tiles: area (the mean of what a tile covers) or point (the colour at its middle)")
      ->needs(tiles)
      ->check(CLI::IsMember({"area", "point"}))
      ->capture_default_str();
  plan->add_option("--grout", arguments->grout, "With --tiles: colour of the joints, as RRGGBB [8c8276]")->needs(tiles);
  plan->add_flag("--best-so-far", arguments->best_so_far,
                 "At Ctrl-C write the best plan so far, once every patch has had its turn, instead of none");
  plan->add_option("--out", arguments->out, "Directory for the results")->required();
  plan->add_flag(
      "--suggest", arguments->suggest,
      "Plan nothing, but say at which crop, size, patches and layout the picture is recognisable in this wood: a "
      "contact sheet of small plans, with the command for each");
  plan->callback([arguments, plan] {
    if (!arguments->suggest) {
      if (!arguments->edits.keep.empty() && plan->get_option("--marks")->count() > 0)
        end(kUnusableArguments, "a plan that is kept keeps its marks, short or not: leave --marks out");
      return run_plan(*arguments);
    }
    // What else is drawn of a plan goes well with any that is suggested.
    if (arguments->tiles)
      end(kUnusableArguments,
          "--suggest draws no tiles: leave --tiles out, and add it to a command that it prints, with --layout mosaic");
    if (arguments->best_so_far)
      end(kUnusableArguments,
          "--suggest makes no plan that Ctrl-C could stop: leave --best-so-far out, and add it to a command that it "
          "prints");
    run_suggest(arguments->plan, arguments->edits, given_options(*plan), arguments->out);
    if (arguments->mean_colours || arguments->as_built || arguments->full_preview)
      std::cerr << "veneerctl: pictures of a plan beside its preview are drawn by the commands that are suggested, not "
                   "by --suggest\n";
  });
}

}  // namespace veneer::cli
