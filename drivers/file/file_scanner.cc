#include "drivers/file/file_scanner.h"

#include <utility>

namespace veneer {

FileScanner::FileScanner(std::string device) : pictures_(std::move(device)) {}

Result<ScanFile> FileScanner::scan(ScanResolution resolution, const ScanProgress& progress, std::stop_token stop) {
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the scan was cancelled"};
  auto picture = pictures_.next();
  if (!picture.ok()) return picture.error();
  if (progress) progress(1, "");
  return ScanFile{picture->file, resolution, "file:" + picture->file.string(), ""};
}

std::string FileScanner::device() const { return "file:" + pictures_.pattern(); }

}  // namespace veneer
