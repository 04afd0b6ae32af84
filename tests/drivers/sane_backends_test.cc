// The real library of SANE, with its own backends for tests: `test`, which can be told to misbehave, and `pnm`, which
// serves a chosen picture.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <future>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>
#include <string>

#include "drivers/sane/patience.h"
#include "drivers/sane/scan_order.h"
#include "tests/support/sane_config.h"
#include "tests/support/temp_directory.h"

namespace veneer::sane {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;

// SANE keeps the first folder it was told for the life of the process.
const testing::TempDirectory& configuration() {
  static const testing::TempDirectory directory;
  return directory;
}

class SaneBackendsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    VENEER_NEEDS_SANE_BACKENDS();
    testing::write_sane_config(configuration().path());
    settings.device = "test:0";
    settings.dpi = 100;
    settings.options = {{"test-picture", "Color pattern"}};
  }
  std::filesystem::path file() const { return folder.path() / "scan.ppm"; }
  // In a process of its own, as in the cell: SANE keeps settings for the life of a process, and its test backend now
  // and then does not come back from a scan that was ended.
  Result<ScannedPicture> scan() {
    return forked([this] { return scan_here(); });
  }
  Result<ScannedPicture> scan_here() {
    auto library = SaneLibrary::open(configuration().path());
    if (!library) return library.error();
    double told = 0;
    std::stop_source stop;
    const ScanProgress progress = [&](double fraction, const std::string& doing) {
      if (doing.empty() && fraction < told) std::abort();
      if (doing.empty()) told = fraction;
      if (stops && told > 0) stop.request_stop();
    };
    auto scanned = scan_picture(**library, settings, file(), {}, progress, stop.get_token());
    if (scanned && told != 1) return Error{ErrorCode::kInternal, "the progress did not come to its end"};
    return scanned;
  }
  std::string why() {
    const auto scanned = scan();
    EXPECT_FALSE(scanned.ok());
    EXPECT_FALSE(std::filesystem::exists(file()));
    return scanned ? "" : scanned.error().message;
  }
  cv::Mat picture() const { return cv::imread(file().string(), cv::IMREAD_UNCHANGED); }

  // SANE's test backend hangs in about one scan of a thousand, in the end of its own thread; that is then begun anew.
  static Result<ScannedPicture> forked(const std::function<Result<ScannedPicture>()>& work) {
    for (int attempt = 0; attempt < 5; ++attempt)
      if (const std::string said = said_by_child(work); !said.empty()) return understood(said);
    return Error{ErrorCode::kTimeout, "five processes that scan have hung or died"};
  }
  static std::string said_by_child(const std::function<Result<ScannedPicture>()>& work) {
    int ends[2] = {-1, -1};
    EXPECT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(ends[0]);
      const auto scanned = work();
      const std::string said =
          scanned ? fmt::format("{}\n{}\n{} {} {} {} {}", scanned->scanner, scanned->make, scanned->dpi, scanned->width,
                                scanned->height, scanned->channels, scanned->bits)
                  : fmt::format("\n{}\n{}", static_cast<int>(scanned.error().code), scanned.error().message);
      static_cast<void>(!::write(ends[1], said.data(), said.size()));
      ::_exit(0);
    }
    ::close(ends[1]);
    std::string said(4096, '\0');
    pollfd wait{ends[0], POLLIN, 0};
    const bool answered = ::poll(&wait, 1, 6'000) == 1;
    const ssize_t n = answered ? ::read(ends[0], said.data(), said.size()) : 0;
    said.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    ::close(ends[0]);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    return said;
  }
  static Result<ScannedPicture> understood(const std::string& said) {
    std::istringstream lines(said);
    std::string name, second;
    std::getline(lines, name);
    std::getline(lines, second);
    if (name.empty()) {
      std::string message;
      std::getline(lines, message);
      return Error{static_cast<ErrorCode>(std::stoi(second)), message};
    }
    ScannedPicture out{name, second};
    lines >> out.dpi >> out.width >> out.height >> out.channels >> out.bits;
    return out;
  }

  testing::TempDirectory folder;
  ScanSettings settings;
  bool stops = false;  // when the first bytes are there
};

