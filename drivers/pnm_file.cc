#include "drivers/pnm_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <fstream>
#include <string>
#include <vector>

namespace veneer {

Status write_pnm(const RawPicture& picture, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << fmt::format("P{}\n{} {}\n{}\n", picture.channels == 3 ? 6 : 5, picture.width, picture.height,
                     picture.bits == 16 ? 65535 : 255);
  // PNM has the high byte first.
  const bool swap = picture.bits == 16 && std::endian::native == std::endian::little;
  std::vector<char> portion;
  constexpr std::size_t kPortion = 1 << 20;
  for (std::size_t begin = 0; begin < picture.samples.size() && out; begin += kPortion) {
    const auto from = picture.samples.begin() + static_cast<std::ptrdiff_t>(begin);
    portion.assign(from, from + static_cast<std::ptrdiff_t>(std::min(kPortion, picture.samples.size() - begin)));
    if (swap)
      for (std::size_t i = 0; i + 1 < portion.size(); i += 2) std::swap(portion[i], portion[i + 1]);
    out.write(portion.data(), static_cast<std::streamsize>(portion.size()));
  }
  if (out.flush()) return Ok();
  return Error{
      ErrorCode::kStorage,
      fmt::format("the picture cannot be written to {}: make room on the disk, then try again", file.string())};
}

}  // namespace veneer
