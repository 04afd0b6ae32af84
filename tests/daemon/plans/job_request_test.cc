// What newJob is asked, against docs/openapi.json: every parameter there is read, and none that is not there.
#include "daemon/plans/job_request.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "planner/plan_options.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

json described_parameters() {
  std::ifstream file(VENEER_OPENAPI);
  json out = json::array();
  const json document = json::parse(file, nullptr, false);
  for (const json& parameter : document["paths"]["/api/v1/jobs"]["post"]["parameters"])
    if (parameter["in"] == "query") out.push_back(parameter);
  return out;
}

std::string as_query(const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

Result<JobRequest> read(const std::map<std::string, std::string>& query) {
  ApiRequest request;
  request.query = query;
  request.body = "a picture";
  return read_job_request(request);
}

std::string refusal_of(const std::string& name, const std::string& text) {
  const auto job = read({{name, text}});
  if (job.ok()) return "";
  EXPECT_EQ(job.error().code, ErrorCode::kInvalidArgument);
  return job.error().message;
}

TEST(JobRequest, EveryDescribedParameterChangesTheRequestAndNothingElseInIt) {
  const json parameters = described_parameters();
  ASSERT_GT(parameters.size(), 20U);
  for (const json& parameter : parameters) {
    const std::string name = parameter["name"];
    ASSERT_TRUE(parameter.contains("example")) << name;
    // Guides are nothing without the layout that heeds them.
    std::map<std::string, std::string> query;
    if (name == "large_edges" || name == "fine_edges" || name == "pinned_vertices") query["layout"] = "morph";
    if (name == "cell_sizes" || name == "flow_lines") query["layout"] = "mosaic";
    if (name == "segmentation_bytes") query["layout"] = "segmentation";
    const json otherwise = options_json(*read(query));
    query[name] = as_query(parameter["example"]);
    const auto job = read(query);
    ASSERT_TRUE(job.ok()) << job.error().message;
    json changed = options_json(*job);
    if (name == "name") {
      EXPECT_EQ(job->name, parameter["example"]);
    } else {
      ASSERT_TRUE(otherwise.contains(name)) << name;
      EXPECT_NE(changed[name], otherwise[name]) << name;
      changed[name] = otherwise[name];
    }
    EXPECT_EQ(changed, otherwise) << name;
  }
}

TEST(JobRequest, PaintedEdgesAreRefusedByLayoutsThatFollowNone) {
  for (const char* name : {"large_edges", "fine_edges"}) {
    for (const char* layout : {"grid", "mosaic", "segmentation"}) {
      const auto refused = read({{name, "4x4:ff00"}, {"layout", layout}});
      ASSERT_FALSE(refused.ok()) << name << layout;
      EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(refused.error().message, HasSubstr(fmt::format("{} says which edges", name)));
      EXPECT_THAT(refused.error().message, HasSubstr("choose the layout morph"));
    }
    EXPECT_FALSE(read({{name, "4x4:ff00"}}).ok()) << "squares are what is made unasked";
    EXPECT_TRUE(read({{name, "all"}}).ok());
    const auto taken = read({{name, "4x4:ff00"}, {"layout", "morph"}});
    ASSERT_TRUE(taken.ok()) << taken.error().message;
    EXPECT_FALSE(wants_no_guides(*taken, "a sketch").ok());
    const auto again = job_request_again("a face", "a picture", options_json(*taken).dump());
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(options_json(*again), options_json(*taken)) << "and they are kept with the plan";
  }
  EXPECT_TRUE(wants_no_guides(*read({}), "a sketch").ok());
}

TEST(JobRequest, SizesAndLinesOfAMosaicsCellsAreReadAndKept) {
  const std::map<std::string, std::string> wanted = {{"cell_sizes", "2x2:8f83"},
                                                     {"flow_lines", "30x20:0,5000 5000,4000;2000,0 2000,10000"}};
  for (const auto& [name, text] : wanted) {
    EXPECT_THAT(refusal_of(name, text), HasSubstr("choose the layout mosaic")) << name;
    const auto taken = read({{name, text}, {"layout", "mosaic"}});
    ASSERT_TRUE(taken.ok()) << taken.error().message;
    EXPECT_FALSE(wants_no_guides(*taken, "a sketch").ok());
    const auto again = job_request_again("a face", "a picture", options_json(*taken).dump());
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(options_json(*again), options_json(*taken)) << name;
  }
  EXPECT_THAT(refusal_of("cell_sizes", "2x2:8f8"),
              HasSubstr("cell_sizes must be salient, or a mask of at most 48 x 48"));
  EXPECT_THAT(refusal_of("flow_lines", "1,2"), HasSubstr("flow_lines must be lines of X,Y"));
  EXPECT_THAT(refusal_of("flow_lines", "30:0,5000 5000,4000"), HasSubstr("flow_lines must have the page's width"));
  const auto alone = read({{"flow_lines_only", "1"}, {"layout", "mosaic"}});
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_THAT(wants_no_guides(*alone, "a sketch").error().message,
              HasSubstr("a sketch does not heed flow_lines_only: leave it out"));
}

TEST(JobRequest, PinnedVerticesAreReadAndKept) {
  const auto taken = read({{"pinned_vertices", "1,2,30,45.5;0,3,-1e1,0"}, {"layout", "morph"}});
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_FALSE(wants_no_guides(*taken, "a sketch").ok());
  const auto again = job_request_again("a face", "a picture", options_json(*taken).dump());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->pinned_vertices, "1,2,30,45.5;0,3,-1e1,0");
  EXPECT_THAT(refusal_of("pinned_vertices", "1,2,30,45.5"), HasSubstr("choose the layout morph"));
  for (const char* text :
       {"1", "1,2,3", "1,2,3,4,5", "-1,2,3,4", "1.5,2,3,4", "1,2,nan,4", "1,2,3,inf", "1,2,3,4;;", " 1,2,3,4"})
    EXPECT_THAT(refusal_of("pinned_vertices", text), HasSubstr("ROW,COLUMN,X,Y")) << text;
  std::string many;
  for (int i = 0; i < 201; ++i) many += fmt::format("{},0,1,1;", i);
  EXPECT_THAT(refusal_of("pinned_vertices", many), HasSubstr("more than 200 vertices"));
}

