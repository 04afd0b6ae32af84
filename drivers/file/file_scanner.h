// Pictures from disk as a scanner: each scan gives the next one. For panels scanned elsewhere, and for repeating a
// fault.
//
// Contract and threading: drivers/scanner_driver.h.
#pragma once

#include "drivers/file/picture_source.h"
#include "drivers/scanner_driver.h"

namespace veneer {

class FileScanner final : public ScannerDriver {
 public:
  // `device` as PictureSource takes it. The pictures' resolution is believed to be the one asked for.
  explicit FileScanner(std::string device);

  Result<ScanFile> scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) override;
  std::string device() const override;

 private:
  PictureSource pictures_;
};

}  // namespace veneer
