// What a GRBL-class controller says, line by line.
//
// Tolerant where forks differ (unknown fields, order, missing fields), strict in numbers: a report with a broken number
// is UnknownReply, never a half-read position. Pure functions; LineReader is not thread-safe.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace veneer::grbl {

struct Acknowledged {};  // "ok": the line is parsed and queued, not executed
struct Refused {         // "error:N"
  int number = 0;
};
struct AlarmRaised {  // "ALARM:N"
  int number = 0;
};
struct Banner {  // the controller was reset
  std::string text;
};
struct StatusReport {  // "<Idle|MPos:0.000,0.000,0.000|FS:0,0>"
  using Xy = std::array<double, 2>;
  std::string state;  // with its sub-state: "Hold:0"
  std::optional<Xy> machine_position, work_position, work_offset;
  std::optional<double> machine_z, work_z, offset_z;  // of the same, where the machine has a third axis
  std::optional<double> power;                        // S as commanded at this moment
  std::optional<std::array<int, 3>> overrides;        // feed, rapid, power in per cent
  bool is(std::string_view name) const;               // "Hold" is also said of "Hold:1"
};
// "Door:0" is a lid that is closed again and waits for a cycle start, "Door:3" one that is being left.
bool lid_is_open(const StatusReport& report);
struct SettingLine {  // "$130=520.000"
  int number = 0;
  double value = 0;
};
struct BuildOptions {  // "[OPT:V,15,128]"
  std::string letters;
  std::optional<std::size_t> planner_blocks, receive_bytes;
};
struct BuildVersion {  // "[VER:1.1h.20190830:]"
  std::string text;
};
struct Signals {  // "[SIGNALS:HSRED]": which inputs grblHAL has; D is the safety door
  std::string letters;
};
struct Firmware {  // "[FIRMWARE:grblHAL]"
  std::string name;
};
struct ParserState {  // "[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 F900 S850]"
  std::string text;
  std::vector<std::string> words;  // without F and S
  double feed = 0, power = 0;
  bool has(std::string_view word) const;
};
struct Message {  // "[MSG:...]" and other bracketed news
  std::string text;
};
struct UnknownReply {
  std::string text;
};

using Reply = std::variant<Acknowledged, Refused, AlarmRaised, Banner, StatusReport, SettingLine, BuildOptions,
                           BuildVersion, Signals, Firmware, ParserState, Message, UnknownReply>;

// `line` without its line ending, not empty.
Reply parse_reply(std::string_view line);

// Cuts a byte stream into lines; CR and LF both end one, empty lines are dropped. A line longer than 400 bytes is
// noise: it is delivered cut to that length.
class LineReader {
 public:
  void feed(std::string_view bytes, const std::function<void(std::string_view)>& on_line);
  void clear() { line_.clear(); }

 private:
  std::string line_;
};

}  // namespace veneer::grbl
