// What the programs of the fault campaigns share: their options, and how they end.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace veneer::tests {

struct CampaignOptions {
  int runs = 500;
  std::uint64_t seed = 1;  // of the first run of each kind
  std::string kind;        // only those whose name begins so
  std::string out;

  bool wants(std::string_view name) const { return name.starts_with(kind); }
};

// Ends the program on --help and on an option it does not know.
CampaignOptions read_campaign_options(int argc, char** argv, const char* title, const char* program);

// Prints the first remarks and writes the table where the options say. Gives the program's exit code: 1 when
// something happened that never must, or nothing was run.
int finish_campaign(const CampaignOptions& options, const nlohmann::json& rows, const std::vector<std::string>& remarks,
                    bool clean);

}  // namespace veneer::tests
