// A raw picture as a file: PNM, binary, 8 or 16 bits, written in one go since nothing is compressed. Equal pixels make
// equal files.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "drivers/raw_picture.h"

namespace veneer {

// kStorage.
Status write_pnm(const RawPicture& picture, const std::filesystem::path& file);

}  // namespace veneer