TEST_F(SaneBackendsTest, ListsScannersAndWhatCanBeSet) {
  auto library = SaneLibrary::open(configuration().path());
  ASSERT_TRUE(library.ok()) << library.error().message;
  const auto list = describe_scanners(**library, {}, {});
  ASSERT_TRUE(list.ok()) << list.error().message;
  ASSERT_EQ(list->size(), 4U);
  const auto test = std::ranges::find(*list, "test:0", [](const auto& one) { return one.found.name; });
  ASSERT_NE(test, list->end());
  EXPECT_EQ(test->found.make(), "Noname frontend-tester");
  EXPECT_EQ(test->problem, "");
  const auto option = [&](const char* name) { return *std::ranges::find(test->options, name, &ScannerOption::name); };
  EXPECT_THAT(option("mode").words, ElementsAre("Gray", "Color"));
  EXPECT_THAT(option("depth").numbers, ElementsAre(1, 8, 16));
  EXPECT_EQ(option("resolution").unit, "dpi");
  EXPECT_EQ(what_it_takes(option("resolution")), "1 to 1200 in steps of 1");
  EXPECT_EQ(option("br-x").unit, "mm");
  EXPECT_EQ(option("br-x").range->most, 200);
  EXPECT_FALSE(option("three-pass").active) << "in grey there is one pass";
}

TEST_F(SaneBackendsTest, ScansAllOfTheGlassInColour) {
  const auto scanned = scan();
  ASSERT_TRUE(scanned.ok()) << scanned.error().message;
  EXPECT_EQ(scanned->make, "Noname frontend-tester");
  EXPECT_EQ(scanned->dpi, 100);
  EXPECT_EQ(scanned->bits, 8);
  const cv::Mat seen = picture();
  ASSERT_EQ(seen.type(), CV_8UC3);
  EXPECT_NEAR(seen.cols, 200 / 25.4 * 100, 2);
  EXPECT_NEAR(seen.rows, 200 / 25.4 * 100, 2);
}

TEST_F(SaneBackendsTest, ScansAnAreaOfIt) {
  settings.area = ScanSettings::Area{10_mm, 20_mm, 100_mm, 50_mm};
  ASSERT_TRUE(scan().ok());
  EXPECT_NEAR(picture().cols, 100 / 25.4 * 100, 2);
  EXPECT_NEAR(picture().rows, 50 / 25.4 * 100, 2);
  settings.area->width = 195_mm;
  std::filesystem::remove(file());
  EXPECT_THAT(why(), AllOf(HasSubstr("0 to 200 mm"), HasSubstr("reaches to 205")));
}

