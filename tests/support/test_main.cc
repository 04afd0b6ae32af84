// usage: PROGRAM [FILE] [gtest's options]     the tests of FILE, as daemon/unit/preflight_test.cc, or all of the
// program
//
// Which file a test stands in is what the compiler noted, so nothing has to be listed and no new test can be forgotten.
// Exits with 77 when a test was skipped and none failed: ctest then tells the file as skipped, and not as passed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <string_view>

namespace {

std::string tests_in(std::string_view file) {
  const std::string end = "/tests/" + std::string(file);
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  std::string filter;
  for (int s = 0; s < all.total_test_suite_count(); ++s) {
    const testing::TestSuite& suite = *all.GetTestSuite(s);
    for (int t = 0; t < suite.total_test_count(); ++t) {
      const testing::TestInfo& test = *suite.GetTestInfo(t);
      if (("/" + std::string(test.file())).ends_with(end))
        filter += std::string(suite.name()) + '.' + test.name() + ':';
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  if (argc > 2 || (argc == 2 && testing::GTEST_FLAG(filter) != "*")) {
    std::fprintf(stderr, "usage: %s [FILE | --gtest_filter=TESTS] [other options of googletest]\n", argv[0]);
    return 2;
  }
  if (argc == 2) {
    const std::string filter = tests_in(argv[1]);
    if (filter.empty()) {
      std::fprintf(stderr, "%s has no tests of tests/%s\n", argv[0], argv[1]);
      return 2;
    }
    testing::GTEST_FLAG(filter) = filter;
  }
  constexpr int kSkipped = 77;  // SKIP_RETURN_CODE in cmake/VeneerTargets.cmake
  const int failed = RUN_ALL_TESTS();
  return failed == 0 && testing::UnitTest::GetInstance()->skipped_test_count() > 0 ? kSkipped : failed;
}
