// Every operation of docs/openapi.json, asked with what it does not take: nothing is done, and the sentence names what
// is wrong. A misspelt "dry" must never burn.
#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// Sorts behind every name of the API: a name that nobody reads is told before it.
const std::string kUnknown = "zzz_unknown";

struct Property {
  std::string name;
  json schema;
  bool required = false;
};

struct Operation {
  std::string id, method, path;  // path with its parameters filled in
  std::vector<Property> query, body;
  bool takes_json = false;
};

bool takes_a_picture(const Operation& operation) {
  return operation.id == "newJob" || operation.id == "newPlan" || operation.id == "advisePlan" ||
         operation.id == "sketchPlan" || operation.id == "sketchGrid" || operation.id == "sketchMosaic" ||
         operation.id == "readDrawing";
}

class StrictRequests : public testing::RoutedCell {
 protected:
  StrictRequests() {
    std::ifstream file(VENEER_OPENAPI);
    document = json::parse(file, nullptr, false);
    for (const auto& [path, methods] : document["paths"].items())
      for (const auto& [method, described] : methods.items()) operations.push_back(read(path, method, described));
    // Answered by the server itself: nothing may be read before STOP, and the stream of events is no HTTP.
    std::erase_if(operations, [](const Operation& o) { return o.id == "stop" || o.id == "getEvents"; });
  }

  const json& resolved(const json& schema) const {
    if (!schema.contains("$ref")) return schema;
    return document.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)));
  }

  Operation read(std::string path, std::string method, const json& described) const {
    for (char& c : method) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    Operation out{described["operationId"], method, "", {}, {}, false};
    for (const json& parameter : described.value("parameters", json::array())) {
      const std::string name = parameter["name"];
      if (parameter["in"] == "query") {
        out.query.push_back({name, resolved(parameter["schema"]), parameter.value("required", false)});
        if (parameter.contains("example")) out.query.back().schema["example"] = parameter["example"];
        continue;
      }
      if (parameter["in"] != "path") continue;
      const json& schema = resolved(parameter["schema"]);
      const std::string value = schema.contains("enum") ? schema["enum"][0].get<std::string>() : "1";
      const std::string hole = "{" + name + "}";
      path.replace(path.find(hole), hole.size(), value);
    }
    out.path = path;
    const json content = described.value("requestBody", json::object()).value("content", json::object());
    out.takes_json = content.contains("application/json");
    if (out.takes_json) {
      const json& schema = resolved(content["application/json"]["schema"]);
      const auto required = schema.value("required", std::vector<std::string>());
      for (const auto& [name, property] : schema["properties"].items())
        out.body.push_back({name, resolved(property), std::count(required.begin(), required.end(), name) > 0});
    }
    return out;
  }

  static json usable(const json& schema) {
    if (schema.contains("example")) return schema["example"];
    if (schema.contains("enum")) return schema["enum"][0];
    const std::string type = schema["type"];
    if (type == "array") return json::array({usable(schema["items"])});
    if (type == "boolean") return true;
    if (type == "string") return "P-0001";
    return schema.value("maximum", 1.0);
  }

  // Of other types, and beyond the limits.
  static std::vector<json> unusable(const json& schema, bool in_query) {
    const std::string type = schema["type"];
    std::vector<json> out;
    if (!in_query) out = {json(), json::object()};
    if (schema.contains("enum")) out.push_back("other");
    if (type != "string" && type != "array") out.push_back("high");
    if (type != "array" && !in_query) out.push_back(json::array({1}));
    if (type != "boolean" && !in_query) out.push_back(true);
    if (type == "string" && !in_query) out.push_back(7);
    if (type == "integer") out.push_back(1.5);
    if (type == "boolean") out.push_back(2);
    if (type == "array" && !in_query)
      for (const json& item : unusable(schema["items"], false)) out.push_back(json::array({item}));
    if (schema.contains("minimum")) out.push_back(schema["minimum"].get<double>() - 1);
    if (schema.contains("maximum")) out.push_back(schema["maximum"].get<double>() + 1);
    return out;
  }

  static std::string in_query(const std::string& name, const json& value) {
    return name + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
  }
  // The properties that must be there, but `without` it.
  static json needed(const Operation& operation, const std::string& without) {
    json out = json::object();
    for (const Property& p : operation.body)
      if (p.required && p.name != without) out[p.name] = usable(p.schema);
    return out;
  }

  // The same of the query.
  static std::string others_in_query(const Operation& operation, const std::string& without) {
    std::string out;
    for (const Property& p : operation.query)
      if (p.required && p.name != without) out += (out.empty() ? "?" : "&") + in_query(p.name, usable(p.schema));
    return out;
  }

  void refused(const Operation& operation, const std::string& query, const std::string& body,
               const std::string& named) {
    const ApiReply reply = ask_raw(operation.method, operation.path + query, body);
    EXPECT_EQ(reply.status, 400) << operation.id << query << " " << body << " -> " << reply.body;
    EXPECT_THAT(reply.body, HasSubstr(named)) << operation.id << query << " " << body;
    EXPECT_TRUE(says_what_to_do(reply)) << operation.id << query << " " << body << " -> " << reply.body;
  }
  static bool says_what_to_do(const ApiReply& refusal) {
    const json error = body_of(refusal).value("error", json::object());
    return error.value("remedy", json()).is_string() && !error["remedy"].get<std::string>().empty();
  }

  json document;
  std::vector<Operation> operations;
};

