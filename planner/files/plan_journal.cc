#include "planner/files/plan_journal.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <opencv2/core.hpp>
#include <sstream>
#include <system_error>

#include "base/hash.h"

namespace veneer::planner {
namespace {

constexpr const char* kJournalFormat = "veneer plan journal 2 ";
constexpr std::size_t kChecksum = 16;  // hex digits

std::string hash_of(const std::string& text) { return sha256_hex(std::as_bytes(std::span(text))); }

std::string with_checksum(const std::string& body) { return hash_of(body).substr(0, kChecksum) + body + "\n"; }

// None for a line that is torn or damaged.
std::optional<std::string> without_checksum(const std::string& line) {
  if (line.size() < kChecksum) return std::nullopt;
  std::string body = line.substr(kChecksum);
  if (hash_of(body).substr(0, kChecksum) != line.substr(0, kChecksum)) return std::nullopt;
  return body;
}

std::string body_of(const PlanJournal::Step& step) {
  std::string body;
  for (const PlanJournal::Answer& answer : step) {
    body += fmt::format(" {} {}", answer.artwork, answer.patch);
    if (!answer.candidate) {
      body += " -";
      continue;
    }
    const LatticeCandidate& it = *answer.candidate;
    body += fmt::format(" {} {} {} {} {}", it.panel, it.rotation, it.y, it.x, std::bit_cast<std::uint64_t>(it.cost));
  }
  return body;
}

// Of a text: no step at all.
PlanJournal::Step step_of(const std::string& body) {
  PlanJournal::Step step;
  std::istringstream words(body);
  for (PlanJournal::Answer answer; words >> answer.artwork >> answer.patch; step.push_back(answer)) {
    answer.candidate.reset();
    std::string panel;
    words >> panel;
    if (panel == "-") continue;
    LatticeCandidate it;
    std::uint64_t cost = 0;
    it.panel = std::stoi(panel);  // a number: the checksum holds
    words >> it.rotation >> it.y >> it.x >> cost;
    it.cost = std::bit_cast<double>(cost);
    answer.candidate = it;
  }
  return step;
}

std::string hash_of(const cv::Mat& picture) {
  const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();
  return fmt::format("{} {} {} {}", whole.cols, whole.rows, whole.type(),
                     sha256_hex({reinterpret_cast<const std::byte*>(whole.data), whole.total() * whole.elemSize()}));
}

template <class Frame>
std::string text_of(const Raster<Frame>& raster) {
  return fmt::format("{} {} {} {}", hash_of(raster.pixels), raster.resolution.px_per_mm, raster.origin.x.count(),
                     raster.origin.y.count());
}

std::string text_of(const WoodZone& zone) {
  std::string out = fmt::format(" \"{}\" {}", zone.material, zone.tone_weight);
  for (const auto& p : zone.outline) out += fmt::format(" {} {}", p.x.count(), p.y.count());
  return out;
}

std::string text_of(const LayoutGuides& guides) {
  if (guides.empty()) return "";
  std::string out = fmt::format(" {} {}", hash_of(guides.large), hash_of(guides.fine));
  for (const PinnedVertex& it : guides.vertices)
    out += fmt::format(" {} {} {} {}", it.row, it.column, it.at.x.count(), it.at.y.count());
  if (guides.guide_a_mosaic()) out += fmt::format(" {} {}", hash_of(guides.cell_sizes), flow_text({guides.flow_lines}));
  return out;
}

std::string text_of(const PlanOptions& options) {
  // A new option does not compile until it is named here.
  const auto& [layout, triangles, cell_aspect, flow_lines_only, patch, rotations, w_intensity, w_edge, w_hist, w_colour,
               w_texture, w_range, w_detail, w_gamut, w_grain, edge, dpi, kerf, position_margin, web, adaptive_levels,
               adaptive_factor, priority, interleave, reserve, material_limits, exact, thoroughness, layout_fineness,
               fine_rotation, refine, curves, overlap, min_width, min_size, rematch, optimize, optimize_seconds,
               optimize_iterations, index_cache, kept, kept_layouts, alternatives, marks, seed, threads] = options;
  static_cast<void>(threads), static_cast<void>(index_cache), static_cast<void>(kept_layouts);  // change no choice
  std::string stays;
  for (const KeptPiece& piece : kept) {
    stays += fmt::format(" \"{}\" {} {}", piece.mark, piece.cells, piece.must);
    for (const auto& p : piece.outline) stays += fmt::format(" {} {}", p.x.count(), p.y.count());
    if (!piece.placement) continue;
    const auto& map = piece.placement->panel_from_artwork;
    stays += fmt::format(" \"{}\" {} {} {}", piece.placement->panel.value, map.angle().count(), map.shift().x.count(),
                         map.shift().y.count());
  }
  for (const MaterialLimit& limit : material_limits) stays += fmt::format(" \"{}\" {}", limit.material, limit.share);
  const std::string borders =
      fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", static_cast<int>(layout), triangles, cell_aspect,
                  flow_lines_only, web.count(), static_cast<int>(refine), static_cast<int>(curves), overlap.count(),
                  min_width.count(), min_size.count(), rematch, w_range, w_detail, thoroughness, layout_fineness,
                  static_cast<int>(marks));
  return fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}{}", patch.count(),
                     rotations, w_intensity, w_edge, w_hist, w_colour, w_texture, w_gamut, w_grain, edge.count(), dpi,
                     kerf.count(), position_margin.count(), adaptive_levels, adaptive_factor,
                     static_cast<int>(priority), interleave, reserve, exact, fine_rotation, static_cast<int>(optimize),
                     optimize_seconds, optimize_iterations, seed, alternatives, borders, stays);
}

}  // namespace