TEST(JobRequest, TheDrawingIsTheEndOfTheBody) {
  ApiRequest request;
  request.body = "a picture<svg/>";
  request.query = {{"layout", "segmentation"}, {"segmentation_bytes", "6"}};
  const auto job = read_job_request(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->picture(), "a picture");
  EXPECT_EQ(job->segmentation(), "<svg/>");
  EXPECT_EQ(job->picture().data(), request.body.text().data()) << "nothing is copied on the loop that answers STOP";
  EXPECT_THAT(wants_no_guides(*job, "a sketch").error().message, HasSubstr("segmentation_bytes"));
  EXPECT_THAT(wants_no_drawing(*job, "a sketch").error().message,
              HasSubstr("a sketch does not heed segmentation_bytes: leave it out"));
  EXPECT_TRUE(wants_no_drawing(*read({{"pinned_vertices", "1,2,30,45.5"}, {"layout", "morph"}}), "a sketch").ok());
  const auto again = job_request_again("a face", "a picture", options_json(*job).dump());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->picture(), "a picture") << "a plan that changes another has its layout";
  EXPECT_EQ(again->segmentation(), "");
  EXPECT_EQ(options_json(*again), options_json(*job)) << "and tells of the drawing still";
  json with_file = options_json(*job);
  with_file["segmentation_file"] = "drawings/d";
  const auto third = job_request_again("a face", "a picture", with_file.dump());
  ASSERT_TRUE(third.ok()) << third.error().message;
  EXPECT_EQ(options_json(*third), with_file);

  request.query["segmentation_bytes"] = "15";
  EXPECT_THAT(read_job_request(request).error().message, HasSubstr("the picture is missing"));
  request.query["segmentation_bytes"] = "16";
  EXPECT_THAT(read_job_request(request).error().message, HasSubstr("the whole body has 15"));
  request.query["segmentation_bytes"] = "0";
  const auto empty = read_job_request(request);
  ASSERT_FALSE(empty.ok()) << "an empty drawing is none that was left out";
  EXPECT_THAT(empty.error().message, HasSubstr("segmentation_bytes"));
  request.query = {{"layout", "mosaic"}, {"segmentation_bytes", "6"}};
  EXPECT_THAT(read_job_request(request).error().message, HasSubstr("choose the layout segmentation"));
}

TEST(JobRequest, EveryParameterThatIsReadIsDescribedWithItsDefault) {
  const json otherwise = options_json(*read({}));
  std::set<std::string> described;
  for (const json& parameter : described_parameters()) {
    const std::string name = parameter["name"];
    described.insert(name);
    if (name == "name") continue;
    const json said = parameter["schema"].value("default", json());
    const json& meant = otherwise[name];
    const json in_query = meant.is_structured() ? json("")
                          : meant.is_boolean()  ? json(meant.get<bool>() ? 1 : 0)
                                                : meant;
    EXPECT_EQ(said, in_query) << name;
  }
  for (const auto& [name, value] : otherwise.items()) EXPECT_TRUE(described.count(name)) << name;
  for (const planner::NamedOption& option : planner::kNamedOptions)
    EXPECT_TRUE(described.count(std::string(option.name))) << option.name;
}

TEST(JobRequest, DescribedLimitsAreThoseThatHold) {
  for (const json& parameter : described_parameters()) {
    const std::string name = parameter["name"];
    const json& schema = parameter["schema"];
    for (const char* limit : {"minimum", "maximum"}) {
      if (!schema.contains(limit)) continue;
      const double value = schema[limit], beyond = std::string(limit) == "minimum" ? value - 1 : value + 1;
      if (name != "segmentation_bytes") {  // so long a body is another test's
        EXPECT_EQ(refusal_of(name, json(schema[limit]).dump()), "") << name;
      }
      EXPECT_NE(refusal_of(name, fmt::format("{}", beyond)), "") << name << "=" << beyond;
    }
    if (schema.contains("enum")) {
      EXPECT_NE(refusal_of(name, "other"), "") << name;
    }
  }
}