TEST_F(StrictRequests, AnUnknownPropertyIsAnErrorThatNamesIt) {
  ASSERT_GT(operations.size(), 35U);
  for (const Operation& operation : operations) {
    std::string all = "?" + kUnknown + "=1";
    for (const Property& p : operation.query) all += "&" + in_query(p.name, usable(p.schema));
    refused(operation, all, "", kUnknown);
    if (takes_a_picture(operation)) continue;
    json body = json::object();
    for (const Property& p : operation.body) body[p.name] = usable(p.schema);
    body[kUnknown] = 1;
    refused(operation, "", body.dump(), kUnknown);
  }
}

TEST_F(StrictRequests, APropertyGivenTwiceIsAnErrorThatNamesIt) {
  for (const Operation& operation : operations) {
    for (const Property& p : operation.query) {
      const std::string once = in_query(p.name, usable(p.schema));
      refused(operation, "?" + once + "&" + once, "", p.name);
    }
    for (const Property& p : operation.body) {
      const std::string once = json(p.name).dump() + ":" + usable(p.schema).dump();
      refused(operation, "", "{" + once + "," + once + "}", p.name);
    }
  }
}

TEST_F(StrictRequests, AValueOfAnotherTypeOrBeyondItsLimitsIsAnErrorThatNamesIt) {
  int values = 0;
  for (const Operation& operation : operations) {
    for (const Property& p : operation.query)
      for (const json& value : unusable(p.schema, true)) {
        refused(operation, "?" + in_query(p.name, value), takes_a_picture(operation) ? "a picture" : "", p.name);
        ++values;
      }
    for (const Property& p : operation.body)
      for (const json& value : unusable(p.schema, false)) {
        json body = needed(operation, p.name);
        body[p.name] = value;
        refused(operation, "", body.dump(), p.name);
        ++values;
      }
  }
  EXPECT_GT(values, 300);
}

TEST_F(StrictRequests, WhatMustBeThereIsAskedForByName) {
  for (const Operation& operation : operations) {
    for (const Property& p : operation.query)
      if (p.required) refused(operation, others_in_query(operation, p.name), "", p.name + " is missing");
    for (const Property& p : operation.body)
      if (p.required) refused(operation, "", needed(operation, p.name).dump(), p.name + " is missing");
  }
}

// Of a cell in which nothing is: what is asked for is not there, or cannot be done yet.
TEST_F(StrictRequests, EveryRefusalHasARemedy) {
  int refusals = 0;
  for (const Operation& operation : operations) {
    // What would look for devices, or takes a picture, is asked above.
    if (takes_a_picture(operation) || operation.id == "findScanners" || operation.id == "findCameras") continue;
    const ApiReply reply = ask_raw(operation.method, operation.path + others_in_query(operation, ""),
                                   operation.takes_json ? needed(operation, "").dump() : "");
    if (reply.status < 400) continue;
    ++refusals;
    EXPECT_TRUE(says_what_to_do(reply)) << operation.id << " -> " << reply.status << " " << reply.body;
  }
  EXPECT_GT(refusals, 40);
}

// Through the server's own door none goes past it; what has no key may be sent again.
TEST_F(StrictRequests, EveryChangeReadsItsKeyAndIsNotedWithWhoAsked) {
  idempotency_key = "has spaces";
  int changes = 0;
  for (const Router::Route& route : router.routes()) {
    if (!route.changes) continue;
    const auto* const listed = [&]() -> const ApiOperation* {
      for (const ApiOperation& one : api_operations())
        if (one.method == route.method && one.pattern == route.pattern) return &one;
      return nullptr;
    }();
    ASSERT_NE(listed, nullptr) << route.method << " " << route.pattern << " is bound beside the table";
    if (listed->takes == Takes::kSecrets) continue;
    std::string path = route.pattern;
    for (auto at = path.find('{'); at != std::string::npos; at = path.find('{'))
      path.replace(at, path.find('}', at) - at + 1, "1");
    const ApiReply reply = ask_raw(route.method, path, "");
    EXPECT_EQ(reply.status, 400) << path << " -> " << reply.body;
    EXPECT_THAT(reply.body, HasSubstr("Idempotency-Key must be")) << path;
    ++changes;
  }
  EXPECT_GT(changes, 60);
}

