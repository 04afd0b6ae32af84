// scanner list.
#include <memory>
#include <string>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {

void add_scanner_commands(CLI::App& app, CommandContext& context) {
  CLI::App* scanner = app.add_subcommand("scanner", "Scanners that can be used");
  scanner->require_subcommand(1);
  const auto all = std::make_shared<bool>(false);
  CLI::App* list = scanner->add_subcommand("list", "Look for scanners, and ask what can be set on them");
  list->add_flag("--all", *all, "All settings, not only those that every scan needs");
  list->callback([all, &context] {
    context.finish(context.run_task(context.client().post("/scanners")),
                   [all](const nlohmann::json& found) { return render_scanners(found, *all); });
  });
}

}  // namespace veneer::cli
