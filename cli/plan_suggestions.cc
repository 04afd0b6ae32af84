#include "cli/plan_suggestions.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/command_context.h"
#include "cli/plan_support.h"
#include "planner/files/plan_files.h"
#include "planner/suggest/contact_sheet.h"
#include "planner/suggest/crops.h"
#include "planner/suggest/suggestions.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;
using planner::Suggestion;

bool is_whole(const Suggestion& it, const cv::Mat& picture) { return it.crop.size() == picture.size(); }

std::string command_of(const Suggestion& it, const std::optional<std::string>& crop, const std::string& given,
                       std::size_t number) {
  return fmt::format("veneerctl plan {}{} --layout {} --size-mm {:.6g} --patch-mm {:.6g} --out plan-{}", given,
                     crop ? " --crop " + *crop : "", planner::layout_text(it.layout),
                     std::min(it.width, it.height).count(), it.patch.count(), number);
}

nlohmann::json json_of(const Suggestion& it, const std::optional<std::string>& crop, const std::string& command,
                       const std::string& preview) {
  return {{"crop", crop ? nlohmann::json(*crop) : nlohmann::json()},
          {"layout", planner::layout_text(it.layout)},
          {"width_mm", it.width.count()},
          {"height_mm", it.height.count()},
          {"patch_mm", it.patch.count()},
          {"pieces", it.pieces},
          {"unfilled", it.unfilled},
          {"likeness", it.likeness},
          {"preview_cost_per_pixel", it.cost_per_pixel},
          {"dpi", it.dpi},
          {"cutting_s", it.cutting.count()},
          {"preview", preview},
          {"command", command}};
}

}  // namespace

void run_suggest(const PlanArguments& arguments, const EditArguments& edits, const std::string& given,
                 const std::string& out) {
  if (out.empty()) end(kUnusableArguments, "--out \"\" names no directory");
  if (arguments.targets.size() != 1 || arguments.copies != 1)
    end(kUnusableArguments, "--suggest looks at one picture: give one --target, and no --repeat");
  if (!edits.keep.empty()) end(kUnusableArguments, "--suggest begins anew: leave --keep out");
  if (arguments.options.layout == planner::LayoutKind::kSegmentation)
    end(kUnusableArguments, "--suggest chooses the layout itself: leave --layout segmentation out");
  if (arguments.files.guide_a_grid())
    end(kUnusableArguments, "--suggest tries layouts that heed no guides: leave --guides out, and what names edges");
  if (arguments.files.guide_a_mosaic())
    end(kUnusableArguments, "--suggest tries layouts that heed no guides: leave --cell-sizes and --flow-lines out");
  planner::PlanOptions options = or_end(plan_options(arguments));
  const planner::Artwork artwork = or_end(load_artworks(arguments)).front();
  auto stock = or_end(load_panels(arguments));
  if (const Status status = apply_edits(edits, stock, options); !status.ok()) end(status.error());
  const fs::path directory = out;
  make_directory(directory);
  planner::AdviceLimits limits;
  limits.size = Millimetres(arguments.size_mm), limits.crops = arguments.crops.empty();
  std::optional<Result<planner::Advice>> advice;
  with_progress([&](const planner::Progress& progress, const std::stop_token& stop) {
    advice = planner::advise(artwork, stock, options, limits, progress, stop);
  });
  if (!advice->ok()) end(advice->error());

  nlohmann::json list = nlohmann::json::array();
  for (std::size_t i = 0; i < (*advice)->suggestions.size(); ++i) {
    const Suggestion& it = (*advice)->suggestions[i];
    std::optional<std::string> crop;
    if (!arguments.crops.empty())
      crop = arguments.crops.front();
    else if (!is_whole(it, artwork.picture))
      crop = planner::crop_text(it.crop);
    const std::string command = command_of(it, crop, given, i + 1), file = fmt::format("preview-{}.png", i + 1);
    or_fail(write_picture(it.preview, directory / file));
    list.push_back(json_of(it, crop, command, file));
    std::cout << fmt::format(
        "{}{}: {:.0f} x {:.0f} mm{}, {} pieces of {:.1f} mm ({}), about {} to cut, likeness {:.2f}{}\n    {}\n", i + 1,
        (*advice)->best == i ? " (suggested)" : "", it.width.count(), it.height.count(),
        is_whole(it, artwork.picture) ? "" : " of a part of the picture", it.pieces, it.patch.count(),
        planner::layout_text(it.layout), planner::duration_text(it.cutting), it.likeness,
        it.unfilled > 0 ? fmt::format(", wood is missing for {}", it.unfilled) : "", command);
  }
  for (const std::string& remark : (*advice)->remarks) std::cerr << "veneerctl: " << remark << "\n";
  const nlohmann::json written{{"schema_version", 1},
                               {"target", artwork.name},
                               {"suggested", (*advice)->best ? nlohmann::json(*(*advice)->best + 1) : nlohmann::json()},
                               {"remarks", (*advice)->remarks},
                               {"suggestions", std::move(list)}};
  or_fail(planner::write_text(written.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
                              directory / "suggestions.json"));
  or_fail(write_picture(planner::contact_sheet(**advice, artwork.picture), directory / "suggestions.png"));
  std::cout << "all of them side by side: " << (directory / "suggestions.png").string() << "\n";
}

}  // namespace veneer::cli
