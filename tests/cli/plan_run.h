// `veneerctl plan` as a user runs it: a panel of grown wood and a picture in a folder of their own, and what a run of
// the command said. One thread.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include "tests/support/synthetic_wood.h"

namespace veneer::planner {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Outcome {
  int status = -1;
  std::string errors;
};

class PlanRun : public ::testing::Test {
 protected:
  PlanRun() : folder_(fs::temp_directory_path() / ("plan_run_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    const StockPanel panel = test::wood_panel("P", 150, 120, 50.8, 3);
    cv::imwrite(path("panel.png"), panel.picture.pixels);
    cv::imwrite(path("mask.png"), panel.free.pixels);
    cv::imwrite(path("target.png"), test::blob_artwork("A", 60, 40, 20_mm, 4).picture);
  }
  ~PlanRun() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    std::ostringstream out;
    out << file.rdbuf();
    return out.str();
  }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(text(name)); }

  Outcome plan(const std::string& arguments) const { return run("plan " + arguments); }
  Outcome run(const std::string& arguments) const {
    const std::string command =
        std::string(VENEERCTL) + " " + arguments + " 2>" + path("stderr") + " >" + path("stdout");
    const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe): a test has one thread here
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("stderr")};
  }
  std::string usual() const {
    return "--target " + path("target.png") + " --panel " + path("panel.png") + ",mask=" + path("mask.png") +
           ",dpi=50.8,id=P --size-mm 21 --patch-mm 7 --dpi 50.8 --rotations 5 --out " + path("out");
  }
  void expect_unusable(const std::string& arguments, const std::string& sentence) const {
    const Outcome outcome = plan(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments;
    EXPECT_THAT(outcome.errors, HasSubstr(sentence)) << arguments;
  }
  std::string replaced(std::string what, const std::string& with) const {
    std::string all = usual();
    return all.replace(all.find(what), what.size(), with);
  }

  fs::path folder_;
};

}  // namespace veneer::planner
