// How the twin's truth lies on disk: small JSON files and rasters, each written whole beside its place and renamed.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"
#include "drivers/sim/plane.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

Status write_whole(const std::filesystem::path& file, const std::string& bytes);
Status write_json(const std::filesystem::path& file, const nlohmann::json& json);
Result<nlohmann::json> read_json(const std::filesystem::path& file);
// The extension tells the format (.ppm, .png); the bytes appear at once or not at all.
Status write_picture(const std::filesystem::path& file, const cv::Mat& picture);
Result<cv::Mat> read_picture(const std::filesystem::path& file, int flags);

nlohmann::json to_json(Vec2 v);
nlohmann::json to_json(const SheetPose& pose);
// These throw nlohmann's exceptions on a broken file; callers catch at their door.
Vec2 vec2_from(const nlohmann::json& json);
SheetPose pose_from(const nlohmann::json& json);
SheetFace face_from(const nlohmann::json& json);

}  // namespace veneer::sim
