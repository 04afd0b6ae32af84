// Tables for spreadsheets: what is written is read back the same, and nobody's text becomes a formula.
#include "cli/csv.h"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/child_process.h"
#include "tests/support/temp_directory.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

TEST(Csv, NumbersTextsListsAndNothing) {
  EXPECT_EQ(csv_line({7, 2.5, -1, "oak", nullptr, true, json::array({"oak", "walnut"}), json::array()}),
            "7,2.5,-1,oak,,true,oak; walnut,\r\n");
  EXPECT_EQ(csv_line({}), "\r\n");
}

TEST(Csv, IsQuotedWhereItMustBe) {
  EXPECT_EQ(csv_line({"a,b", "say \"oak\"", "two\nlines", "", "plain text"}),
            "\"a,b\",\"say \"\"oak\"\"\",\"two\nlines\",,plain text\r\n");
}

TEST(Csv, NoTextBecomesAFormula) {
  EXPECT_EQ(csv_line({"=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "a=1"}),
            "'=1+1,'+1,'-1,'@SUM(A1),'\t=1,\"'\r=1\",a=1\r\n");
  EXPECT_EQ(csv_line({"=HYPERLINK(\"http://x\",\"y\")"}), "\"'=HYPERLINK(\"\"http://x\"\",\"\"y\"\")\"\r\n");
  EXPECT_EQ(csv_line({json::array({"=1", "oak"})}), "'=1; oak\r\n");
}

// Another program's reader.
TEST(Csv, PythonReadsWhatWasWritten) {
  const std::vector<std::string> texts = {"oak", "a,b",      "say \"oak\"", "two\nlines", "two\r\nlines",
                                          "",    " spaces ", "\"",          "\"\"",       "Ahorn, f\xc3\xbcr",
                                          ";",   "'=1"};
  const testing::TempDirectory folder;
  std::ofstream(folder / "t.csv", std::ios::binary)
      << csv_line(std::vector<json>(texts.begin(), texts.end())) << csv_line({1, 2.25, nullptr, "x"});
  const auto read = tests::run_program(
      {"/usr/bin/env", "python3", "-c",
       ("import csv, json, sys; "
        "print(json.dumps(list(csv.reader(open(sys.argv[1], newline='', encoding='utf-8'), strict=True))))"),
       (folder / "t.csv").string()});
  ASSERT_EQ(read.status, 0) << read.output;
  EXPECT_EQ(json::parse(read.output, nullptr, false), json::array({json(texts), {"1", "2.25", "", "x"}}));
}

}  // namespace
}  // namespace veneer::cli
