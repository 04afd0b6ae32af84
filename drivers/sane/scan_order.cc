#include "drivers/sane/scan_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iterator>

#include "drivers/pnm_file.h"

namespace veneer::sane {
namespace {

constexpr double kMmPerInch = 25.4;

double figure(const ScannerOption& option) {
  double number = 0;
  std::from_chars(option.value.data(), option.value.data() + option.value.size(), number);
  return number;
}

// An open scanner that is being set; its options are asked for anew after each change, because one may change others.
class Setting {
 public:
  explicit Setting(OpenScanner& scanner) : scanner_(scanner), options_(scanner.options()) {}

  const ScannerOption* find(const std::string& name) const {
    const auto at = std::ranges::find(options_, name, &ScannerOption::name);
    return at == options_.end() ? nullptr : &*at;
  }
  const ScannerOption* active(const std::string& name) const {
    const ScannerOption* option = find(name);
    return option != nullptr && option->active ? option : nullptr;
  }

  Status set(const std::string& name, const std::string& wanted) {
    const ScannerOption* option = find(name);
    if (option == nullptr) return missing(name);
    auto value = fitting_value(*option, wanted, scanner_.scanner());
    if (!value) return value.error();
    if (Status done = scanner_.set(*option, *value); !done) return done;
    options_ = scanner_.options();
    return Ok();
  }

  // And it must have taken exactly that.
  Status set_exactly(const std::string& name, const std::string& wanted) {
    const ScannerOption* option = find(name);
    auto value =
        option == nullptr ? Result<std::string>(missing(name)) : fitting_value(*option, wanted, scanner_.scanner());
    if (!value) return value.error();
    if (Status done = set(name, wanted); !done) return done;
    const ScannerOption* now = find(name);
    const bool numeric =
        now != nullptr && (now->kind == ScannerOption::Kind::kWhole || now->kind == ScannerOption::Kind::kNumber);
    double asked = 0;
    std::from_chars(value->data(), value->data() + value->size(), asked);
    if (now != nullptr && (numeric ? std::abs(figure(*now) - asked) <= 1e-3 : now->value == *value)) return Ok();
    return Error{ErrorCode::kRefused,
                 fmt::format("the scanner {} makes {} = {} of {}: write that under [scanner] if it will do",
                             scanner_.scanner(), name, now == nullptr ? "nothing" : now->value, wanted)};
  }

  Error missing(const std::string& name) const {
    std::vector<std::string> names;
    for (const auto& option : options_)
      if (option.settable) names.push_back(option.name);
    return {ErrorCode::kInvalidArgument, fmt::format("the scanner {} has no setting {}: it has {}", scanner_.scanner(),
                                                     name, fmt::join(names, ", "))};
  }

  // "" asks for colour, which has a few names.
  Status set_mode(const std::string& wanted) {
    if (!wanted.empty()) return set_exactly("mode", wanted);
    const ScannerOption* mode = active("mode");
    if (mode == nullptr || !mode->settable) return Ok();  // it has one only
    for (const char* colour : {"color", "colour", "24bit color", "rgb"})
      if (fitting_value(*mode, colour, scanner_.scanner())) return set_exactly("mode", colour);
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the scanner {} calls no mode \"Color\": set mode under [scanner] to its colour mode, one "
                             "of {}",
                             scanner_.scanner(), what_it_takes(*mode))};
  }

  Status set_depth(int bits) {
    const ScannerOption* depth = active("depth");
    // A device without it has one depth only, which the picture itself tells.
    if (depth == nullptr || !depth->settable) return Ok();
    return set_exactly("depth", std::to_string(bits));
  }

