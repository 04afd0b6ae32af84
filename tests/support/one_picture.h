// A scanner that always sees the same picture, from a file that a test writes.
#pragma once

#include <filesystem>
#include <string>

#include "drivers/scanner_driver.h"

namespace veneer::testing {

class OnePicture final : public ScannerDriver {
 public:
  Result<ScanFile> scan(ScanResolution, const ScanProgress&, std::stop_token) override {
    return ScanFile{file, nominal, device(), make};
  }
  std::string device() const override { return "test:0"; }
  std::filesystem::path file;
  ScanResolution nominal{};
  std::string make;
};

}  // namespace veneer::testing
