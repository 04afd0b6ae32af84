#include "cli/plan_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <future>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "cli/command_context.h"
#include "cli/named_option.h"
#include "planner/drawings/drawn_areas.h"
#include "planner/parallel.h"
#include "planner/pictures/pictures.h"
#include "planner/plan_options.h"
#include "planner/suggest/crops.h"

namespace veneer::cli {
namespace {

namespace fs = std::filesystem;
using planner::Artwork;
using planner::StockPanel;

struct PanelArgument {
  std::string picture, mask, id, material, dpi_text;
  double dpi = 300;
};

Result<double> number_of(const std::string& text, const std::string& what) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || !std::isfinite(value))
    return unusable(fmt::format("{} is not a number: \"{}\"", what, text));
  return value;
}

// MATERIAL=NUMBER.
Result<std::pair<std::string, double>> material_number(const std::string& text, const std::string& option) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos)
    return unusable(fmt::format("{} {} is not MATERIAL=NUMBER: write it so", option, text));
  const Result<double> number = number_of(text.substr(equals + 1), fmt::format("the number of {} {}", option, text));
  if (!number.ok()) return number.error();
  return std::pair(text.substr(0, equals), *number);
}

// IMAGE[,mask=IMAGE][,dpi=300][,id=NAME][,material=NAME]; a comma in a file's name is taken as part of it when no key
// follows. species= is read as material=.
Result<PanelArgument> panel_argument(const std::string& text) {
  PanelArgument panel;
  const std::pair<std::string, std::string*> keys[] = {{"mask=", &panel.mask},
                                                       {"dpi=", &panel.dpi_text},
                                                       {"id=", &panel.id},
                                                       {"material=", &panel.material},
                                                       {"species=", &panel.material}};
  std::string* open = &panel.picture;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, comma - from);
    const auto key = std::find_if(std::begin(keys), std::end(keys),
                                  [&](const auto& k) { return from > 0 && part.rfind(k.first, 0) == 0; });
    if (from == 0) {
      panel.picture = part;
    } else if (key != std::end(keys)) {
      open = key->second;
      *open = part.substr(key->first.size());
    } else {
      *open += "," + part;
    }
    from = comma + 1;
  }
  if (panel.picture.empty()) return unusable(fmt::format("--panel \"{}\" names no picture", text));
  for (const auto& [key, value] : keys)
    if (value->empty() && text.find(fmt::format(",{}", key)) != std::string::npos)
      return unusable(fmt::format("--panel {} names no {}: leave \",{}\" out or say which", text,
                                  key.substr(0, key.size() - 1), key));
  const std::size_t equals = panel.picture.rfind('='), comma = panel.picture.rfind(',');
  if (comma < equals && equals != std::string::npos && !fs::exists(panel.picture))
    return unusable(fmt::format("--panel {} holds \"{}\", but only mask=, dpi=, id= and material= may follow a picture",
                                text, panel.picture.substr(comma + 1, equals - comma)));
  if (!panel.dpi_text.empty()) {
    const Result<double> dpi = number_of(panel.dpi_text, "the dpi of --panel " + text);
    if (!dpi.ok()) return dpi.error();
    panel.dpi = *dpi;
  }
  if (panel.id.empty()) panel.id = fs::path(panel.picture).stem().string();
  return panel;
}

// CV_8UC1; "": nothing.
Status read_grey(const std::string& file, cv::Mat& out) {
  if (file.empty()) return Ok();
  const Result<cv::Mat> picture = planner::load_picture(file);
  if (!picture.ok()) return picture.error();
  cv::cvtColor(*picture, out, cv::COLOR_BGR2GRAY);
  return Ok();
}

Status add_layout_files(const LayoutFiles& files, std::size_t index, Artwork& artwork) {
  Result<LayoutFilesOf> own = layout_files_of(files, index);
  if (!own.ok()) return own.error();
  for (const auto& [file, mask] :
       {std::pair(&own->importance, &artwork.importance), std::pair(&own->large_edges, &artwork.guides.large),
        std::pair(&own->fine_edges, &artwork.guides.fine), std::pair(&own->cell_sizes, &artwork.guides.cell_sizes)})
    if (Status status = read_grey(*file, *mask); !status.ok()) return status;
  artwork.guides.vertices = std::move(own->vertices);
  artwork.guides.flow_lines = std::move(own->flow_lines);
  const cv::Size picture = artwork.picture.size();
  if (!artwork.guides.flow_lines.empty())
    if (Status status = planner::check_flow_page("--flow-lines " + files.flow_lines[index], own->flow_page,
                                                 picture.width, picture.height);
        !status.ok())
      return status;
  // Before anything is cropped.
  if (Status status = planner::check_painted_sizes(artwork.guides.cell_sizes, picture, artwork.name); !status.ok())
    return status;
  if (own->segmentation.empty()) return Ok();
  const Result<std::string> bytes = read_file(own->segmentation);
  if (!bytes.ok()) return bytes.error();
  Result<cv::Mat> areas = planner::areas_of_file(*bytes, own->segmentation);
  if (!areas.ok()) return areas.error();
  artwork.segmentation = std::move(*areas);
  return Ok();
}