TEST_F(StrictRequests, ABodyThatIsNoObjectIsRefused) {
  for (const Operation& operation : operations) {
    if (!operation.takes_json || operation.id == "newJob") continue;  // what is no object is taken for a picture
    for (const char* body : {"[]", "{", "1", "\"dry\"", "null", "\xff"}) refused(operation, "", body, "JSON object");
  }
}

TEST_F(StrictRequests, AMisspeltDryDoesNotBurn) {
  for (const char* body :
       {R"({"dri":true})", R"({"Dry":true})", R"({"dry":1})", R"({"dry":"true"})", R"({"dry":true,"dry":false})"}) {
    EXPECT_EQ(ask_raw("POST", "/api/v1/laser/test-pattern", body).status, 400) << body;
    EXPECT_EQ(ask_raw("POST", "/api/v1/laser/test-card", body).status, 400) << body;
  }
  EXPECT_TRUE(cell->tasks.list().empty());
  EXPECT_EQ(cell->runner->view().state, CellState::kStopped);
  EXPECT_FALSE(std::filesystem::exists(directory / "wire.bin"));
}

// While a hand is on a slider there are several a second, and nothing comes of them.
TEST_F(StrictRequests, ASketchIsNoChange) {
  const auto noted = [&] {
    std::size_t count = 0;
    const auto entries = cell->database->call([](Repositories& r) { return r.audit.latest(1000); });
    for (const auto& entry : *entries) count += entry.detail.find("/api/v1/plans/") != std::string::npos ? 1U : 0U;
    return count;
  };
  EXPECT_EQ(ask_raw("POST", "/api/v1/plans/sketch?size_mm=50", "no picture").status, 422) << "the kerf is not known";
  const std::string pinned = "/api/v1/plans/sketch?size_mm=50&layout=morph&pinned_vertices=1,1,30,40";
  EXPECT_EQ(ask_raw("POST", pinned, "no picture").status, 400) << "squares have no such vertices";
  EXPECT_EQ(ask_raw("POST", pinned + "&fine=1", "no picture").status, 422);
  EXPECT_EQ(ask_raw("POST", "/api/v1/plans/grid?layout=morph&pinned_vertices=1,1", "no picture").status, 400);
  EXPECT_EQ(ask_raw("POST", "/api/v1/plans/mosaic?cell_sizes=2x1:fg", "no picture").status, 400);
  EXPECT_EQ(noted(), 0U);
  EXPECT_TRUE(cell->tasks.list().empty());
  EXPECT_EQ(ask_raw("POST", "/api/v1/plans/advice?size_mm=50", "no picture").status, 202);
  EXPECT_EQ(noted(), 1U);
}

// Another layout has no lines that follow the picture, and what is asked of one is not passed over in silence.
TEST_F(StrictRequests, AGridsLinesAreThoseOfTheMorphedOne) {
  const auto refused = [&](const std::string& query) {
    const ApiReply reply = ask_raw("POST", "/api/v1/plans/grid" + query, "no picture");
    EXPECT_EQ(reply.status, 400) << query;
    return reply.body;
  };
  EXPECT_THAT(refused("?layout=mosaic"), HasSubstr("it must be morph"));
  EXPECT_THAT(refused("?layout=morph&fine=2"), HasSubstr("fine is "));
}

TEST_F(StrictRequests, OnlyAMosaicHasCells) {
  const auto refused = [&](const std::string& query) {
    const ApiReply reply = ask_raw("POST", "/api/v1/plans/mosaic" + query, "no picture");
    EXPECT_EQ(reply.status, 400) << query;
    return reply.body;
  };
  EXPECT_THAT(refused("?layout=morph"), HasSubstr("it must be mosaic"));
  EXPECT_THAT(refused("?fine=2"), HasSubstr("fine is "));
  EXPECT_THAT(refused("?large_edges=4x2:f0"), HasSubstr("the layout mosaic does not heed it"));
}

TEST_F(StrictRequests, ASearchForAPanelIsNoPattern) {
  for (const char* panel : {"*", "P-*", "P-0001*a*a*a*a", "P-[0-9]", "P-", ""})
    EXPECT_EQ(ask("GET", std::string("/api/v1/audit?panel=") + panel).status, 400) << panel;
  EXPECT_EQ(ask("GET", "/api/v1/audit?panel=P-0001").status, 200);
}

}  // namespace
}  // namespace veneer::daemon
