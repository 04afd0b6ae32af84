#include "calib/tag_pattern.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>

namespace veneer::calib {
namespace {

// Debian's library keeps image_u8_destroy to itself; a picture is two blocks of malloc.
struct TagPictureDeleter {
  void operator()(image_u8_t* picture) const {
    std::free(picture->buf);
    std::free(picture);
  }
};

}  // namespace

Result<TagPattern> tag_pattern(int id) {
  if (id < 0 || id >= kTagIds)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no tag {}: the family 36h11 has 0 to {}", id, kTagIds - 1)};
  const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(), tag36h11_destroy);
  const std::unique_ptr<image_u8_t, TagPictureDeleter> picture(
      apriltag_to_image(family.get(), static_cast<unsigned>(id)));
  TagPattern out;
  for (std::size_t row = 0; row < TagPattern::kCells; ++row)
    for (std::size_t column = 0; column < TagPattern::kCells; ++column)
      out.black[row][column] = picture->buf[row * static_cast<std::size_t>(picture->stride) + column] < 128;
  return out;
}

}  // namespace veneer::calib
