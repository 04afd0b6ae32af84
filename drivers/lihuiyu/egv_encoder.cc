#include "drivers/lihuiyu/egv_encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/job_check.h"
#include "drivers/lihuiyu/speed_code.h"

namespace veneer::lihuiyu {
namespace {

constexpr std::string_view kFinish = "FNSE";
constexpr std::string_view kNextSpeed = "@NSE";  // leaves compact mode, ready for another speed code

bool same_setting(const Stroke& a, const Stroke& b) { return a.speed == b.speed && a.power == b.power; }

class ProgramWriter {
 public:
  ProgramWriter(const Stroke& setting, MilPoint at, const EncoderOptions& options)
      : options_(options), at_(at), step_s_(kMillimetresPerMil / setting.speed.count()) {
    const double power = setting.power.count();
    if (power <= 0) {
      duty_ = 0;
    } else if (options.board == Board::kM2) {
      duty_ = power;
    } else {
      program_.power_permille = std::clamp(static_cast<int>(std::lround(power * 1000)), 1, 1000);
    }
    program_.begin = at;
    program_.text = "I" + speed_code(setting.speed);
  }

  // The dark way to the first stroke, and into compact mode.
  void begin_at(MilPoint start) {
    std::string& text = program_.text;
    if (start.x != at_.x) text += (start.x > at_.x ? "B" : "T") + distance_code(std::abs(start.x - at_.x));
    if (start.y != at_.y) text += (start.y > at_.y ? "R" : "L") + distance_code(std::abs(start.y - at_.y));
    text += "NRBS1E";
    program_.length_mm +=
        kMillimetresPerMil * static_cast<double>(std::abs(start.x - at_.x) + std::abs(start.y - at_.y));
    at_ = program_.start = start;
    if (packets()) fill_packet();
  }

  void stroke(const Stroke& stroke, const MilGrid& grid) {
    const MilPoint start = grid.nearest(stroke.path.front());
    const std::vector<StepRun> runs = runs_along(stroke.path, grid);
    std::int64_t steps = 0;
    for (const StepRun& run : runs) steps += run.length;
    for (int pass = 0; pass < stroke.passes; ++pass) {
      for (const StepRun& run : runs_between(at_, start)) move(run, false);
      spread_pulses(steps);
      for (const StepRun& run : runs) burn(run);
    }
  }

  Program finish(std::string_view ending) {
    if (beam_) letter('U');
    // Not with a full packet: an empty one would have to follow it, and if the board had ended by then, nobody would be
    // told: a packet clears what its lines say.
    if (packets() && (program_.text.size() + ending.size()) % kPayloadBytes == 0) letter('U');
    program_.text += ending;
    program_.end = at_;
    return std::move(program_);
  }

 private:
  bool packets() const { return options_.packet_motion_s > 0; }

  // Of one pass of a stroke: whole pulses, as near to the wanted share of its steps as they come, with half a gap
  // before the first and behind the last, so that both ends of a mark are burnt alike.
  void spread_pulses(std::int64_t steps) {
    const auto all = static_cast<double>(std::max<std::int64_t>(steps, 1));
    share_ = std::max(1.0, std::round(duty_ * all)) / all;
    owed_ = 0.5;
  }

  void burn(const StepRun& run) {
    if (duty_ >= 1) return move(run, true);
    if (duty_ <= 0) return move(run, false);
    for (std::int64_t left = run.length; left > 0;) {
      const bool on = owed_ + share_ >= 1;
      std::int64_t steps = 0;
      while (left > 0 && (owed_ + share_ >= 1) == on) {
        owed_ += share_ - (on ? 1 : 0);
        ++steps;
        --left;
      }
      move({run.dx, run.dy, steps}, on);
    }
  }

  void move(const StepRun& run, bool on) {
    for (std::int64_t left = run.length; left > 0;) {
      const std::int64_t steps = packets() ? std::min(left, room()) : left;
      if (steps <= 0) {
        fill_packet();
        continue;
      }
      const std::string code = letters(run, on) + distance_code(steps);
      // Room for the U that ends the packet and moves the distance.
      if (packets() && used() + code.size() >= kPayloadBytes) {
        fill_packet();
        continue;
      }
      program_.text += code;
      left_ = run.dx == 0 ? left_ : run.dx < 0;
      up_ = run.dy == 0 ? up_ : run.dy < 0;
      engaged_x_ = run.dx != 0;
      engaged_y_ = run.dy != 0;
      beam_ = on;
      at_.x += run.dx * steps;
      at_.y += run.dy * steps;
      packet_steps_ += steps;
      program_.shortest_s += static_cast<double>(steps) * step_s_;
      const int axes = (run.dx != 0 ? 1 : 0) + (run.dy != 0 ? 1 : 0);
      program_.length_mm += kMillimetresPerMil * static_cast<double>(axes * steps);
      left -= steps;
    }
  }

