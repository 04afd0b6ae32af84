#include "calib/tag_pattern.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
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

template <class Pattern>
Result<Pattern> pattern_of(const char* name, int id, int ids, apriltag_family_t* (*create)(),
                           void (*destroy)(apriltag_family_t*)) {
  if (id < 0 || id >= ids)
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("there is no tag {}: the family {} has 0 to {}", id, name, ids - 1)};
  const std::unique_ptr<apriltag_family_t, decltype(destroy)> family(create(), destroy);
  const std::unique_ptr<image_u8_t, TagPictureDeleter> picture(
      apriltag_to_image(family.get(), static_cast<unsigned>(id)));
  Pattern out;
  for (std::size_t row = 0; row < Pattern::kCells; ++row)
    for (std::size_t column = 0; column < Pattern::kCells; ++column)
      out.black[row][column] = picture->buf[row * static_cast<std::size_t>(picture->stride) + column] < 128;
  return out;
}

}  // namespace

Result<TagPattern> tag_pattern(int id) {
  return pattern_of<TagPattern>("36h11", id, kTagIds, tag36h11_create, tag36h11_destroy);
}
Result<LabelTagPattern> label_tag_pattern(int id) {
  return pattern_of<LabelTagPattern>("Standard41h12", id, kLabelTagIds, tagStandard41h12_create,
                                     tagStandard41h12_destroy);
}

}  // namespace veneer::calib
