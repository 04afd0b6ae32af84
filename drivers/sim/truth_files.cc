#include "drivers/sim/truth_files.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

namespace veneer::sim {

namespace fs = std::filesystem;
using nlohmann::json;

Status write_whole(const fs::path& file, const std::string& bytes) {
  std::error_code failed;
  fs::create_directories(file.parent_path(), failed);
  const fs::path fresh = file.string() + ".new";
  {
    std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.flush();
    if (!out)
      return Error{ErrorCode::kStorage, fmt::format("cannot write {}: is the disk full or read-only?", fresh.string())};
  }
  fs::rename(fresh, file, failed);
  if (failed)
    return Error{ErrorCode::kStorage, fmt::format("cannot put {} in place: {}", file.string(), failed.message())};
  return Ok();
}

Status write_json(const fs::path& file, const json& value) { return write_whole(file, value.dump(1) + "\n"); }

Result<json> read_json(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return Error{ErrorCode::kNotFound, fmt::format("there is no {}", file.string())};
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded())
    return Error{ErrorCode::kStorage, fmt::format("{} is broken: it is not JSON", file.string())};
  return value;
}

Status write_picture(const fs::path& file, const cv::Mat& picture) {
  std::error_code failed;
  fs::create_directories(file.parent_path(), failed);
  const fs::path fresh = file.parent_path() / (".new-" + file.filename().string());
  try {
    if (!cv::imwrite(fresh.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
      return Error{ErrorCode::kStorage, fmt::format("cannot write {}: is the disk full or read-only?", fresh.string())};
    }
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kStorage, fmt::format("cannot write {}: {}", fresh.string(), e.err)};
  }
  fs::rename(fresh, file, failed);
  if (failed)
    return Error{ErrorCode::kStorage, fmt::format("cannot put {} in place: {}", file.string(), failed.message())};
  return Ok();
}

Result<cv::Mat> read_picture(const fs::path& file, int flags) {
  cv::Mat picture;
  try {
    picture = cv::imread(file.string(), flags);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) return Error{ErrorCode::kStorage, fmt::format("cannot read the picture {}", file.string())};
  return picture;
}

json to_json(Vec2 v) { return json::array({v.x, v.y}); }

json to_json(const SheetPose& pose) {
  return {{"angle_rad", pose.angle_rad}, {"mirrored", pose.mirrored}, {"shift_mm", to_json(pose.shift)}};
}

Vec2 vec2_from(const json& value) { return {value.at(0).get<double>(), value.at(1).get<double>()}; }

SheetPose pose_from(const json& value) {
  return {value.at("angle_rad").get<double>(), value.at("mirrored").get<bool>(), vec2_from(value.at("shift_mm"))};
}

SheetFace face_from(const json& value) {
  return value.get<std::string>() == "back" ? SheetFace::kBack : SheetFace::kShow;
}

}  // namespace veneer::sim
