// Records every byte written into a file; nothing ever answers. For looking at what a driver would send first.
#pragma once

#include <filesystem>
#include <fstream>

#include "drivers/transport.h"

namespace veneer {

class FileTransport final : public Transport {
 public:
  explicit FileTransport(std::filesystem::path path);

  Status open(OnBytes on_bytes, OnClosed on_closed) override;
  void write(std::string_view bytes) override;
  void write_urgent(std::string_view bytes) noexcept override;
  void close() noexcept override;

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

}  // namespace veneer
