// ./dev demo: the whole cell on the desk, from calibration to two finished jobs, proven by the twin's own truth.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "tests/demo/figures.h"
#include "tests/demo/moth.h"
#include "tests/demo/story.h"

namespace {

using namespace veneer;
using namespace veneer::tests;
namespace fs = std::filesystem;

class Teller final : public Narrator {
 public:
  void progress(const std::string& stage, double fraction, const std::string& text) override {
    if (!tty_) return;
    constexpr int kWidth = 24;
    const int full = static_cast<int>(fraction * kWidth);
    std::printf("\r\033[K%-20s [%s%s] %s", stage.c_str(), std::string(static_cast<std::size_t>(full), '#').c_str(),
                std::string(static_cast<std::size_t>(kWidth - full), '.').c_str(), text.c_str());
    std::fflush(stdout);
  }
  void done(const std::string& stage, const std::string& text, double seconds) override {
    std::printf("%s%-20s %s  (%.1f s)\n", tty_ ? "\r\033[K" : "", stage.c_str(), text.c_str(), seconds);
    std::fflush(stdout);
  }

 private:
  bool tty_ = isatty(STDOUT_FILENO) != 0;
};

struct Arguments {
  fs::path out = "out";
  std::uint64_t seed = 1;
  fs::path picture = "/usr/share/matplotlib/mpl-data/sample_data/grace_hopper.jpg";
  double time_scale = 80;
  std::string preset = "bench";
};

// The head, cut out of the portrait's middle: of a half-figure in pieces of this size nothing can be recognised, and
// the features alone look like a mask. Cap and chin make a person of them.
Result<fs::path> head_of(const fs::path& portrait, const fs::path& out) {
  const cv::Mat whole = cv::imread(portrait.string());
  if (whole.empty())
    return Error{ErrorCode::kNotFound, fmt::format("cannot read the picture {}: install python-matplotlib-data or name "
                                                   "another with --picture",
                                                   portrait.string())};
  const int w = whole.cols, h = whole.rows;
  const cv::Rect head(w * 24 / 100, h * 3 / 100, w * 54 / 100, h * 54 / 100);
  const fs::path file = out / "target.png";
  if (!cv::imwrite(file.string(), whole(head)))
    return Error{ErrorCode::kStorage, fmt::format("cannot write {}", file.string())};
  return file;
}

// As an operator would who is told that no free wood is left: smaller pieces fit where the first job left scraps.
Status plan_with_what_is_left(Story& story, StoryJob job) {
  constexpr double kSmaller = 0.8;
  constexpr double kSmallestPatch = 6;  // mm: of smaller ones some pieces would be below the paper's 5
  Status planned = story.plan(job);
  while (!planned && planned.error().code == ErrorCode::kRefused && job.patch_mm * kSmaller >= kSmallestPatch) {
    std::printf("%s: %s\n", job.name.c_str(), planned.error().message.c_str());
    job.size_mm *= kSmaller, job.patch_mm *= kSmaller;
    planned = story.plan(job);
  }
  return planned;
}

Status tell_all(Story& story, const Arguments& arguments, const fs::path& bin_dir) {
  if (Status s = story.calibrate(); !s) return s;
  for (const StoryPanel& panel : {StoryPanel{"large", 420, 280}, StoryPanel{"small", 290, 210}})
    if (Status s = story.scan_panel(panel); !s) return s;
  auto head = head_of(arguments.picture, arguments.out);
  if (!head) return head.error();
  const fs::path moth = arguments.out / "second-target.png";
  if (!cv::imwrite(moth.string(), moth_picture()))
    return Error{ErrorCode::kStorage, fmt::format("cannot write {}", moth.string())};
  // A face needs all tones of the wood in one family of colours, eyes and mouth set off, and many pieces; narrower than
  // 8 mm they would stay in the panel, by bridges.
  const std::map<std::string, std::string> options = {{"w_hist", "0.3"},   {"w_range", "1"}, {"w_detail", "0.9"},
                                                      {"w_colour", "0.5"}, {"w_gamut", "1"}, {"layout", "mosaic"}};
  // What was drawn in tones of wood needs none of that, only what is left of them.
  const std::map<std::string, std::string> plain = {
      {"w_hist", "0.2"}, {"w_range", "1"}, {"w_colour", "0.5"}, {"w_gamut", "0.7"}, {"layout", "mosaic"}};
  const StoryJob jobs[] = {{*head, "portrait", 189, 9, options}, {moth, "second picture", 86, 10, plain}};
  for (const auto& job : jobs) {
    if (Status s = plan_with_what_is_left(story, job); !s) return s;
    if (Status s = story.cut(story.jobs().back()); !s) return s;
    if (Status s = story.reconcile(story.jobs().back()); !s) return s;
  }
  if (Status s = story.save_pictures(); !s) return s;
  return story.prove(bin_dir);
}

int run(const Arguments& arguments) {
  const fs::path bin_dir = fs::read_symlink("/proc/self/exe").parent_path();
  std::error_code ignored;
  fs::create_directories(arguments.out, ignored);
  fs::remove_all(arguments.out / "cell", ignored);
  std::printf("demo, seed %llu, %s, into %s\n", static_cast<unsigned long long>(arguments.seed),
              arguments.preset.c_str(), arguments.out.c_str());
  auto cell = SimulatedCell::start({arguments.out / "cell", bin_dir, arguments.seed, arguments.time_scale,
                                    "preset = \"" + arguments.preset + "\"\n"});
  if (!cell) {
    std::fprintf(stderr, "demo: %s\n", cell.error().message.c_str());
    return 1;
  }
  Teller teller;
  Story story(**cell, arguments.out, teller);
  const Status told = tell_all(story, arguments, bin_dir);
  story.report()["schema_version"] = 1;
  story.report()["seed"] = arguments.seed;
  story.report()["preset"] = arguments.preset;
  std::ofstream(arguments.out / "report.json") << story.report().dump(2) << '\n';
  if (!told) {
    std::fprintf(stderr, "demo (seed %llu): %s\n", static_cast<unsigned long long>(arguments.seed),
                 told.error().message.c_str());
    return 1;
  }
  const auto red = red_figures(story.report());
  for (const auto& figure : red)
    std::fprintf(stderr, "demo (seed %llu): %s\n", static_cast<unsigned long long>(arguments.seed), figure.c_str());
  std::printf("%s; pictures and report.json are in %s\n", red.empty() ? "every figure holds" : "figures were missed",
              arguments.out.c_str());
  return red.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"the whole cell on the desk: scan, plan, cut and prove", "veneer-demo"};
  app.add_option("--out", arguments.out, "where pictures and report.json go");
  app.add_option("--seed", arguments.seed, "draws wood, layout, poses, warp and noise");
  app.add_option("--picture", arguments.picture, "a portrait; what the jobs rebuild is its middle");
  app.add_option("--time-scale", arguments.time_scale, "device time per real time")->check(CLI::Range(1.0, 1000.0));
  app.add_option("--rough", arguments.preset, "how unkind the twin's workshop is; on the bench unless told otherwise")
      ->check(CLI::IsMember({"bench", "workshop", "rough"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return run(arguments);
}
