#include "daemon/orders/artwork_file.h"

#include "base/files.h"
#include "planner/drawings/drawn_areas.h"
#include "planner/pictures/pictures.h"
#include "planner/suggest/crops.h"

namespace veneer::daemon {

Result<planner::Artwork> read_artwork(const ArtworkFiles& files, const std::string& name, const std::string& crop,
                                      Millimetres size) {
  auto picture = planner::decode_picture(read_whole(files.picture).value_or(""), name);
  if (!picture) return picture.error();
  planner::Artwork out;
  out.name = name;
  out.letter = planner::artwork_letter(0);
  out.picture = std::move(*picture);
  if (!files.segmentation.empty()) {
    auto areas = planner::areas_of_file(read_whole(files.segmentation).value_or(""), "the drawing of " + name);
    if (!areas) return areas.error();
    out.segmentation = std::move(*areas);
  }
  if (!crop.empty()) {
    const auto part = planner::crop_of(crop, out.picture.size(), name);
    if (!part) return part.error();
    planner::crop_pictures(out, *part);
  }
  const planner::ArtworkSize whole = planner::artwork_size(out.picture, size);
  out.width = whole.width, out.height = whole.height;
  return out;
}

}  // namespace veneer::daemon
