// A scanner that sees the same each time, from a file (PPM) that a test writes: alike but for a bit of noise, as a
// device's pictures are.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/scanner_driver.h"

namespace veneer::testing {

class OnePicture final : public ScannerDriver {
 public:
  Result<ScanFile> scan(ScanResolution, const ScanProgress&, std::stop_token) override {
    if (!repeats) add_noise();
    return ScanFile{file, nominal, device(), make};
  }
  std::string device() const override { return "test:0"; }
  std::filesystem::path file;
  ScanResolution nominal{};
  std::string make;
  bool repeats = false;  // the picture is the one before to the last bit, as a file that stays where it is

 private:
  // One value of the last pixel, by one.
  void add_noise() const {
    std::fstream picture(file, std::ios::in | std::ios::out | std::ios::binary);
    picture.seekg(-1, std::ios::end);
    const int value = picture.get();
    picture.seekp(-1, std::ios::end);
    picture.put(static_cast<char>((value + 1) % 256));
  }
};

}  // namespace veneer::testing
