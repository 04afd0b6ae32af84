// A raw scan as a picture file: PNM, binary, 8 or 16 bits, written in one go since nothing is compressed.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "drivers/sane/scan_reader.h"

namespace veneer::sane {

// kStorage.
Status write_pnm(const RawScan& scan, const std::filesystem::path& file);

}  // namespace veneer::sane
