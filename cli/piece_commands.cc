// piece show|at.
#include <memory>
#include <string>

#include "cli/command_context.h"
#include "cli/render.h"

namespace veneer::cli {
namespace {

using nlohmann::json;

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

void add_piece_show(CLI::App& piece, CommandContext& context) {
  struct Options {
    std::string first, mark, picture;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* show = piece.add_subcommand("show", "A piece's passport: where it comes from and how it was made");
  show->add_option("PIECE", options->first, "Its number, as `job pieces` gives it; or its job's, with MARK")
      ->required();
  show->add_option("MARK", options->mark, "What is engraved on its back, as in A3-12");
  show->add_option("--picture", options->picture, "Save it in its wood before it was cut (PNG)");
  show->callback([options, &context] {
    if (!is_number(options->first))
      fail({ErrorCode::kInvalidArgument,
            options->first + " is not a number: write the piece's, or its job's and then the mark"},
           kUnusableArguments);
    const auto view = context.client().get(options->mark.empty()
                                               ? "/pieces/" + options->first
                                               : "/jobs/" + options->first + "/pieces/" + url_encode(options->mark));
    if (view && view->contains("id"))
      save_parts(context, "/pieces/" + std::to_string((*view)["id"].get<std::int64_t>()),
                 {{options->picture, "/picture.png"}});
    context.finish(view, render_passport);
  });
}

void add_piece_at(CLI::App& piece, CommandContext& context) {
  struct Options {
    std::string panel;
    double x = 0, y = 0;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* at = piece.add_subcommand("at", "What was made of a place of a panel");
  at->add_option("PANEL", options->panel, "Its name, as in P-0001")->required();
  at->add_option("X", options->x, "Millimetres from its left border, show face up")->required();
  at->add_option("Y", options->y, "Millimetres from its lower border")->required();
  at->callback([options, &context] {
    context.finish(context.client().get("/panels/" + url_encode(options->panel) +
                                        "/place?x=" + std::to_string(options->x) + "&y=" + std::to_string(options->y)),
                   render_place);
  });
}

}  // namespace

void add_piece_commands(CLI::App& app, CommandContext& context) {
  CLI::App* piece = app.add_subcommand("piece", "Single pieces: what they were made of, and how");
  piece->require_subcommand(1);
  add_piece_show(*piece, context);
  add_piece_at(*piece, context);
}

}  // namespace veneer::cli