TEST_F(SaneBackendsTest, KeepsSixteenBits) {
  settings.depth = 16;
  const auto scanned = scan();
  ASSERT_TRUE(scanned.ok()) << scanned.error().message;
  EXPECT_EQ(scanned->bits, 16);
  const cv::Mat deep = picture();
  ASSERT_EQ(deep.type(), CV_16UC3);
  settings.options.emplace_back("invert-endianess", "true");
  ASSERT_TRUE(scan().ok());
  const cv::Mat inverted = picture();
  // Both bytes of every sample are there: swapped, one picture is the other.
  const cv::Mat bytes(static_cast<int>(deep.total()) * 3, 2, CV_8U, deep.data);
  cv::Mat swapped;
  cv::flip(bytes, swapped, 1);
  EXPECT_EQ(cv::norm(swapped, cv::Mat(bytes.size(), CV_8U, inverted.data), cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(deep, inverted, cv::NORM_INF), 0);
}

TEST_F(SaneBackendsTest, ThreePassesGiveThePictureOfOne) {
  ASSERT_TRUE(scan().ok());
  const cv::Mat one = picture();
  for (const char* order : {"RGB", "BRG", "GBR"}) {
    settings.options = {{"test-picture", "Color pattern"}, {"three-pass", "true"}, {"three-pass-order", order}};
    ASSERT_TRUE(scan().ok());
    EXPECT_EQ(cv::norm(one, picture(), cv::NORM_INF), 0) << order;
  }
}

TEST_F(SaneBackendsTest, IsNotIrritatedByWhatDevicesDo) {
  ASSERT_TRUE(scan().ok());
  const cv::Mat plain = picture();
  using Options = std::vector<std::pair<std::string, std::string>>;
  for (const Options& more :
       {Options{{"fuzzy-parameters", "true"}}, Options{{"read-limit", "true"}, {"read-limit-size", "977"}},
        Options{{"non-blocking", "true"}}, Options{{"select-fd", "true"}}}) {
    settings.options = {{"test-picture", "Color pattern"}};
    settings.options.insert(settings.options.end(), more.begin(), more.end());
    const auto scanned = scan();
    ASSERT_TRUE(scanned.ok()) << scanned.error().message;
    EXPECT_EQ(cv::norm(plain, picture(), cv::NORM_INF), 0) << more.front().first;
  }
}

TEST_F(SaneBackendsTest, EveryStatusIsItsSentence) {
  // So small that the backend has written all of it by then: in the midst, its own end may hang.
  settings.area = ScanSettings::Area{0_mm, 0_mm, 10_mm, 10_mm};
  struct Case {
    const char* status;
    ErrorCode code;
    const char* words;
  };
  for (const Case& one : {Case{"SANE_STATUS_UNSUPPORTED", ErrorCode::kInvalidArgument, "cannot do that"},
                          {"SANE_STATUS_CANCELLED", ErrorCode::kCancelled, "told to stop"},
                          {"SANE_STATUS_DEVICE_BUSY", ErrorCode::kUnavailable, "busy"},
                          {"SANE_STATUS_INVAL", ErrorCode::kUnavailable, "settings"},
                          {"SANE_STATUS_EOF", ErrorCode::kDeviceFault, "without a picture"},
                          {"SANE_STATUS_JAMMED", ErrorCode::kDeviceFault, "jammed"},
                          {"SANE_STATUS_NO_DOCS", ErrorCode::kDeviceFault, "nothing to scan"},
                          {"SANE_STATUS_COVER_OPEN", ErrorCode::kDeviceFault, "cover open"},
                          {"SANE_STATUS_IO_ERROR", ErrorCode::kDeviceFault, "cable"},
                          {"SANE_STATUS_NO_MEM", ErrorCode::kUnavailable, "memory"},
                          {"SANE_STATUS_ACCESS_DENIED", ErrorCode::kUnavailable, "group scanner"}}) {
    settings.options = {{"read-return-value", one.status}};
    const auto scanned = scan();
    ASSERT_FALSE(scanned.ok()) << one.status;
    EXPECT_EQ(scanned.error().code, one.code) << one.status;
    EXPECT_THAT(scanned.error().message, AllOf(HasSubstr("test:0"), HasSubstr(one.words))) << one.status;
    EXPECT_FALSE(std::filesystem::exists(file()));
  }
}

TEST_F(SaneBackendsTest, AResolutionItDoesNotHaveIsRefusedWithThoseItHas) {
  settings.dpi = 2400;
  EXPECT_THAT(why(), AllOf(HasSubstr("resolution = 2400"), HasSubstr("1 to 1200")));
}

// It leaves out the end of each line: what is left is narrower than the area it says it scans.
TEST_F(SaneBackendsTest, APictureThatIsNotAsWideAsItsAreaIsRefused) {
  settings.options.emplace_back("ppl-loss", "128");
  EXPECT_THAT(why(), AllOf(HasSubstr("pixels wide"), HasSubstr("scale")));
}

TEST_F(SaneBackendsTest, AHandScannersHeightIsCounted) {
  settings.options.emplace_back("hand-scanner", "true");
  const auto scanned = scan();
  ASSERT_TRUE(scanned.ok()) << scanned.error().message;
  EXPECT_NEAR(scanned->width, 110 / 25.4 * 100, 2);
  EXPECT_EQ(picture().rows, scanned->height);
}

TEST_F(SaneBackendsTest, BlackAndWhiteShowsNoWood) {
  settings.depth = 1;
  EXPECT_THAT(why(), HasSubstr("1 bits a colour"));
}

TEST_F(SaneBackendsTest, SettingsItDoesNotHaveAreNamedWithThoseItHas) {
  settings.source = "Tray";
  EXPECT_THAT(why(), AllOf(HasSubstr("source = Tray"), HasSubstr("\"Flatbed\"")));
  settings.source = "";
  settings.mode = "Lineart";
  EXPECT_THAT(why(), AllOf(HasSubstr("mode = Lineart"), HasSubstr("\"Gray\", \"Color\"")));
  settings.mode = "";
  settings.options = {{"lamp", "on"}};
  EXPECT_THAT(why(), AllOf(HasSubstr("no setting lamp"), HasSubstr("test-picture")));
  settings.options = {{"read-limit-size", "12"}};
  EXPECT_THAT(why(), HasSubstr("counts only with another source or mode"));
  settings.options = {{"read-limit", "maybe"}};
  EXPECT_THAT(why(), HasSubstr("true or false"));
}

TEST_F(SaneBackendsTest, AValueThatTheDeviceMakesSomethingElseOfIsRefused) {
  settings.options = {{"enable-test-options", "true"}, {"int-inexact", "7"}};
  EXPECT_THAT(why(), AllOf(HasSubstr("int-inexact"), HasSubstr("of 7")));
}

TEST_F(SaneBackendsTest, ADeviceIsChosenByNameOrByMake) {
  auto library = SaneLibrary::open(configuration().path());
  ASSERT_TRUE(library.ok()) << library.error().message;
  const auto there = (*library)->find();
  ASSERT_TRUE(there.ok());
  EXPECT_THAT(choose_scanner(*there, "test:1")->name, "test:1");
  const auto several = choose_scanner(*there, "Noname frontend-tester");
  ASSERT_FALSE(several.ok());
  EXPECT_EQ(several.error().code, ErrorCode::kConflict);
  EXPECT_THAT(several.error().message, AllOf(HasSubstr("\"test:0\""), HasSubstr("\"test:1\"")));
  const auto unknown = choose_scanner(*there, "EPSON");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(unknown.error().message, HasSubstr("\"test:0\" (Noname frontend-tester)"));
  EXPECT_EQ(choose_scanner({there->front()}, "")->name, there->front().name);
  EXPECT_EQ(choose_scanner({there->front()}, there->front().make())->name, there->front().name);
  EXPECT_THAT(choose_scanner({}, "").error().message, HasSubstr("no scanner is found"));
  EXPECT_EQ(choose_scanner({}, "").error().code, ErrorCode::kUnavailable);
  settings.device = "test:77";
  EXPECT_THAT(why(), AllOf(HasSubstr("test:77"), HasSubstr("opening it")));
}

TEST_F(SaneBackendsTest, IsCancelledInTheMidst) {
  settings.options = {{"read-delay", "true"}, {"read-delay-duration", "1000"}};
  stops = true;
  const auto scanned = scan();
  ASSERT_FALSE(scanned.ok());
  EXPECT_EQ(scanned.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(std::filesystem::exists(file()));
}

TEST(SanePatience, IsOverWhenACallDoesNotReturn) {
  EXPECT_TRUE(returns_within(std::chrono::seconds(60), [] {}));
  const auto never = std::make_shared<std::promise<void>>();
  EXPECT_FALSE(returns_within(std::chrono::milliseconds(1), [never] { never->get_future().wait(); }));
  never->set_value();
}

class SanePnmTest : public SaneBackendsTest {
 protected:
  void SetUp() override {
    SaneBackendsTest::SetUp();
    if (IsSkipped()) return;
    shown = cv::Mat(61, 83, CV_8UC3);
    std::mt19937 random(7);
    for (auto byte = shown.begin<cv::Vec3b>(); byte != shown.end<cv::Vec3b>(); ++byte)
      *byte = cv::Vec3b{static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
                        static_cast<std::uint8_t>(random())};
    const std::string served = (folder / "served.ppm").string();
    ASSERT_TRUE(cv::imwrite(served, shown));
    settings.device = "pnm:0";
    settings.dpi = 300;
    settings.options = {{"filename", served}};
  }
  cv::Mat shown;
};

TEST_F(SanePnmTest, PixelsArriveExactly) {
  const auto scanned = scan();
  ASSERT_TRUE(scanned.ok()) << scanned.error().message;
  EXPECT_EQ(scanned->width, 83);
  EXPECT_EQ(scanned->height, 61);
  EXPECT_EQ(cv::norm(shown, picture(), cv::NORM_INF), 0);
}

TEST_F(SanePnmTest, InThreePassesOrWithoutAKnownHeightAsWell) {
  settings.options.emplace_back("three-pass", "true");
  ASSERT_TRUE(scan().ok());
  EXPECT_EQ(cv::norm(shown, picture(), cv::NORM_INF), 0);
  settings.options.back() = {"hand-scanner", "true"};
  ASSERT_TRUE(scan().ok());
  EXPECT_EQ(cv::norm(shown, picture(), cv::NORM_INF), 0);
}

TEST_F(SanePnmTest, StatusesInTheMidstAreSentences) {
  for (const auto& [option, words] : {std::pair("status-jammed", "jammed"),
                                      {"status-coveropen", "cover open"},
                                      {"status-nodocs", "nothing to scan"},
                                      {"status-ioerror", "cable"}}) {
    settings.options.resize(1);
    settings.options.emplace_back("status", "false");
    settings.options.emplace_back(option, "true");
    EXPECT_THAT(why(), HasSubstr(words)) << option;
  }
}

TEST_F(SanePnmTest, APictureThatIsNotThereIsASentence) {
  settings.options = {{"filename", (folder / "none.ppm").string()}};
  EXPECT_THAT(why(), HasSubstr("the scanner pnm:0 "));
}

}  // namespace
}  // namespace veneer::sane
