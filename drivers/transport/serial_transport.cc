#include "drivers/transport/serial_transport.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

namespace veneer {
namespace {

std::optional<speed_t> speed_of(unsigned baud) {
  constexpr std::array<std::pair<unsigned, speed_t>, 8> kSpeeds = {{{9600, B9600},
                                                                    {19200, B19200},
                                                                    {38400, B38400},
                                                                    {57600, B57600},
                                                                    {115200, B115200},
                                                                    {230400, B230400},
                                                                    {460800, B460800},
                                                                    {921600, B921600}}};
  for (const auto& [rate, speed] : kSpeeds)
    if (rate == baud) return speed;
  return std::nullopt;
}

std::string system_text(int number) { return std::generic_category().message(number); }

Error cannot_open(const std::string& path, int number) {
  std::string remedy =
      "check the cable, then Clear and Reset, or correct the port in the configuration, then restart veneerd";
  if (number == EACCES)
    remedy = "give the daemon's user the group of the device, usually dialout, then restart veneerd";
  if (number == EBUSY) remedy = "end the other program that holds it";
  return {ErrorCode::kUnavailable,
          fmt::format("the serial port {} does not open ({}): {}", path, system_text(number), remedy)};
}

// The far end of a pseudo-terminal, as the kernel numbers them (its documentation, devices.txt).
bool is_pseudo_terminal(const struct stat& file) {
  constexpr unsigned kFirstMajor = 136, kLastMajor = 143;
  return S_ISCHR(file.st_mode) && major(file.st_rdev) >= kFirstMajor && major(file.st_rdev) <= kLastMajor;
}

Error not_the_twins(const std::string& path) {
  return {ErrorCode::kInvalidArgument,
          fmt::format("{} is not the twin's port (a pseudo-terminal): give the twin's under [sim] laser, or for a real "
                      "controller kind = \"grbl\" and its port under [laser], then restart veneerd",
                      path)};
}

// Raw bytes both ways, no flow control, modem lines ignored.
bool make_raw(int descriptor, speed_t speed) {
  termios line{};
  if (::tcgetattr(descriptor, &line) != 0) return false;
  ::cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(HUPCL | CRTSCTS | CSTOPB);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  ::cfsetispeed(&line, speed);
  ::cfsetospeed(&line, speed);
  return ::tcsetattr(descriptor, TCSANOW, &line) == 0 && ::tcflush(descriptor, TCIOFLUSH) == 0;
}

}  // namespace

SerialTransport::SerialTransport(boost::asio::io_context& io, std::string path, unsigned baud, At at)
    : StreamTransport(io, path), path_(std::move(path)), baud_(baud), at_(at) {}

bool SerialTransport::supports_baud(unsigned baud) { return speed_of(baud).has_value(); }

Status SerialTransport::open(OnBytes on_bytes, OnClosed on_closed) {
  close();
  // Opening a real line alone may reset the board behind it; whether it is still the same is looked at once it is open.
  struct stat there {};
  if (at_ == At::kPseudoTerminal && ::stat(path_.c_str(), &there) == 0 && !is_pseudo_terminal(there))
    return not_the_twins(path_);
  const int descriptor = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return cannot_open(path_, errno);
  const auto refuse = [&](int number) {
    ::close(descriptor);
    return cannot_open(path_, number);
  };
  if (::fstat(descriptor, &there) != 0) return refuse(errno);
  const bool pseudo_terminal = is_pseudo_terminal(there);
  if (at_ == At::kPseudoTerminal && !pseudo_terminal) {
    ::close(descriptor);
    return not_the_twins(path_);
  }
  if (::isatty(descriptor) == 0) return refuse(ENOTTY);
  // TIOCEXCL keeps other programs out, the lock also another daemon of root's. A pseudo-terminal would stay closed to
  // the guardian and the next daemon, who are not root, for as long as its machine stands.
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) return refuse(errno == EWOULDBLOCK ? EBUSY : errno);
  if (!pseudo_terminal && ::ioctl(descriptor, TIOCEXCL) != 0) return refuse(errno);
  if (!make_raw(descriptor, speed_of(baud_).value_or(B115200))) return refuse(errno);
  listen(std::move(on_bytes), std::move(on_closed));
  run_on(descriptor);
  return Ok();
}

void SerialTransport::drop_unsent(int descriptor) noexcept { ::tcflush(descriptor, TCOFLUSH); }

}  // namespace veneer
