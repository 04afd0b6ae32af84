#include "tests/soak/campaign_report.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace veneer::tests {

CampaignOptions read_campaign_options(int argc, char** argv, const char* title, const char* program) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // a row appears when it is done, in a file too
  CampaignOptions options;
  CLI::App app{title, program};
  app.add_option("--runs", options.runs, "Runs of each kind")->capture_default_str();
  app.add_option("--seed", options.seed, "The first run's seed")->capture_default_str();
  app.add_option("--kind", options.kind, "Only kinds whose name begins so");
  app.add_option("--out", options.out, "Also write the table as JSON");
  try {
    app.parse(argc - 1, argv + 1);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));  // NOLINT(concurrency-mt-unsafe): there is no other thread yet
  }
  return options;
}

int finish_campaign(const CampaignOptions& options, const nlohmann::json& rows, const std::vector<std::string>& remarks,
                    bool clean) {
  for (std::size_t i = 0; i < remarks.size() && i < 40; ++i) fmt::print("{}\n", remarks[i]);
  if (!options.out.empty())
    std::ofstream(options.out) << nlohmann::json{{"schema_version", 1}, {"seed", options.seed}, {"faults", rows}}.dump(
        2);
  if (rows.empty()) fmt::print("no kind of fault has a name that begins with \"{}\"\n", options.kind);
  return clean && !rows.empty() ? 0 : 1;
}

}  // namespace veneer::tests