// Ids become parts of file names.
Status check_ids(const std::vector<PanelArgument>& panels) {
  std::set<std::string> seen;
  for (const PanelArgument& panel : panels) {
    if (panel.id.empty() || panel.id.find('/') != std::string::npos || panel.id == "." || panel.id == "..")
      return unusable(fmt::format(
          "\"{}\" cannot be the id of a panel, because files are named after it: give another with id=NAME", panel.id));
    if (!seen.insert(panel.id).second)
      return unusable(fmt::format("two panels have the id {}: give one of them another with id=NAME", panel.id));
  }
  return Ok();
}

Result<StockPanel> load_panel(const PanelArgument& argument) {
  if (!(argument.dpi >= 1 && argument.dpi <= 10000))
    return unusable(fmt::format("the dpi of panel {} must lie between 1 and 10000", argument.id));
  StockPanel panel;
  panel.id = {argument.id};
  panel.material = argument.material;
  // Decoding is most of what a small plan waits for before its work begins.
  auto beside = std::async(std::launch::async, [&]() -> Result<cv::Mat> {
    if (argument.mask.empty()) return cv::Mat();
    return planner::load_mask(argument.mask);
  });
  const Result<cv::Mat> picture = planner::load_picture(argument.picture);
  const Result<cv::Mat> mask = beside.get();
  if (!picture.ok()) return picture.error();
  if (!mask.ok()) return mask.error();
  panel.picture.pixels = *picture;
  panel.picture.resolution = ScanResolution::from_dpi(argument.dpi);
  panel.free.resolution = panel.picture.resolution;
  if (argument.mask.empty()) {
    panel.free.pixels = cv::Mat(picture->size(), CV_8UC1, cv::Scalar(255));
  } else {
    if (mask->size() != picture->size())
      return unusable(fmt::format("the mask {} has {} x {} pixels, its panel {} x {}: make them alike", argument.mask,
                                  mask->cols, mask->rows, picture->cols, picture->rows));
    panel.free.pixels = *mask;
  }
  if (cv::countNonZero(panel.free.pixels) == 0)
    return unusable(
        fmt::format("panel {} has no usable wood: its mask is black, and only what is not black counts", argument.id));
  return panel;
}

void add_plan_option(CLI::App& command, const planner::NamedOption& option, planner::PlanOptions& options) {
  CLI::Option* added = add_named_option(command, option, [&options, name = option.name](const std::string& text) {
    if (Status set = planner::set_option(options, name, text); !set.ok())
      throw CLI::ValidationError(set.error().message, CLI::ExitCodes::ValidationError);
  });
  if (option.kind != planner::OptionKind::kSwitch) added->default_str(planner::option_text(options, option.name));
}

}  // namespace

void add_plan_arguments(CLI::App& command, PlanArguments& arguments) {
  command.add_option("--target", arguments.targets, "A picture to rebuild in wood (repeatable)")->required();
  command
      .add_option("--panel", arguments.panels, "IMAGE[,mask=IMAGE][,dpi=300][,id=NAME][,material=NAME] (repeatable)")
      ->required();
  command.add_option(
      "--crop", arguments.crops,
      "X,Y,WIDTH,HEIGHT: rebuild only this part of the target, in pixels from its upper left corner; the "
      "n-th belongs to the n-th target");
  command.add_option("--material,--wood", arguments.woods, "Use only panels of this material (repeatable)");
  command.add_option("--material-weight,--wood-weight", arguments.wood_weights,
                     "MATERIAL=F: favour (above 1) or avoid (below 1) this material's tones when the picture's are "
                     "mapped to the wood's (repeatable)");
  command.add_option(
      "--material-limit", arguments.material_limits,
      "MATERIAL=F: no more than this share of the pictures' area, 0 to 1, is of this material (repeatable)");
  command.add_option("--size-mm", arguments.size_mm, "Length of the picture's shorter side, in millimetres")
      ->capture_default_str();
  for (const planner::NamedOption& option : planner::kNamedOptions) add_plan_option(command, option, arguments.options);
  add_layout_options(command, "the target", arguments.files);
  command.add_option("--kerf-mm", arguments.kerf_mm, "Full width of what the beam burns away, in millimetres")
      ->capture_default_str();
  command
      .add_option("--web-mm", arguments.web_mm,
                  "Wood that stays standing between the kerfs of two pieces, in millimetres; 0: they may touch")
      ->capture_default_str();
  command.add_option("--index-cache", arguments.options.index_cache,
                     "Directory that keeps what was measured of panels for later plans (default: none)");
  command.add_option("--threads", arguments.options.threads, "How many threads to use; 0: as many as the machine has")
      ->capture_default_str();
}

