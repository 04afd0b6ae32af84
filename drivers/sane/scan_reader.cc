#include "drivers/sane/scan_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace veneer::sane {
namespace {

using FrameKind = FrameParameters::Kind;

constexpr int kLongestSide = 100'000;  // pixels: 2.1 m at 1200 dpi
constexpr std::chrono::milliseconds kLampLook{500}, kDataLook{5};

// One pass over the glass, its lines without their padding.
struct Frame {
  FrameParameters parameters;
  int lines = 0;
  std::vector<std::uint8_t> samples;
};

int channels_of(FrameKind kind) { return kind == FrameKind::kColour ? 3 : 1; }

std::size_t useful_bytes(const FrameParameters& p) {
  return static_cast<std::size_t>(p.pixels_per_line) * channels_of(p.kind) * (p.depth / 8);
}

// Which third of a picture in three passes.
std::optional<std::size_t> colour_of(FrameKind kind) {
  switch (kind) {
    case FrameKind::kRed:
      return 0;
    case FrameKind::kGreen:
      return 1;
    case FrameKind::kBlue:
      return 2;
    default:
      return std::nullopt;
  }
}

class Reader {
 public:
  Reader(ScanSource& source, const ReadOptions& options, const ScanProgress& progress, const std::stop_token& stop)
      : source_(source), options_(options), progress_(progress), stop_(stop) {}

  Result<RawPicture> read() {
    auto first = read_frame(0, 1);
    if (!first) return first.error();
    if (!colour_of(first->parameters.kind)) {
      if (!first->parameters.last)
        return fault("announces another frame behind a whole picture", "scan again with another mode under [scanner]");
      return RawPicture{first->parameters.pixels_per_line, first->lines, channels_of(first->parameters.kind),
                        first->parameters.depth, std::move(first->samples)};
    }
    return read_three(std::move(*first));
  }

 private:
  Error fault(std::string_view what, std::string_view remedy) const {
    return {ErrorCode::kDeviceFault, fmt::format("the scanner {} {}: {}", source_.scanner(), what, remedy)};
  }
  Error cancelled() const {
    return {ErrorCode::kCancelled,
            fmt::format("the scan was cancelled, and the scanner {} was told to end it", source_.scanner())};
  }
  void tell(double fraction, const std::string& doing) const {
    if (progress_) progress_(std::clamp(fraction, 0.0, 1.0), doing);
  }
  void pause(std::chrono::milliseconds time) const {
    if (options_.pause) options_.pause(time);
  }

  // Waits for the lamp where the device says that it waits itself.
  Status start() {
    for (std::chrono::milliseconds waited{0};; waited += kLampLook) {
      if (stop_.stop_requested()) return cancelled();
      const ScanStatus status = source_.start();
      if (status == ScanStatus::kGood) return Ok();
      if (status != ScanStatus::kWarmingUp || waited >= options_.warm_up)
        return error_of(status, source_.scanner(), "beginning the scan");
      tell(0, "the scanner's lamp is warming up");
      pause(kLampLook);
    }
  }

  Status check(const FrameParameters& p) const {
    if (p.kind == FrameKind::kOther)
      return fault("delivers a kind of picture that is neither grey nor colour",
                   "set mode under [scanner] to a colour mode (veneerctl scanner list)");
    if (p.depth != 8 && p.depth != 16)
      return fault(fmt::format("delivers {} bits a colour, which do not show wood", p.depth),
                   "set mode and depth under [scanner] so that they are 8 or 16 (veneerctl scanner list)");
    if (p.pixels_per_line <= 0 || p.pixels_per_line > kLongestSide || p.lines < -1 || p.lines == 0 ||
        p.lines > kLongestSide || p.bytes_per_line < 0 || static_cast<std::size_t>(p.bytes_per_line) < useful_bytes(p))
      return fault(fmt::format("announces a picture that cannot be, {} pixels in {} bytes a line and {} lines",
                               p.pixels_per_line, p.bytes_per_line, p.lines),
                   "correct area and dpi under [scanner], then scan again");
    if (Status width = check_side("wide", p.pixels_per_line, options_.expected_width); !width) return width;
    return p.lines < 0 ? Ok() : check_side("high", p.lines, options_.expected_height);
  }

  Status check_side(const char* side, int pixels, std::optional<double> expected) const {
    constexpr double kRounding = 0.01, kFewPixels = 32;
    if (!expected || std::abs(pixels - *expected) <= std::max(kFewPixels, kRounding * *expected)) return Ok();
    return fault(fmt::format("delivers a picture {} pixels {} where its own area and resolution make it {:.0f}, so its "
                             "scale is not what it says",
                             pixels, side, *expected),
                 "set another dpi or area under [scanner]");
  }

  double fraction_of(const FrameParameters& p, std::size_t bytes) const {
    const double lines = p.lines > 0 ? p.lines : options_.expected_height.value_or(0);
    return lines > 0 ? static_cast<double>(bytes) / (lines * p.bytes_per_line) : 0;
  }

