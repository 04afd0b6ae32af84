#include "cli/plan_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <set>
#include <thread>

#include "cli/command_context.h"
#include "cli/progress.h"
#include "planner/files/plan_files.h"
#include "planner/pictures/png_codec.h"

namespace veneer::cli {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kLook{10};  // between looks for a Ctrl-C

void end(int status, const std::string& sentence) { fail({ErrorCode::kInvalidArgument, sentence}, status); }

void end(const Error& error) {
  const bool input = error.code == ErrorCode::kInvalidArgument || error.code == ErrorCode::kNotFound;
  fail(error, input ? kUnusableArguments : kWorkFailed);
}

void or_fail(const Status& written) {
  if (!written.ok()) fail(written.error(), kWorkFailed);
}

void make_directory(const fs::path& out) {
  std::error_code failed;
  fs::create_directories(out, failed);
  if (failed || !fs::is_directory(out))
    end(kWorkFailed,
        fmt::format("the directory {} cannot be made{}", out.string(), failed ? ": " + failed.message() : ""));
  const fs::path probe = out / ".veneerctl-probe";
  if (!planner::write_text("", probe).ok())
    end(kWorkFailed, fmt::format("the directory {} cannot be written to", out.string()));
  fs::remove(probe, failed);
}

Status write_picture(const cv::Mat& picture, const fs::path& path) {
  const auto file = planner::encode_png(picture);
  if (!file) return Error{ErrorCode::kStorage, fmt::format("{} cannot be made", path.string())};
  return planner::write_text(*file, path);
}

planner::Plan plan_of_file(const std::string& file) {
  if (std::filesystem::is_directory(file))
    end(kUnusableArguments, fmt::format("{} is a folder: name the plan.json in it", file));
  planner::Plan plan = or_end(planner::read_plan(file));
  if (plan.artworks.empty()) end(kUnusableArguments, fmt::format("{} has no picture", file));
  return plan;
}

std::size_t artwork_of(const planner::Plan& plan, const std::string& named) {
  if (named.empty()) return 0;
  std::set<std::size_t> meant;
  for (const planner::Piece& piece : plan.pieces)
    if (piece.mark == named) meant.insert(piece.artwork);
  std::string there;
  for (std::size_t a = 0; a < plan.artworks.size(); ++a) {
    const planner::PlanArtwork& artwork = plan.artworks[a];
    if (artwork.letter == named) meant.insert(a);
    there += fmt::format("{}{} ({})", a == 0 ? "" : ", ", artwork.letter, artwork.name);
  }
  const bool is_on_the_bench = !meant.empty();  // before files, whatever these are called
  for (std::size_t a = 0; a < plan.artworks.size() && !is_on_the_bench; ++a)
    if (plan.artworks[a].name == named) meant.insert(a);
  if (meant.size() == 1) return *meant.begin();
  if (meant.empty())
    end(kUnusableArguments,
        fmt::format("no picture of the plan is called {}, nor has such marks: there are {}", named, there));
  if (!is_on_the_bench)
    end(kUnusableArguments,
        fmt::format("{} is the file of {} pictures of the plan: name the one that is meant by its letter, of {}", named,
                    meant.size(), there));
  end(kUnusableArguments,
      fmt::format("{} is the letter of one picture of the plan and a mark of another: name another piece of the one "
                  "that is meant",
                  named));
}

void with_progress(const std::function<void(const planner::Progress&, std::stop_token)>& work) {
  const InterruptGuard interrupts;
  std::stop_source stop;
  Progress bar(std::cerr, Progress::style_of_stderr());
  // Progress is told too seldom, and not in all that planning does, for a stop within a tenth of a second.
  const std::jthread watcher([&stop](const std::stop_token& over) {
    while (!over.stop_requested() && !InterruptGuard::interrupted()) std::this_thread::sleep_for(kLook);
    if (InterruptGuard::interrupted()) stop.request_stop();
  });
  const auto tell = [&](double fraction, std::string_view text) {
    bar.show(fraction, std::string(text));
    // Who answers a line with Ctrl-C, before it is written to its end, stops what it tells of.
    if (InterruptGuard::interrupted()) stop.request_stop();
  };
  work(tell, stop.get_token());
}

}  // namespace veneer::cli