Result<planner::PlanOptions> plan_options(const PlanArguments& arguments) {
  if (!(arguments.size_mm >= 0.1 && arguments.size_mm <= 1e5))
    return unusable("--size-mm must lie between 0.1 and 100000");
  planner::PlanOptions options = arguments.options;
  options.kerf = Millimetres(arguments.kerf_mm);
  options.web = Millimetres(arguments.web_mm);
  for (const std::string& text : arguments.material_limits) {
    const auto limit = material_number(text, "--material-limit");
    if (!limit.ok()) return limit.error();
    options.material_limits.push_back({limit->first, limit->second});
  }
  // Before any picture is read, which may take long.
  if (Status status = planner::check_options(options); !status.ok()) return status.error();
  options.threads = planner::threads_meant(options.threads);
  return options;
}

Result<std::vector<StockPanel>> load_panels(const PlanArguments& arguments) {
  std::vector<PanelArgument> panels;
  for (const std::string& text : arguments.panels) {
    Result<PanelArgument> panel = panel_argument(text);
    if (!panel.ok()) return panel.error();
    panels.push_back(std::move(*panel));
  }
  if (Status status = check_ids(panels); !status.ok()) return status.error();
  std::vector<StockPanel> stock;
  for (const PanelArgument& argument : panels) {
    Result<StockPanel> panel = load_panel(argument);
    if (!panel.ok()) return panel.error();
    stock.push_back(std::move(*panel));
  }
  for (const std::string& text : arguments.wood_weights) {
    const auto weight = material_number(text, "--material-weight");
    if (!weight.ok()) return weight.error();
    if (Status status = planner::weigh_tones(stock, weight->first, weight->second); !status.ok()) return status.error();
  }
  for (const std::string& text : arguments.material_limits) {
    const auto limit = material_number(text, "--material-limit");
    if (!limit.ok()) return limit.error();
    if (Status status = planner::is_in_stock(stock, limit->first); !status.ok()) return status.error();
  }
  return planner::only_materials(stock, arguments.woods);
}

Result<std::vector<Artwork>> load_artworks(const PlanArguments& arguments) {
  if (Status status = check_layout_files(arguments.files, arguments.targets.size(),
                                         planner::option_text(arguments.options, "layout"));
      !status.ok())
    return status.error();
  if (arguments.crops.size() > arguments.targets.size())
    return unusable("there are more --crop than --target pictures");
  std::vector<Artwork> once;
  for (std::size_t i = 0; i < arguments.targets.size(); ++i) {
    if (arguments.targets[i].empty()) return unusable("--target \"\" names no picture");
    const Result<cv::Mat> picture = planner::load_picture(arguments.targets[i]);
    if (!picture.ok()) return picture.error();
    Artwork& artwork = once.emplace_back();
    artwork.name = arguments.targets[i], artwork.picture = *picture;
    if (Status status = add_layout_files(arguments.files, i, artwork); !status.ok()) return status.error();
    if (i < arguments.crops.size()) {
      const Result<cv::Rect> crop = planner::crop_of(arguments.crops[i], picture->size(), artwork.name);
      if (!crop.ok()) return crop.error();
      planner::crop_pictures(artwork, *crop);
    }
    const auto size = planner::artwork_size(artwork.picture, Millimetres(arguments.size_mm));
    artwork.width = size.width, artwork.height = size.height;
  }
  std::vector<Artwork> artworks;
  for (int copy = 0; copy < arguments.copies; ++copy) {
    for (Artwork artwork : once) {
      artwork.letter = planner::artwork_letter(artworks.size());
      artworks.push_back(std::move(artwork));
    }
  }
  return artworks;
}

}  // namespace veneer::cli
