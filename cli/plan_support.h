// What the commands that run the planner share: how they end, show progress and write pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <stop_token>
#include <string>
#include <utility>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::cli {

// The sentence on stderr; ends the command. Of an Error: kUnusableArguments when the caller's input is to be mended,
// otherwise kWorkFailed (command_context.h).
[[noreturn]] void end(int status, const std::string& sentence);
[[noreturn]] void end(const Error& error);

template <class T>
T or_end(Result<T> result) {
  if (!result.ok()) end(result.error());
  return std::move(*result);
}
// What cannot be written is no fault of the arguments.
void or_fail(const Status& written);

// Makes the directory, with its parents, and tries to write in it: found out now rather than after the planning.
void make_directory(const std::filesystem::path& out);

Status write_picture(const cv::Mat& picture, const std::filesystem::path& path);

// A plan's file, which has a picture; ends the command otherwise.
planner::Plan plan_of_file(const std::string& file);
// The artwork that `named` means: by a mark of one of its pieces or its letter, or else by its target; the first
// without a name. Ends the command when it means none, or several.
std::size_t artwork_of(const planner::Plan& plan, const std::string& named);

// Runs `work` with its progress on stderr (progress.h); the first Ctrl-C requests its stop.
void with_progress(const std::function<void(const planner::Progress& progress, std::stop_token stop)>& work);

}  // namespace veneer::cli