Result<PlanJournal> PlanJournal::open(const std::filesystem::path& path, const std::string& key) {
  PlanJournal journal(path, key);
  std::ifstream old(path, std::ios::binary);
  std::string line;
  if (std::getline(old, line) && line == kJournalFormat + key) {
    while (std::getline(old, line)) {
      std::optional<std::string> body = without_checksum(line);
      if (!body) break;
      journal.lines_.push_back(std::move(*body));
    }
  }
  old.close();
  if (Status status = journal.begin(); !status.ok()) return status.error();
  return journal;
}

// The file with what is remembered, whole or not at all; then appended to.
Status PlanJournal::begin() {
  std::filesystem::path fresh = path_;
  fresh += ".new";
  std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
  out << kJournalFormat << key_ << "\n";
  for (const std::string& body : lines_) out << with_checksum(body);
  out.close();
  std::error_code failed;
  if (out) std::filesystem::rename(fresh, path_, failed);
  file_ = std::ofstream(path_, std::ios::binary | std::ios::app);
  if (!out || failed || !file_) return Error{ErrorCode::kStorage, fmt::format("{} cannot be written", path_.string())};
  return Ok();
}

void PlanJournal::forget_the_rest() {
  lines_.resize(at_);
  if (!begin().ok()) file_.close();
}

std::optional<PlanJournal::Step> PlanJournal::next(const Step& asked) {
  if (!is_behind()) return std::nullopt;
  Step step = step_of(lines_[at_]);
  const auto same = [](const Answer& a, const Answer& b) { return a.artwork == b.artwork && a.patch == b.patch; };
  if (step.size() >= asked.size() && std::equal(asked.begin(), asked.end(), step.begin(), same)) {
    ++at_;
    return step;
  }
  forget_the_rest();
  return std::nullopt;
}

void PlanJournal::add(const Step& step) { append(body_of(step)); }

std::optional<std::string> PlanJournal::next_text(const std::string& kind) {
  if (!is_behind() || !lines_[at_].starts_with(kind + " ")) return std::nullopt;
  return lines_[at_++].substr(kind.size() + 1);
}

void PlanJournal::add_text(const std::string& kind, const std::string& text) { append(kind + " " + text); }

void PlanJournal::append(const std::string& body) {
  if (is_behind()) forget_the_rest();
  if (file_.is_open()) file_ << with_checksum(body) << std::flush;
}

std::string settings_key(std::span<const Artwork> artworks, std::span<const StockPanel> stock,
                         const PlanOptions& options) {
  std::string text = text_of(options);
  for (const Artwork& it : artworks)
    text += fmt::format("\n{} {} {} {} {} {}{}", it.letter, it.width.count(), it.height.count(), hash_of(it.picture),
                        hash_of(it.importance), hash_of(it.segmentation), text_of(it.guides));
  for (const StockPanel& it : stock) {
    text += fmt::format("\n{} {} {} {}", it.id.value, it.tone_weight, text_of(it.picture), text_of(it.free));
    // Only limits ask what a panel is of.
    if (!options.material_limits.empty()) text += fmt::format(" \"{}\"", it.material);
    for (const WoodZone& zone : it.zones) text += text_of(zone);
  }
  return hash_of(text);
}

std::string plan_key(const std::string& settings, const std::string& program) {
  return hash_of(program + "\n" + settings);
}

}  // namespace veneer::planner
