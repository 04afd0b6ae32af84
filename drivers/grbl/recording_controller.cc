#include "drivers/grbl/recording_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <charconv>
#include <utility>

namespace veneer::grbl {
namespace {

constexpr std::string_view kRecordingBanner = "\r\nGrbl 1.1h (recording into a file) ['$' for help]\r\n";

bool is_realtime(unsigned char byte) {
  return byte == '?' || byte == '!' || byte == '~' || byte == 0x18 || byte >= 0x80;
}

}  // namespace

RecordingController::RecordingController(boost::asio::io_context& io, std::filesystem::path path, Millimetres travel_x,
                                         Millimetres travel_y)
    : io_(io),
      path_(std::move(path)),
      travel_x_(travel_x),
      travel_y_(travel_y),
      generation_(std::make_shared<int>(0)) {}

Status RecordingController::open(OnBytes on_bytes, OnClosed) {
  close();
  if (Status opened = file_.open(path_); !opened) return opened;
  on_bytes_ = std::move(on_bytes);
  return Ok();
}

void RecordingController::write(std::string_view bytes) {
  if (!file_.is_open()) return;
  for (const char byte : bytes) take(byte);
  file_.flush();
}

void RecordingController::write_urgent(std::string_view bytes) noexcept {
  line_.clear();
  write(bytes);
}

void RecordingController::close() noexcept {
  generation_ = std::make_shared<int>(0);
  on_bytes_ = nullptr;
  line_.clear();
  file_.close();
}

void RecordingController::take(char byte) {
  const auto code = static_cast<unsigned char>(byte);
  if (code != '?') file_.write({&byte, 1});
  if (is_realtime(code)) return realtime(code);
  if (byte != '\n') {
    line_ += byte;
    return;
  }
  execute(std::exchange(line_, {}));
}

void RecordingController::realtime(unsigned char byte) {
  const auto turn = [&](int& value, int to) { value = std::clamp(to, 10, 200); };
  switch (byte) {
    case '?':
      return say(report());
    case 0x18:
      return reset();
    case '!':
      held_ = true;
      return;
    case '~':
      held_ = false;
      return;
    case 0x90:
      return turn(overrides_[0], 100);
    case 0x91:
      return turn(overrides_[0], overrides_[0] + 10);
    case 0x92:
      return turn(overrides_[0], overrides_[0] - 10);
    case 0x93:
      return turn(overrides_[0], overrides_[0] + 1);
    case 0x94:
      return turn(overrides_[0], overrides_[0] - 1);
    case 0x95:
      return turn(overrides_[1], 100);
    case 0x96:
      return turn(overrides_[1], 50);
    case 0x97:
      return turn(overrides_[1], 25);
    case 0x99:
      return turn(overrides_[2], 100);
    case 0x9A:
      return turn(overrides_[2], overrides_[2] + 10);
    case 0x9B:
      return turn(overrides_[2], overrides_[2] - 10);
    case 0x9C:
      return turn(overrides_[2], overrides_[2] + 1);
    case 0x9D:
      return turn(overrides_[2], overrides_[2] - 1);
    default:
      return;
  }
}

void RecordingController::reset() {
  line_.clear();
  modes_ = {};
  overrides_ = {100, 100, 100};
  held_ = checking_ = false;
  say(std::string(kRecordingBanner));
}

void RecordingController::execute(const std::string& line) {
  if (!line.empty() && line[0] == '$' && line.substr(0, 3) != "$J=") return system_command(line);
  const bool jog = line.substr(0, 3) == "$J=";
  const Modes before = modes_;
  block(jog ? line.substr(3) : line);
  if (jog) modes_ = before;
  say("ok\r\n");
}

void RecordingController::system_command(const std::string& line) {
  if (line == "$I") return say("[VER:1.1h.recording:]\r\n[OPT:VZ,15,128]\r\nok\r\n");
  if (line == "$G") return say(fmt::format("[GC:{}]\r\nok\r\n", modes()));
  if (line == "$$")
    return say(fmt::format(
        "$11=0.010\r\n$12=0.002\r\n$13=0\r\n$22=1\r\n$23=3\r\n$27=0.000\r\n$30=1000\r\n$32=1\r\n$100=80\r\n"
        "$101=80\r\n$110=30000\r\n$111=30000\r\n$120=3000\r\n$121=3000\r\n$130={:.3f}\r\n$131={:.3f}\r\nok\r\n",
        travel_x_.count(), travel_y_.count()));
  if (line == "$H") at_ = {};
  say("ok\r\n");
  // A reset ends the check mode.
  if (line == "$C" && !(checking_ = !checking_)) reset();
}

// One line of G-code: the words the driver uses, in the order in which GRBL executes them.
void RecordingController::block(const std::string& line) {
  bool absolute = !modes_.relative;
  const char* const end = line.data() + line.size();
  for (const char* at = line.data(); at != end;) {
    const char letter = *at++;
    double value = 0;
    const auto [behind, error] = std::from_chars(at, end, value);
    if (error != std::errc()) continue;
    at = behind;
    const int number = static_cast<int>(value);
    if (letter == 'G' && number <= 3) modes_.motion = number;
    if (letter == 'G' && number == 53) absolute = true;
    if (letter == 'G' && (number == 90 || number == 91)) absolute = !(modes_.relative = number == 91);
    if (letter == 'M' && number >= 3 && number <= 5) modes_.power_mode = number;
    if (letter == 'M' && (number == 8 || number == 9)) modes_.air = number == 8;
    if (letter == 'F') modes_.feed = value;
    if (letter == 'S') modes_.power = value;
    if (checking_ || letter < 'X' || letter > 'Z') continue;
    double& axis = at_.at(static_cast<std::size_t>(letter - 'X'));
    axis = absolute ? value : axis + value;
  }
}

std::string RecordingController::report() const {
  return fmt::format("<{}|MPos:{:.3f},{:.3f},{:.3f}|FS:0,0|Ov:{},{},{}>\r\n",
                     checking_ ? "Check"
                     : held_   ? "Hold:0"
                               : "Idle",
                     at_[0], at_[1], at_[2], overrides_[0], overrides_[1], overrides_[2]);
}

std::string RecordingController::modes() const {
  return fmt::format("G{} G54 G17 G21 {} G94 M{} {} T0 F{:.0f} S{:.0f}", modes_.motion, modes_.relative ? "G91" : "G90",
                     modes_.power_mode, modes_.air ? "M8" : "M9", modes_.feed, modes_.power);
}

void RecordingController::say(std::string bytes) {
  boost::asio::post(io_, [this, alive = std::weak_ptr<int>(generation_), bytes = std::move(bytes)] {
    if (!alive.expired() && on_bytes_) on_bytes_(bytes);
  });
}

}  // namespace veneer::grbl
