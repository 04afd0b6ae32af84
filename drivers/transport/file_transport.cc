#include "drivers/transport/file_transport.h"

#include <fmt/format.h>

#include <utility>

namespace veneer {

FileTransport::FileTransport(std::filesystem::path path) : path_(std::move(path)) {}

Status FileTransport::open(OnBytes, OnClosed) {
  close();
  file_.open(path_, std::ios::binary | std::ios::trunc);
  if (!file_.is_open())
    return Error{ErrorCode::kUnavailable,
                 fmt::format("the file {} cannot be written: check its folder and permissions", path_.string())};
  return Ok();
}

void FileTransport::write(std::string_view bytes) {
  if (!file_.is_open()) return;
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file_.flush();
}

void FileTransport::write_urgent(std::string_view bytes) noexcept { write(bytes); }

void FileTransport::close() noexcept {
  if (file_.is_open()) file_.close();
}

}  // namespace veneer
