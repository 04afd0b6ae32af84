// From a scanner that delivers frames to one whole picture, or none: what is short, long or not what was announced is
// refused in words.
//
// A frame is one pass over the glass: grey, all colours at once, or one colour of three. Its bytes come in lines that
// may be padded, in portions of any size.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/raw_picture.h"
#include "drivers/sane/scan_status.h"
#include "drivers/scanner_driver.h"

namespace veneer::sane {

struct FrameParameters {
  enum class Kind { kGrey, kColour, kRed, kGreen, kBlue, kOther };
  Kind kind = Kind::kOther;
  bool last = true;
  int bytes_per_line = 0;
  int pixels_per_line = 0;
  int lines = -1;  // -1: the device does not know yet
  int depth = 0;   // bits of a sample; 16 in the byte order of this machine
};

// An open scanner, set as wanted. Every call may block as long as the device likes.
class ScanSource {
 public:
  virtual ~ScanSource() = default;
  virtual const std::string& scanner() const = 0;  // for sentences
  virtual ScanStatus start() = 0;                  // the first frame, or the next
  virtual ScanStatus parameters(FrameParameters& out) = 0;
  // kGood with 0 bytes: none are there yet. kEnd: the frame is over.
  virtual ScanStatus read(std::span<std::uint8_t> room, std::size_t& got) = 0;
  virtual void cancel() = 0;  // ends the scan, whole or not
};

struct ReadOptions {
  // What area and resolution make of it, pixels. A picture that is further off than rounding explains (1 %, or 32
  // pixels of a small one) was scanned at another resolution than the device says.
  std::optional<double> expected_width, expected_height;
  std::chrono::milliseconds warm_up{180'000};  // for how long a lamp may take
  std::function<void(std::chrono::milliseconds)> pause;
};

// Ends the scan on every way out. kCancelled after a stop request, seen between two portions.
Result<RawPicture> read_scan(ScanSource& source, const ReadOptions& options, const ScanProgress& progress,
                             const std::stop_token& stop);

}  // namespace veneer::sane