TEST(JobRequest, ListsAreSeparatedByCommas) {
  const auto job = read({{"panels", "P-0001,P-0003"},
                         {"max_panels", "1"},
                         {"remnants_first", "0"},
                         {"wood", "oak,black walnut"},
                         {"wood_weight", "oak=2,black walnut=0.5"},
                         {"wood_limit", "oak=0.25,black walnut=1"},
                         {"forbid", "P-0001,10,20,5.5,6;P-0003,1,2,3,4"},
                         {"size_mm", "190.5"}});
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->panels, (std::vector<PanelId>{{"P-0001"}, {"P-0003"}}));
  EXPECT_EQ(job->max_panels, std::optional<std::size_t>(1));
  EXPECT_EQ(job->remnants_first, std::optional(false));
  EXPECT_EQ(job->woods, (std::vector<std::string>{"oak", "black walnut"}));
  EXPECT_EQ(job->wood_weights, (std::vector<std::pair<std::string, double>>{{"oak", 2}, {"black walnut", 0.5}}));
  EXPECT_EQ(job->wood_limits, (std::vector<std::pair<std::string, double>>{{"oak", 0.25}, {"black walnut", 1}}));
  EXPECT_EQ(job->size.count(), 190.5);
  ASSERT_EQ(job->forbidden.size(), 2U);
  EXPECT_EQ(job->forbidden[1].panel, PanelId{"P-0003"});
  EXPECT_EQ(options_json(*job)["forbid"], (json{"P-0001,10,20,5.5,6", "P-0003,1,2,3,4"}));
}

TEST(JobRequest, TheConfigurationSaysWhetherRemnantsComeFirstWhereTheRequestDoesNot) {
  const auto chosen = [](const std::map<std::string, std::string>& query, bool configured) {
    auto job = read(query);
    EXPECT_TRUE(job.ok()) << job.error().message;
    choose_as_configured(*job, {0, configured});
    return job->remnants_first;
  };
  EXPECT_EQ(chosen({}, true), std::optional(true));
  EXPECT_EQ(chosen({}, false), std::nullopt);
  EXPECT_EQ(chosen({{"remnants_first", "0"}}, true), std::optional(false));
  EXPECT_EQ(chosen({{"remnants_first", "1"}}, false), std::optional(true));
  EXPECT_EQ(chosen({{"max_panels", "2"}}, true), std::optional(true));
  EXPECT_EQ(chosen({{"panels", "P-0001"}}, true), std::nullopt) << "these are to be used";
}

TEST(JobRequest, WhatCannotBeIsRefusedInASentence) {
  ApiRequest empty;
  EXPECT_THAT(read_job_request(empty).error().message, HasSubstr("the picture is missing"));
  EXPECT_THAT(refusal_of("max_panel", "1"), HasSubstr("\"max_panel\" is not known here"));
  EXPECT_THAT(refusal_of("max_panels", "0"), HasSubstr("max_panels is \"0\": it must be a whole number from 1"));
  EXPECT_THAT(refusal_of("max_panels", "1.5"), HasSubstr("max_panels is \"1.5\": it must be a whole number from 1"));
  EXPECT_THAT(refusal_of("size_mm", "0"), HasSubstr("size_mm is \"0\": it must be a number from 1 to 100000"));
  EXPECT_THAT(refusal_of("size_mm", "wide"), HasSubstr("size_mm is \"wide\": it must be a number"));
  for (const char* weight : {"oak", "=2", "oak=", "oak=much"})
    for (const char* name : {"wood_weight", "wood_limit"})
      EXPECT_THAT(refusal_of(name, weight), HasSubstr(fmt::format("{} must be MATERIAL=NUMBER", name))) << weight;
  EXPECT_THAT(refusal_of("wood_limit", "oak=1.5"), HasSubstr("the limit of oak must lie between 0 and 1"));
  EXPECT_THAT(refusal_of("forbid", "P-0001,1,2,3"), HasSubstr("is not PANEL,X,Y,WIDTH,HEIGHT in millimetres"));
  EXPECT_THAT(refusal_of("forbid", "P-0001,1,2,nan,4"), HasSubstr("is not PANEL,X,Y,WIDTH,HEIGHT in millimetres"));
  EXPECT_THAT(refusal_of("forbid", "P-0001,1,2,0,4"), HasSubstr("has no area"));
  EXPECT_THAT(refusal_of("optimize", "best"), HasSubstr("optimize must be greedy or global"));
  EXPECT_EQ(refusal_of("rotations", "0"), "rotations is 0: the number of rotations must lie between 1 and 360");
}

// It is read on the loop that answers STOP: 48 MB would keep it for 20 ms with each copy.
TEST(JobRequest, ThePictureIsNotCopied) {
  ApiRequest request;
  request.body = std::string(1 << 20, 'p');
  const auto job = read_job_request(request);
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_EQ(job->picture().data(), request.body.text().data());
}

}  // namespace
}  // namespace veneer::daemon
