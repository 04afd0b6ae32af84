// ./dev gallery: every layout and parameter study of the papers, from the pictures and the wood there are.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/gallery/page.h"
#include "tests/gallery/plan_runs.h"
#include "tests/gallery/sources.h"
#include "tests/gallery/studies.h"
#include "tests/gallery/views.h"

namespace {

using namespace veneer;
using namespace veneer::gallery;
namespace fs = std::filesystem;

constexpr int kLongestSide = 900;  // pixels of a picture on the page
constexpr int kJpegQuality = 90;

struct Arguments {
  fs::path out = "out/gallery";
  std::string data;  // empty: where it is expected
  bool grown = false;
  fs::path studies = fs::path(VENEER_SOURCE) / "tests" / "gallery" / "studies.json";
  std::vector<std::string> only;
};

int refuse(const Error& error) {
  std::fprintf(stderr, "gallery: %s\n", error.message.c_str());
  return 1;
}

class Maker {
 public:
  Maker(Sources& sources, PlanRuns& runs) : sources_(sources), runs_(runs) {}

  ShownView make(const Study& study, std::size_t number) {
    const ViewEntry& view = study.views[number];
    const std::string name = fmt::format("{}-{}", study.key, number + 1);
    ShownView out;
    out.caption = view.caption;
    const Result<cv::Mat> drawn = draw_view(view, name, sources_, runs_);
    if (!drawn.ok()) {
      out.error = drawn.error().message;
      return out;
    }
    if (Status saved = save(*drawn, name, out); !saved) out.error = saved.error().message;
    if (!shows_plan(view.show)) return out;
    const auto run = runs_.run(view.plan, name);  // known by now
    if (!run.ok()) return out;
    out.command = (*run)->command;
    out.figures = (*run)->figures;
    return out;
  }

 private:
  // As it is, and for the page.
  static Status save(const cv::Mat& picture, const std::string& name, ShownView& out) {
    out.full = "pictures/" + name + ".png", out.picture = "pictures/" + name + ".jpg";
    const double scale = std::min(1.0, static_cast<double>(kLongestSide) / std::max(picture.cols, picture.rows));
    cv::Mat small = picture;
    if (scale < 1) cv::resize(picture, small, {}, scale, scale, cv::INTER_AREA);
    out.size = small.size();
    if (!cv::imwrite(out.full, picture) || !cv::imwrite(out.picture, small, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality}))
      return Error{ErrorCode::kStorage, fmt::format("cannot write {}: check the folder and the disk", out.full)};
    return Ok();
  }

  Sources& sources_;
  PlanRuns& runs_;
};

bool is_wanted(const Study& study, const std::vector<std::string>& only) {
  return only.empty() || std::find(only.begin(), only.end(), study.key) != only.end();
}

// What an earlier run left in a folder that it made; nothing else.
void make_empty(const fs::path& out) {
  std::error_code ignored;
  for (const char* folder : {"sources", "plans", "pictures"}) {
    fs::remove_all(out / folder, ignored);
    fs::create_directories(out / folder, ignored);
  }
}

int run(Arguments arguments) {
  const auto start = std::chrono::steady_clock::now();
  const auto studies = read_studies(arguments.studies);
  if (!studies.ok()) return refuse(studies.error());
  fs::path data = arguments.data.empty() ? data_folder() : fs::absolute(arguments.data);
  if (arguments.grown) data.clear();
  const fs::path veneerctl = fs::read_symlink("/proc/self/exe").parent_path() / "veneerctl";
  make_empty(arguments.out);
  std::error_code failed;
  fs::copy_file(fs::path(VENEER_SOURCE) / "tests" / "gallery" / "page.css", arguments.out / "page.css",
                fs::copy_options::overwrite_existing, failed);
  // So that commands name files as they are named on the page.
  if (!failed) fs::current_path(arguments.out, failed);
  if (failed)
    return refuse({ErrorCode::kStorage, fmt::format("cannot write into {} ({}): name another folder",
                                                    arguments.out.string(), failed.message())});
  Sources sources(*studies, data, "sources");
  PlanRuns runs(veneerctl, sources, [](const std::string& command) {
    std::printf("  %s\n", command.c_str());
    std::fflush(stdout);
  });
  Maker maker(sources, runs);
  Gallery gallery;
  gallery.title = studies->title, gallery.lead = studies->lead;
  gallery.made_of = data.empty() ? "Wood grown by the simulated cell, and one portrait: no data folder was there."
                                 : "Photographed wood and pictures of the developer's data set.";
  for (const Paper& paper : studies->papers) {
    ShownPaper shown{&paper, {}};
    for (const Study& study : paper.studies) {
      if (!is_wanted(study, arguments.only)) continue;
      std::printf("%s, %s\n", study.figure.c_str(), study.title.c_str());
      std::fflush(stdout);
      ShownStudy made{&study, {}};
      for (std::size_t i = 0; i < study.views.size(); ++i) {
        made.views.push_back(maker.make(study, i));
        if (!made.views.back().error.empty())
          std::fprintf(stderr, "gallery: %s, \"%s\": %s\n", study.key.c_str(), made.views.back().caption.c_str(),
                       made.views.back().error.c_str());
      }
      shown.studies.push_back(std::move(made));
    }
    if (!shown.studies.empty()) gallery.papers.push_back(std::move(shown));
  }
  if (gallery.papers.empty())
    return refuse({ErrorCode::kNotFound, "--only names no study: keys are in " + arguments.studies.string()});
  gallery.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (Status written = write_page(gallery, "index.html"); !written) return refuse(written.error());
  if (Status written = write_report(gallery, "report.json"); !written) return refuse(written.error());
  std::printf("%s\n", fs::absolute("index.html").c_str());
  const std::size_t missed = failures(gallery);
  if (missed > 0) std::fprintf(stderr, "gallery: %zu pictures failed, the page says which\n", missed);
  return missed == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  // A picture that cannot be read is told once, by whoever wanted it.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  Arguments arguments;
  CLI::App app{"every layout and parameter study of the papers on one page", "veneer-gallery"};
  app.add_option("--out", arguments.out, "where the page goes")->capture_default_str();
  app.add_option("--data", arguments.data,
                 "folder with targets/ and wood/ (default: VENEER_DATA, or beside the sources)")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--grown", arguments.grown, "use wood that is grown here and Debian's portrait, whatever data there is");
  app.add_option("--studies", arguments.studies, "list of studies, JSON")->capture_default_str();
  app.add_option("--only", arguments.only, "key of a study; the page has no others (repeatable)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  arguments.studies = fs::absolute(arguments.studies);
  return run(std::move(arguments));
}
