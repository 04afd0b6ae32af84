// Plans that are broken off and go on.
#include "planner/files/plan_journal.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>
#include <sstream>

#include "planner/files/plan_files.h"
#include "planner/global/global_search.h"
#include "tests/support/stop_in_the_midst.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

namespace fs = std::filesystem;
using test::blob_artwork;
using test::wood_panel;

class Journal : public ::testing::Test {
 protected:
  Journal() {
    options_.patch = 5_mm, options_.dpi = 50.8, options_.rotations = 3, options_.threads = 1;
    options_.priority = Priority::kCentre;
  }

  std::string key() const { return plan_key(settings(), "this program"); }
  std::string settings() const { return settings_key(artworks_, stock_, options_); }
  PlanJournal opened() const {
    auto journal = PlanJournal::open(path_, key());
    if (!journal.ok()) throw std::runtime_error(journal.error().message);
    return std::move(*journal);
  }
  std::string unbroken() const { return plan_to_json(*make_plan(artworks_, stock_, options_)); }
  std::string gone_on() const {
    PlanJournal journal = opened();
    EXPECT_TRUE(journal.goes_on());
    return plan_to_json(*make_plan(artworks_, stock_, options_, {}, {}, &journal));
  }
  // Plans in another process, which is killed as soon as its journal grows beyond so many bytes: in the midst of a
  // line. Returns whether it was.
  bool killed_at(rlim_t bytes) const {
    const pid_t child = ::fork();
    if (child == 0) {
      const rlimit none{0, 0}, some{bytes, bytes};
      ::setrlimit(RLIMIT_CORE, &none);
      ::setrlimit(RLIMIT_FSIZE, &some);
      PlanJournal journal = opened();
      ::_exit(make_plan(artworks_, stock_, options_, {}, {}, &journal).ok() ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status);
  }

  veneer::testing::TempDirectory folder_;
  fs::path path_ = folder_.path() / "plan.journal";
  std::vector<Artwork> artworks_{blob_artwork("A", 40, 40, 25_mm, 1)};
  std::vector<StockPanel> stock_{wood_panel("P", 76, 70, 50.8, 2)};
  PlanOptions options_;
};

TEST_F(Journal, APlanThatWasKilledGoesOnToTheSameBytes) {
  const std::string whole = unbroken();
  ASSERT_TRUE(killed_at(500));
  const auto torn = fs::file_size(path_);
  EXPECT_EQ(torn, 500U);
  ASSERT_TRUE(killed_at(1000));  // goes on, and is killed again
  EXPECT_EQ(gone_on(), whole);
  EXPECT_FALSE(killed_at(1000000));
  EXPECT_EQ(gone_on(), whole);
}

TEST_F(Journal, SoDoesOneWithPatchesOfSeveralSizes) {
  options_.adaptive_levels = 1;
  const std::string whole = unbroken();
  ASSERT_TRUE(killed_at(600));
  EXPECT_EQ(gone_on(), whole);
}

// Where the lines of a file end.
std::vector<rlim_t> line_ends(const fs::path& path) {
  std::vector<rlim_t> ends;
  std::ifstream file(path, std::ios::binary);
  for (std::string line; std::getline(file, line);) ends.push_back((ends.empty() ? 0 : ends.back()) + line.size() + 1);
  return ends;
}

TEST_F(Journal, SoDoesOneWhosePatchesChooseTogether) {
  options_.optimize = Optimize::kGlobal, options_.optimize_iterations = 30000;
  std::string whole;
  {
    PlanJournal journal = opened();
    const auto plan = make_plan(artworks_, stock_, options_, {}, {}, &journal);
    ASSERT_TRUE(plan.ok());
    // Greedy jams on so little wood: in each of 40 other scenes it left two to eight of the 25 patches unfilled, the
    // search none, and in 19 of them what they all cost was more than greedy's fewer pieces did.
    ASSERT_TRUE(plan->global->unfilled < plan->global->greedy_unfilled ||
                plan->global->cost < plan->global->greedy_cost);
    whole = plan_to_json(*plan);
  }
  EXPECT_EQ(unbroken(), whole);
  const std::vector<rlim_t> ends = line_ends(path_);
  const std::size_t patches = 25, last = ends.size() - 1;
  ASSERT_GT(ends.size(), patches + 5);
  fs::remove(path_);
  // In greedy, in the midst of the lists, after them, in a stage's line, after a stage.
  for (const rlim_t bytes : {ends[1] + 9, ends[last - 13] + 9, ends[last - 5], ends[last - 4] + 9, ends[last - 1]}) {
    ASSERT_TRUE(killed_at(bytes)) << bytes;
    EXPECT_EQ(fs::file_size(path_), bytes);
  }
  EXPECT_EQ(gone_on(), whole);
  EXPECT_EQ(line_ends(path_), ends);
  for (const rlim_t bytes : {ends[last - 13] + 9, ends[last - 4]}) {  // each alone
    fs::remove(path_);
    ASSERT_TRUE(killed_at(bytes)) << bytes;
    EXPECT_EQ(gone_on(), whole);
  }
}

TEST_F(Journal, SoDoesOneWhosePiecesAreTurnedFinely) {
  options_.fine_rotation = true;
  std::string whole;
  {
    PlanJournal journal = opened();
    const auto plan = make_plan(artworks_, stock_, options_, {}, {}, &journal);
    ASSERT_TRUE(plan.ok());
    ASSERT_GT(plan->fine->moved, 5U);
    whole = plan_to_json(*plan);
  }
  EXPECT_EQ(unbroken(), whole);
  const std::vector<rlim_t> ends = line_ends(path_);
  const std::size_t last = ends.size() - 1;
  EXPECT_EQ(gone_on(), whole);
  EXPECT_EQ(line_ends(path_), ends);  // all was remembered
  // Before the pieces are turned, in the midst of their lines, before the last of them.
  for (const rlim_t bytes : {ends[1] + 9, ends[last - 3], ends[last - 2] + 9, ends[last - 1]}) {
    fs::remove(path_);
    ASSERT_TRUE(killed_at(bytes)) << bytes;
    EXPECT_EQ(gone_on(), whole);
    EXPECT_EQ(line_ends(path_), ends);
  }
}

// Whether nothing was forgotten or added since a link to the file was made: both write the file anew, or on.
bool is_untouched(const fs::path& path, const fs::path& link, std::uintmax_t size) {
  return fs::equivalent(path, link) && fs::file_size(path) == size;
}

TEST_F(Journal, OneThatChoseTogetherAndWasTurnedFinelyDoesNeitherAgain) {
  options_.optimize = Optimize::kGlobal, options_.fine_rotation = true;
  for (const std::uint64_t iterations : {std::uint64_t{30000}, std::uint64_t{0}}) {
    options_.optimize_iterations = iterations;
    const std::string whole = unbroken();
    {
      PlanJournal journal = opened();
      const auto plan = make_plan(artworks_, stock_, options_, {}, {}, &journal);
      ASSERT_TRUE(plan.ok());
      ASSERT_GT(plan->fine->moved, 5U);
    }
    PlanJournal journal = opened();
    const auto size = fs::file_size(path_);
    const fs::path link = folder_.path() / "link";
    fs::remove(link);
    fs::create_hard_link(path_, link);
    const auto plan = make_plan(
        artworks_, stock_, options_,
        [](double, std::string_view doing) { EXPECT_FALSE(doing.starts_with("optimising")) << doing; }, {}, &journal);
    ASSERT_TRUE(plan.ok());
    EXPECT_EQ(plan_to_json(*plan), whole);
    EXPECT_TRUE(is_untouched(path_, link, size));
  }
}

// A stop before a run that goes on is where the earlier one was costs neither what that one remembered nor its plan,
// which would be overwritten by a worse one.
TEST_F(Journal, AStopBeforeItIsAsFarAsBeforeGivesNothingAndLosesNothing) {
  options_.optimize = Optimize::kGlobal, options_.fine_rotation = true;
  options_.refine = Refine::kDp, options_.rematch = 1;
  std::string whole;
  {
    PlanJournal journal = opened();
    const auto plan = make_plan(artworks_, stock_, options_, {}, {}, &journal);
    ASSERT_TRUE(plan.ok());
    ASSERT_GT(plan->fine->moved, 5U);
    ASSERT_LT(plan->refined->cost, plan->refined->cost_before);
    whole = plan_to_json(*plan);
  }
  for (const std::string_view doing : {"indexing", "placing pieces", "turning pieces finely", "refining borders"}) {
    PlanJournal journal = opened();
    const auto size = fs::file_size(path_);
    const fs::path link = folder_.path() / "link";
    fs::remove(link);
    fs::create_hard_link(path_, link);
    std::stop_source stop;
    const auto plan = make_plan(
        artworks_, stock_, options_,
        [&](double, std::string_view text) {
          if (text.starts_with(doing)) stop.request_stop();
        },
        stop.get_token(), &journal, nullptr, OnStop::kBestSoFar);
    ASSERT_TRUE(stop.stop_requested()) << doing;
    ASSERT_FALSE(plan.ok()) << doing;
    EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
    EXPECT_TRUE(is_untouched(path_, link, size)) << doing;
  }
  EXPECT_EQ(gone_on(), whole);
}

// At any moment, so also while stages are settled anew.
TEST_F(Journal, AStopAtAnyMomentGivesNoWorsePlanThanTheRunBefore) {
  options_.optimize = Optimize::kGlobal;
  constexpr int kMoments = 12;
  const auto same_journal = [&] { return std::move(*PlanJournal::open(path_, "whatever its budget")); };
  GlobalReport first;
  options_.optimize_iterations = 50000;  // the end of the eighth stage
  {
    PlanJournal journal = same_journal();
    const auto plan = make_plan(artworks_, stock_, options_, {}, {}, &journal);
    ASSERT_TRUE(plan.ok());
    first = *plan->global;
    ASSERT_EQ(first.iterations, 50000U);
    ASSERT_TRUE((Score{first.unfilled, first.cost} < Score{first.greedy_unfilled, first.greedy_cost}));
  }
  options_.optimize_iterations = 0;
  std::ostringstream before;
  before << std::ifstream(path_, std::ios::binary).rdbuf();
  double until_there = 0;  // processor time of a run that goes on, until it has caught up
  {
    PlanJournal journal = same_journal();
    const test::StopInTheMidst never(1e6);
    const double start = never.now();
    std::stop_source stop;
    ASSERT_FALSE(make_plan(
                     artworks_, stock_, options_,
                     [&](double, std::string_view doing) {
                       if (!doing.starts_with("optimising") || stop.stop_requested()) return;
                       until_there = never.now() - start, stop.request_stop();
                     },
                     stop.get_token(), &journal)
                     .ok());
  }
  int stopped = 0;
  for (int k = 0; k < kMoments; ++k) {
    ASSERT_TRUE(write_text(before.str(), path_).ok());
    PlanJournal journal = same_journal();
    const test::StopInTheMidst stop(until_there * (k + 1) / kMoments);
    const auto plan = make_plan(artworks_, stock_, options_, {}, stop.token(), &journal, nullptr, OnStop::kBestSoFar);
    stopped += stop.token().stop_requested() ? 1 : 0;
    if (plan.ok()) {
      EXPECT_GE(plan->global->iterations, first.iterations) << k;
      const Score was{first.unfilled, first.cost}, is{plan->global->unfilled, plan->global->cost};
      EXPECT_FALSE(was < is) << k;
    }
    std::ostringstream after;
    after << std::ifstream(path_, std::ios::binary).rdbuf();
    EXPECT_TRUE(after.str().starts_with(before.str())) << k;
  }
  EXPECT_GT(stopped, kMoments / 2);
}

TEST_F(Journal, RemembersInsteadOfSearching) {
  const std::string whole = unbroken();
  PlanJournal first = opened();
  ASSERT_TRUE(make_plan(artworks_, stock_, options_, {}, {}, &first).ok());
  const auto size = fs::file_size(path_);
  EXPECT_EQ(gone_on(), whole);
  EXPECT_EQ(fs::file_size(path_), size);  // nothing was searched, so nothing was added
}

TEST_F(Journal, RemembersNothingOfASearchThatWasCancelled) {
  PlanJournal journal = opened();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(make_plan(artworks_, stock_, options_, {}, stop.get_token(), &journal).ok());
  EXPECT_FALSE(opened().goes_on());
}

TEST_F(Journal, BeginsAnewForOtherPicturesWoodOrOptions) {
  const PlanJournal::Step step{{0, 3, LatticeCandidate{0.1, 0, 1, 2, 3}}, {0, 4, std::nullopt}};
  const auto is_kept = [&] {
    PlanJournal journal = opened();
    return journal.goes_on();
  };
  const auto fill = [&] {
    PlanJournal journal = opened();
    journal.add(step);
  };
  fill();
  ASSERT_TRUE(is_kept());
  options_.threads = 2;
  EXPECT_TRUE(is_kept());  // threads change nothing
  options_.w_edge = 0.4;
  EXPECT_FALSE(is_kept());
  fill();
  artworks_[0].picture.at<cv::Vec3b>(3, 3)[0] ^= 1;
  EXPECT_FALSE(is_kept());
  fill();
  LayoutGuides& guides = artworks_[0].guides;
  guides.vertices.push_back({1, 2, point<ArtworkFrame>(3, 4)});
  EXPECT_FALSE(is_kept());
  fill();
  guides.vertices[0].at = point<ArtworkFrame>(3, 4.001);
  EXPECT_FALSE(is_kept());
  fill();
  guides.large = cv::Mat(4, 4, CV_8UC1, cv::Scalar(255));
  EXPECT_FALSE(is_kept());
  fill();
  std::swap(guides.large, guides.fine);
  EXPECT_FALSE(is_kept());
  fill();
  stock_[0].free.pixels.at<std::uint8_t>(30, 30) ^= 255;
  EXPECT_FALSE(is_kept());
  fill();
  stock_[0].picture.resolution = ScanResolution::from_dpi(51);
  EXPECT_FALSE(is_kept());
  fill();
  EXPECT_NE(plan_key(settings(), "another program"), key());
}

TEST_F(Journal, IsOfOtherWoodOnceLimitsSayWhatAWoodMayTake) {
  const std::string unlimited = key();
  stock_[0].material = "oak";
  EXPECT_EQ(key(), unlimited) << "what nobody asks about changes no choice";
  options_.material_limits = {{"oak", 0.5}};
  const std::string oak = key();
  EXPECT_NE(oak, unlimited);
  stock_[0].material = "ash";
  EXPECT_NE(key(), oak);
}

TEST_F(Journal, GivesStepsBackInOrderUpToTheFirstDamagedLine) {
  const PlanJournal::Step one{{0, 1, LatticeCandidate{0.1, 0, 1, 2, 3}}, {0, 2, std::nullopt}}, two{{1, 7, {}}},
      three = one;
  {
    PlanJournal journal = opened();
    for (const auto& step : {one, two, three}) journal.add(step);
  }
  PlanJournal journal = opened();
  EXPECT_EQ(journal.next({{0, 1, {}}, {0, 2, {}}}), one);
  EXPECT_EQ(journal.next({{1, 7, {}}}), two);
  EXPECT_FALSE(journal.next({{0, 5, {}}}));  // not what is asked: forgotten
  EXPECT_FALSE(journal.next({{0, 1, {}}}));

  std::string text;
  {
    std::ifstream file(path_, std::ios::binary);
    std::ostringstream all;
    all << file.rdbuf();
    text = all.str();
  }
  text[text.size() - 3] ^= 1;
  ASSERT_TRUE(write_text(text, path_).ok());
  PlanJournal damaged = opened();
  EXPECT_EQ(damaged.next({{0, 1, {}}}), one);
  EXPECT_FALSE(damaged.next({{1, 7, {}}}));
}

TEST_F(Journal, SaysSoWhenItCannotBeWritten) {
  path_ = folder_.path() / "nowhere" / "plan.journal";
  const auto journal = PlanJournal::open(path_, key());
  ASSERT_FALSE(journal.ok());
  EXPECT_EQ(journal.error().code, ErrorCode::kStorage);
}

}  // namespace
}  // namespace veneer::planner