  // What must precede the distance of a run.
  std::string letters(const StepRun& run, bool on) const {
    std::string code;
    if (on != beam_) code += on ? 'D' : 'U';
    const char x = run.dx < 0 ? 'T' : 'B', y = run.dy < 0 ? 'L' : 'R';
    const bool turn_x = run.dx != 0 && (run.dx < 0) != left_, turn_y = run.dy != 0 && (run.dy < 0) != up_;
    if (run.dx != 0 && run.dy != 0) {
      if (turn_x) code += x;
      if (turn_y) code += y;
      if (turn_x || turn_y || !engaged_x_ || !engaged_y_) code += 'M';
    } else if (run.dx != 0) {
      if (turn_x || engaged_y_) code += x;
    } else if (turn_y || engaged_x_) {
      code += y;
    }
    return code;
  }

  std::int64_t room() const {
    // The longest distance that still finds room in a packet with its letters.
    constexpr double kLongest = 20 * 255;
    const auto most = static_cast<std::int64_t>(std::clamp(options_.packet_motion_s / step_s_, 1.0, kLongest));
    return most - packet_steps_;
  }
  std::size_t used() const { return program_.text.size() % kPayloadBytes; }

  // The rest of the packet is dark.
  void fill_packet() {
    while (used() != 0) program_.text += 'U';
    beam_ = false;
    packet_steps_ = 0;
  }

  void letter(char c) {
    program_.text += c;
    beam_ = false;
  }

  EncoderOptions options_;
  Program program_;
  MilPoint at_;
  double step_s_;
  double duty_ = 1;              // the share of steps that is asked for
  double share_ = 1, owed_ = 0;  // of this pass, and of a pulse by now
  bool left_ = false, up_ = false, engaged_x_ = true, engaged_y_ = false, beam_ = false;
  std::int64_t packet_steps_ = 0;
};

}  // namespace

std::string distance_code(std::int64_t mils) {
  std::string code(static_cast<std::size_t>(mils / 255), 'z');
  const auto rest = static_cast<int>(mils % 255);
  if (rest == 0) return code;
  if (rest > 51) return code + fmt::format("{:03}", rest);
  if (rest <= 25) return code + static_cast<char>('a' + rest - 1);
  return code + '|' + static_cast<char>('a' + rest - 26);
}

std::vector<Program> write_programs(std::span<const Stroke> strokes, std::size_t first, MilPoint at,
                                    const MilGrid& grid, const EncoderOptions& options) {
  std::vector<Program> programs;
  for (std::size_t begin = 0, end = 0; begin < strokes.size(); begin = end) {
    ProgramWriter writer(strokes[begin], at, options);
    writer.begin_at(grid.nearest(strokes[begin].path.front()));
    while (end < strokes.size() && same_setting(strokes[begin], strokes[end])) writer.stroke(strokes[end++], grid);
    Program program = writer.finish(kFinish);
    program.first_stroke = first + begin;
    program.stroke_count = end - begin;
    at = program.end;
    programs.push_back(std::move(program));
  }
  return programs;
}

std::string write_egv(const LaserJob& job, const MilGrid& grid) {
  std::string text =
      "Document type : LHYMICRO-GL file\nFile version: 1.0.01\nCopyright: Unknown\nCreator-Software: veneerd\n\n"
      "%0%0%0%0%";
  const std::vector<Program> programs =
      write_programs(job.strokes, 0, {}, grid, {.board = Board::kM2, .packet_motion_s = 0});
  for (std::size_t i = 0; i < programs.size(); ++i) {
    std::string_view part = programs[i].text;
    // An I in the middle would clear what is not yet executed.
    if (i > 0) part.remove_prefix(1);
    const bool last = i + 1 == programs.size();
    part.remove_suffix(kFinish.size());
    text += part;
    text += last ? kFinish : kNextSpeed;
  }
  return text + "\n";
}

Status check_job(const LaserJob& job, const MilGrid& grid) {
  JobLimits limits;
  limits.travel = {point<MachineFrame>(0, 0), point<MachineFrame>(grid.travel_x_mm, grid.travel_y_mm)};
  limits.slowest = MmPerSecond(kSlowestMmPerSecond);
  limits.fastest = MmPerSecond(kFastestMmPerSecond);
  limits.speed_words =
      fmt::format("{} to {} mm/s, the limits of a Lihuiyu board", kSlowestMmPerSecond, kFastestMmPerSecond);
  limits.same_place = [&grid](const auto& a, const auto& b) { return grid.nearest(a) == grid.nearest(b); };
  return veneer::check_job(job, limits);
}

}  // namespace veneer::lihuiyu
