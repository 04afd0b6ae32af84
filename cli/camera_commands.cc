// camera list.
#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {

void add_camera_commands(CLI::App& app, CommandContext& context) {
  CLI::App* camera = app.add_subcommand("camera", "Cameras that can be used over the bed");
  camera->require_subcommand(1);
  CLI::App* list = camera->add_subcommand("list", "Look for cameras of this computer, and ask what can be set on them");
  list->callback([&context] { context.finish(context.run_task(context.client().post("/cameras")), render_cameras); });
}

}  // namespace veneer::cli