  Status set_resolution(double dpi) {
    static constexpr const char* kNames[] = {"resolution", "x-resolution", "y-resolution"};
    bool known = false;
    for (const char* name : kNames) {
      const ScannerOption* option = active(name);
      if (option == nullptr) continue;
      if (option->settable) {
        if (Status done = set_exactly(name, in_digits(dpi)); !done) return done;
      } else if (std::abs(figure(*option) - dpi) > 1e-3) {
        return Error{ErrorCode::kRefused, fmt::format("the scanner {} always scans at {} dpi, not at {}: set dpi under "
                                                      "[scanner] to that",
                                                      scanner_.scanner(), option->value, in_digits(dpi))};
      }
      known = true;
    }
    if (!known)
      return Error{ErrorCode::kRefused,
                   fmt::format("the scanner {} does not say at which resolution it scans, and the scale of all that is "
                               "cut hangs on it: use another scanner or another driver",
                               scanner_.scanner())};
    // One may have changed the other.
    for (const char* name : kNames)
      if (const ScannerOption* option = active(name); option != nullptr && std::abs(figure(*option) - dpi) > 1e-3)
        return Error{ErrorCode::kRefused,
                     fmt::format("the scanner {} would scan at {} dpi instead of {}: see veneerctl scanner list for "
                                 "what it takes, and set dpi under [scanner]",
                                 scanner_.scanner(), option->value, in_digits(dpi))};
    return Ok();
  }

  // All of the glass, or a part of it. A step of the device's is no error: where a picture begins does not matter.
  Status set_area(const std::optional<ScanSettings::Area>& area) {
    struct Side {
      const char *from, *to;
      std::optional<double> begin, length;
    };
    const Side sides[] = {{"tl-x", "br-x", area ? std::optional(area->x.count()) : std::nullopt,
                           area ? std::optional(area->width.count()) : std::nullopt},
                          {"tl-y", "br-y", area ? std::optional(area->y.count()) : std::nullopt,
                           area ? std::optional(area->height.count()) : std::nullopt}};
    for (const Side& side : sides) {
      const ScannerOption *from = active(side.from), *to = active(side.to);
      if (from == nullptr || to == nullptr || !from->settable || !to->settable || !from->range || !to->range) {
        if (!area) continue;
        return Error{
            ErrorCode::kInvalidArgument,
            fmt::format("the scanner {} scans all it can see: take area_mm out of [scanner]", scanner_.scanner())};
      }
      if (area && (from->unit != "mm" || to->unit != "mm"))
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("the scanner {} counts its area in {}: take area_mm out of [scanner]",
                                 scanner_.scanner(), from->unit.empty() ? "units of its own" : from->unit)};
      const double least = from->range->least, most = to->range->most;
      const double begin = area ? *side.begin + least : least, end = area ? begin + *side.length : most;
      if (begin < least - 1e-3 || end > most + 1e-3)
        return Error{ErrorCode::kInvalidArgument,
                     fmt::format("the scanner {} sees {} to {} mm, and area_mm reaches to {}: make it smaller",
                                 scanner_.scanner(), in_digits(least), in_digits(most), in_digits(end))};
      const auto on_step = [](double value, const ScannerOption& option) {
        const auto& range = *option.range;
        if (range.step <= 0) return value;
        return std::min(range.most, range.least + std::round((value - range.least) / range.step) * range.step);
      };
      const double first = on_step(begin, *from), last = on_step(end, *to);
      // The far side first: a device may refuse an area turned inside out, which a smaller one may be for a moment.
      for (const auto& [name, value] : {std::pair(side.to, last), {side.from, first}, {side.to, last}})
        if (Status done = set(name, in_digits(value)); !done) return done;
    }
    return Ok();
  }

  std::optional<double> expected_pixels(const char* from, const char* to, double dpi) const {
    const ScannerOption *begin = active(from), *end = active(to);
    if (begin == nullptr || end == nullptr || begin->unit != "mm" || end->unit != "mm" || begin->value.empty() ||
        end->value.empty())
      return std::nullopt;
    return (figure(*end) - figure(*begin)) / kMmPerInch * dpi;
  }

 private:
  OpenScanner& scanner_;
  std::vector<ScannerOption> options_;
};

Status apply(Setting& setting, const ScanSettings& wanted) {
  if (!wanted.source.empty())
    if (Status done = setting.set_exactly("source", wanted.source); !done) return done;
  if (Status done = setting.set_mode(wanted.mode); !done) return done;
  if (Status done = setting.set_depth(wanted.depth); !done) return done;
  for (const auto& [name, value] : wanted.options)
    if (Status done = setting.set_exactly(name, value); !done) return done;
  if (Status done = setting.set_resolution(wanted.dpi); !done) return done;
  if (Status done = setting.set_area(wanted.area); !done) return done;
  // Whatever was set last must not have undone what the scale hangs on.
  return setting.set_resolution(wanted.dpi);
}

