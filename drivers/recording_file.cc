#include "drivers/recording_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace veneer {
namespace {

Error no_plain_file(const std::filesystem::path& path) {
  return {
      ErrorCode::kInvalidArgument,
      fmt::format("{} is no plain file: name one behind file:, or a new one, and a controller by serial:, tcp: or usb:",
                  path.string())};
}

Error cannot_record(const std::filesystem::path& path) {
  return {ErrorCode::kUnavailable,
          fmt::format("the file {} cannot be written: check its folder and permissions", path.string())};
}

}  // namespace

Status RecordingFile::open(const std::filesystem::path& path) {
  close();
  // Opening a serial port alone may reset the board behind it, so that what is there is looked at before.
  struct stat there {};
  if (::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) return no_plain_file(path);
  // It may be another one by now: a pipe is not waited for, a terminal not taken, and what was opened is looked at.
  constexpr mode_t kMode = 0666;
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, kMode);
  if (descriptor < 0) return cannot_record(path);
  const bool plain = ::fstat(descriptor, &there) == 0 && S_ISREG(there.st_mode);
  const bool emptied = plain && ::ftruncate(descriptor, 0) == 0;
  if (emptied) file_.reset(::fdopen(descriptor, "wb"));
  if (file_) return Ok();
  ::close(descriptor);
  return plain ? cannot_record(path) : no_plain_file(path);
}

void RecordingFile::write(std::string_view bytes) noexcept {
  if (file_) static_cast<void>(std::fwrite(bytes.data(), 1, bytes.size(), file_.get()));
}

void RecordingFile::flush() noexcept {
  if (file_) static_cast<void>(std::fflush(file_.get()));
}

}  // namespace veneer
