#include "cli/named_option.h"

#include <algorithm>
#include <utility>

namespace veneer::cli {

CLI::Option* add_named_option(CLI::App& command, const planner::NamedOption& option,
                              std::function<void(const std::string& text)> take) {
  using planner::OptionKind;
  const std::string help(option.help);
  std::string flag = "--" + std::string(option.name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  if (option.kind == OptionKind::kSwitch)
    return command.add_flag_callback(
        flag, [take = std::move(take)] { take("1"); }, help);
  CLI::Option* added = command.add_option_function<std::string>(flag, take, help);
  if (option.kind != OptionKind::kWord) added->type_name(option.kind == OptionKind::kWhole ? "WHOLE" : "NUMBER");
  return added;
}

}  // namespace veneer::cli