std::string names_of(const std::vector<FoundScanner>& scanners) {
  std::vector<std::string> names;
  names.reserve(scanners.size());
  for (const auto& scanner : scanners) names.push_back(fmt::format("\"{}\" ({})", scanner.name, scanner.make()));
  return fmt::format("{}", fmt::join(names, ", "));
}

Error cancelled() { return {ErrorCode::kCancelled, "the scan was cancelled before it began"}; }

}  // namespace

Result<FoundScanner> choose_scanner(const std::vector<FoundScanner>& there, const std::string& wanted) {
  std::vector<FoundScanner> meant;
  const auto is_meant = [&](const FoundScanner& scanner) {
    return wanted.empty() || scanner.name == wanted || scanner.make() == wanted;
  };
  std::ranges::copy_if(there, std::back_inserter(meant), is_meant);
  if (meant.size() == 1) return meant.front();
  if (meant.size() > 1)
    return Error{ErrorCode::kConflict,
                 fmt::format("several scanners are meant: set device under [scanner] to one of {}", names_of(meant))};
  // One that does not make itself known, as behind a network, is opened by its name.
  if (wanted.find(':') != std::string::npos) return FoundScanner{wanted, "", "", ""};
  if (there.empty())
    return Error{ErrorCode::kUnavailable,
                 "no scanner is found: switch it on, look at its cable, and see docs/CALIBRATION.md for what it needs"};
  return Error{
      ErrorCode::kUnavailable,
      fmt::format("no scanner is called \"{}\": set device under [scanner] to one of {}", wanted, names_of(there))};
}

Result<ScannedPicture> scan_picture(SaneLibrary& library, const ScanSettings& settings,
                                    const std::filesystem::path& file, const ReadOptions& options,
                                    const ScanProgress& progress, const std::stop_token& stop) {
  if (progress) progress(0, "looking for the scanner");
  auto there = library.find();
  if (!there) return there.error();
  if (stop.stop_requested()) return cancelled();
  const auto chosen = choose_scanner(*there, settings.device);
  if (!chosen) return chosen.error();
  auto scanner = library.open_scanner(chosen->name);
  if (!scanner) return scanner.error();
  Setting setting(**scanner);
  if (Status set = apply(setting, settings); !set) return set.error();
  if (stop.stop_requested()) return cancelled();
  ReadOptions reading = options;
  reading.expected_width = setting.expected_pixels("tl-x", "br-x", settings.dpi);
  reading.expected_height = setting.expected_pixels("tl-y", "br-y", settings.dpi);
  auto scan = read_scan(**scanner, reading, progress, stop);
  if (!scan) return scan.error();
  if (settings.depth == 16 && scan->bits != 16)
    return Error{ErrorCode::kRefused, fmt::format("the scanner {} delivers {} bits a colour, not 16: set depth = 8 "
                                                  "under [scanner]",
                                                  chosen->name, scan->bits)};
  if (Status written = write_pnm(*scan, file); !written) return written.error();
  return ScannedPicture{chosen->name, chosen->make(), settings.dpi, scan->width,
                        scan->height, scan->channels, scan->bits};
}

Result<std::vector<DescribedScanner>> describe_scanners(SaneLibrary& library, const ScanProgress& progress,
                                                        const std::stop_token& stop) {
  auto there = library.find();
  if (!there) return there.error();
  std::vector<DescribedScanner> out;
  for (const FoundScanner& found : *there) {
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "looking for scanners was cancelled"};
    if (progress) progress(static_cast<double>(out.size()) / static_cast<double>(there->size()), found.name);
    DescribedScanner& described = out.emplace_back(DescribedScanner{found, {}, ""});
    if (auto scanner = library.open_scanner(found.name))
      described.options = (*scanner)->options();
    else
      described.problem = scanner.error().message;
  }
  return out;
}

}  // namespace veneer::sane