  Result<Frame> read_frame(int number, int of) {
    if (Status started = start(); !started) return started.error();
    Frame frame;
    const FrameParameters& p = frame.parameters;
    if (const ScanStatus status = source_.parameters(frame.parameters); status != ScanStatus::kGood)
      return error_of(status, source_.scanner(), "asking how large the picture is");
    if (Status good = check(p); !good) return good.error();
    if (colour_of(p.kind)) of = 3;
    const std::size_t useful = useful_bytes(p), line = static_cast<std::size_t>(p.bytes_per_line);
    if (p.lines > 0) frame.samples.reserve(useful * p.lines);
    std::vector<std::uint8_t> portion(1 << 16);
    std::size_t bytes = 0;
    for (;;) {
      if (stop_.stop_requested()) return cancelled();
      std::size_t got = 0;
      const ScanStatus status = source_.read(portion, got);
      if (status == ScanStatus::kEnd) break;
      if (status != ScanStatus::kGood) return error_of(status, source_.scanner(), "scanning");
      if (got > portion.size()) return fault("says that it wrote more than there is room for", "update its driver");
      if (got == 0) pause(kDataLook);
      // Without the padding at the end of each line.
      for (std::size_t done = 0; done < got;) {
        const std::size_t column = bytes % line, take = std::min(got - done, line - column);
        if (column < useful) {
          const auto from = portion.begin() + static_cast<std::ptrdiff_t>(done);
          frame.samples.insert(frame.samples.end(), from,
                               from + static_cast<std::ptrdiff_t>(std::min(take, useful - column)));
        }
        done += take, bytes += take;
      }
      if (bytes > line * static_cast<std::size_t>(p.lines > 0 ? p.lines : kLongestSide))
        return fault(p.lines > 0 ? fmt::format("delivers more than the {} lines it announced", p.lines)
                                 : std::string("does not come to an end"),
                     "scan again, with another area or mode under [scanner] if that does not help");
      tell((number + fraction_of(p, bytes)) / of, "");
    }
    auto picture = whole(std::move(frame), bytes);
    if (picture) tell(static_cast<double>(number + 1) / of, "");
    return picture;
  }

  Result<Frame> whole(Frame frame, std::size_t bytes) const {
    const FrameParameters& p = frame.parameters;
    const std::size_t line = static_cast<std::size_t>(p.bytes_per_line);
    frame.lines = static_cast<int>(bytes / line);
    if (bytes == 0) return error_of(ScanStatus::kEnd, source_.scanner(), "scanning");
    if (bytes % line != 0 || (p.lines > 0 && frame.lines != p.lines))
      return fault(p.lines > 0 ? fmt::format("broke off after {} of {} lines", frame.lines, p.lines)
                               : fmt::format("broke off within line {}", frame.lines + 1),
                   "scan again; part of a picture is never used");
    if (Status height = check_side("high", frame.lines, options_.expected_height); !height) return height.error();
    return frame;
  }

  Result<RawPicture> read_three(Frame first) {
    const FrameParameters p = first.parameters;
    const int lines = first.lines;
    std::array<std::optional<std::vector<std::uint8_t>>, 3> colours;
    colours[*colour_of(p.kind)] = std::move(first.samples);
    bool last = p.last;
    for (int number = 1; number < 3; ++number) {
      if (last) return fault("ends before all three colours were scanned", "scan again");
      auto next = read_frame(number, 3);
      if (!next) return next.error();
      const auto colour = colour_of(next->parameters.kind);
      if (!colour || colours[*colour] || next->lines != lines || next->parameters.depth != p.depth ||
          next->parameters.pixels_per_line != p.pixels_per_line)
        return fault("delivers three colours that do not fit together", "scan again");
      colours[*colour] = std::move(next->samples);
      last = next->parameters.last;
    }
    if (!last) return fault("announces a fourth colour", "scan again with another mode under [scanner]");
    RawPicture out{p.pixels_per_line, lines, 3, p.depth, {}};
    const std::size_t bytes = p.depth / 8, samples = colours[0]->size() / bytes;
    out.samples.resize(3 * samples * bytes);
    for (std::size_t colour = 0; colour < 3; ++colour)
      for (std::size_t i = 0; i < samples; ++i)
        for (std::size_t b = 0; b < bytes; ++b)
          out.samples[(3 * i + colour) * bytes + b] = (*colours[colour])[i * bytes + b];
    return out;
  }

  ScanSource& source_;
  const ReadOptions& options_;
  const ScanProgress& progress_;
  const std::stop_token& stop_;
};

// A device that is not told waits for whoever began the scan, and some keep the carriage out.
struct AlwaysEnded {
  ScanSource& source;
  ~AlwaysEnded() { source.cancel(); }
};

}  // namespace

Result<RawPicture> read_scan(ScanSource& source, const ReadOptions& options, const ScanProgress& progress,
                             const std::stop_token& stop) {
  const AlwaysEnded ended{source};
  return Reader(source, options, progress, stop).read();
}

}  // namespace veneer::sane
