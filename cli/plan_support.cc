#include "cli/plan_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
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

std::size_t artwork_of(const planner::Plan& plan, const std::string& letter) {
  if (letter.empty()) return 0;
  const auto found = std::ranges::find(plan.artworks, letter, &planner::PlanArtwork::letter);
  if (found != plan.artworks.end()) return static_cast<std::size_t>(found - plan.artworks.begin());
  std::string letters;
  for (const auto& artwork : plan.artworks) letters += (letters.empty() ? "" : ", ") + artwork.letter;
  end(kUnusableArguments, fmt::format("no picture of the plan has marks with {}: there are {}", letter, letters));
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
  work([&](double fraction, std::string_view text) { bar.show(fraction, std::string(text)); }, stop.get_token());
}

}  // namespace veneer::cli
