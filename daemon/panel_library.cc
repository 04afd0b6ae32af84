#include "daemon/panel_library.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>

#include "base/hash.h"
#include "planner/matching/index_cache.h"

namespace veneer::daemon {
namespace {

namespace fs = std::filesystem;

Error storage_error(const fs::path& file) {
  return {
      ErrorCode::kStorage,
      fmt::format("cannot write {}: make room on the disk or give the daemon access, then try again", file.string())};
}

// The whole file or none of it, and on the disk when this returns.
Status write_whole(const fs::path& file, std::span<const unsigned char> bytes) {
  std::error_code failed;
  fs::create_directories(file.parent_path(), failed);
  const fs::path temporary = file.string() + ".new";
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (fd < 0) return storage_error(file);
  bool good = true;
  for (std::size_t done = 0; good && done < bytes.size();) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    good = n > 0;
    done += good ? static_cast<std::size_t>(n) : 0;
  }
  good = ::fsync(fd) == 0 && good;
  good = ::close(fd) == 0 && good;
  if (good) fs::rename(temporary, file, failed);
  if (good && !failed) return Ok();
  fs::remove(temporary, failed);
  return storage_error(file);
}

std::vector<cv::Point> to_pixels(const Ring<PanelFrame>& ring, const Raster<PanelFrame>& raster, int shift) {
  std::vector<cv::Point> out;
  out.reserve(ring.size());
  for (const auto& p : ring) {
    double column = 0, row = 0;
    raster.to_pixels(p, column, row);
    // OpenCV draws with pixel centres at whole numbers.
    out.emplace_back(cvRound((column - 0.5) * (1 << shift)), cvRound((row - 0.5) * (1 << shift)));
  }
  return out;
}

std::vector<std::vector<cv::Point>> to_pixels(const Region<PanelFrame>& region, const Raster<PanelFrame>& raster,
                                              int shift) {
  std::vector<std::vector<cv::Point>> out;
  for (const auto& ring : region.rings()) out.push_back(to_pixels(ring, raster, shift));
  return out;
}

constexpr int kShift = 6;  // 1/64 pixel

}  // namespace

Result<PanelLibrary::Stored> PanelLibrary::store_picture(const cv::Mat& picture, const std::string& folder,
                                                         const std::string& prefix) const {
  std::vector<unsigned char> png;
  // Level 1: a scan's noise hardly compresses, and the operator waits.
  if (!cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    return Error{ErrorCode::kInternal, "a picture could not be encoded as PNG"};
  const std::string hash = sha256_hex(std::as_bytes(std::span(png)));
  const std::string file = fmt::format("{}/{}-{}.png", folder, prefix, hash.substr(0, 16));
  if (const Status written = write_whole(data_dir_ / file, png); !written) return written.error();
  return Stored{file, hash};
}

Result<PanelLibrary::Stored> PanelLibrary::store_bytes(const std::string& bytes, const std::string& folder,
                                                       const std::string& name) const {
  const std::span data(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  const std::string file = folder + "/" + name;
  if (const Status written = write_whole(data_dir_ / file, data); !written) return written.error();
  return Stored{file, sha256_hex(std::as_bytes(data))};
}

Result<cv::Mat> PanelLibrary::load_picture(const std::string& file) const {
  cv::Mat picture = cv::imread((data_dir_ / file).string(), cv::IMREAD_UNCHANGED);
  if (picture.empty())
    return Error{ErrorCode::kStorage, fmt::format("cannot read {}: restore it from a backup or scan the panel again",
                                                  (data_dir_ / file).string())};
  return picture;
}

Result<std::string> PanelLibrary::load_bytes(const std::string& file) const {
  std::ifstream in(data_dir_ / file, std::ios::binary);
  if (!in)
    return Error{ErrorCode::kStorage,
                 fmt::format("cannot read {}: restore it from a backup", (data_dir_ / file).string())};
  return std::string(std::istreambuf_iterator<char>(in), {});
}

void PanelLibrary::drop_index(const PanelId& panel) const {
  if (auto cache = planner::IndexCache::open(index_dir())) cache->drop(panel.value);
}

void PanelLibrary::keep_index_only(const std::vector<PanelId>& panels) const {
  std::vector<std::string> names;
  for (const PanelId& panel : panels) names.push_back(panel.value);
  if (auto cache = planner::IndexCache::open(index_dir())) cache->keep_only(names);
}

Result<Raster<PanelFrame>> PanelLibrary::load_map(const db::PanelRecord& panel) const {
  auto pixels = load_picture(panel.map_file);
  if (!pixels) return pixels.error();
  return Raster<PanelFrame>{*pixels, kMapResolution, {}};
}

Result<Raster<PanelFrame>> PanelLibrary::load_mask(const db::PanelRecord& panel) const {
  auto pixels = load_picture(panel.mask_file);
  if (!pixels) return pixels.error();
  return Raster<PanelFrame>{*pixels, kMapResolution, {}};
}

Result<SquareMillimetres> PanelLibrary::usable_area(const db::PanelRecord& panel) const {
  {
    const std::lock_guard lock(areas_mutex_);
    if (const auto known = areas_.find(panel.mask_file); known != areas_.end()) return known->second;
  }
  auto mask = load_mask(panel);
  if (!mask) return mask.error();
  const std::lock_guard lock(areas_mutex_);
  return areas_[panel.mask_file] = wood_area(*mask);
}

SquareMillimetres wood_area(const Raster<PanelFrame>& mask) {
  const double pixel = 1 / mask.resolution.px_per_mm;
  return SquareMillimetres(cv::countNonZero(mask.pixels) * pixel * pixel);
}

calib::PanelFiducials to_calib(const std::vector<db::FiducialRecord>& records) {
  calib::PanelFiducials out;
  for (const auto& record : records) {
    if (record.kind == db::FiducialKind::kHole && !record.corners.empty()) {
      out.holes.push_back({record.corners.front()});
    } else if (record.corners.size() == 4) {
      calib::PanelTag& tag = out.tags.emplace_back();
      tag.id = record.tag_id;
      tag.face = record.face == db::PanelFace::kShow ? calib::Face::kShow : calib::Face::kBack;
      std::copy(record.corners.begin(), record.corners.end(), tag.corners.begin());
    }
  }
  std::sort(out.tags.begin(), out.tags.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return out;
}

std::vector<db::FiducialRecord> to_records(const calib::PanelFiducials& fiducials, calib::Face face) {
  std::vector<db::FiducialRecord> out;
  const auto db_face = face == calib::Face::kShow ? db::PanelFace::kShow : db::PanelFace::kBack;
  for (const auto& tag : fiducials.tags)
    if (tag.face == face)
      out.push_back({db::FiducialKind::kTag, tag.id, db_face, {tag.corners.begin(), tag.corners.end()}});
  if (face == calib::Face::kShow)
    for (std::size_t i = 0; i < fiducials.holes.size(); ++i)
      out.push_back({db::FiducialKind::kHole, static_cast<int>(i), db_face, {fiducials.holes[i].centre}});
  return out;
}

Raster<PanelFrame> free_wood(const Raster<PanelFrame>& mask, const std::vector<db::AllocationRecord>& live,
                             Millimetres margin) {
  Raster<PanelFrame> out{mask.pixels.clone(), mask.resolution, mask.origin};
  for (const auto& allocation : live) {
    const auto rings = to_pixels(offset(allocation.area, margin), out, kShift);
    if (rings.empty()) continue;
    cv::fillPoly(out.pixels, rings, cv::Scalar(0), cv::LINE_8, kShift);
    // The border pixels too: fillPoly goes by pixel centres.
    cv::polylines(out.pixels, rings, true, cv::Scalar(0), 2, cv::LINE_8, kShift);
  }
  return out;
}

cv::Mat draw_stock(const Raster<PanelFrame>& map, const Raster<PanelFrame>& mask,
                   const std::vector<db::AllocationRecord>& live, int width_px) {
  const double scale = std::min(1.0, static_cast<double>(width_px) / map.pixels.cols);
  Raster<PanelFrame> small{{}, {map.resolution.px_per_mm * scale}, map.origin};
  cv::Mat usable;
  cv::resize(map.pixels, small.pixels, {}, scale, scale, cv::INTER_AREA);
  cv::resize(mask.pixels, usable, small.pixels.size(), 0, 0, cv::INTER_NEAREST);
  // What cannot be used steps back: half grey, lighter.
  cv::Mat pale;
  cv::addWeighted(small.pixels, 0.35, cv::Mat(small.pixels.size(), CV_8UC3, cv::Scalar(235, 235, 235)), 0.65, 0, pale);
  pale.copyTo(small.pixels, usable == 0);

  // Okabe-Ito: blue for reserved, orange for being cut or suspect; what is cut is gone and shows as white.
  const cv::Scalar blue(178, 114, 0), orange(0, 159, 230), white(255, 255, 255), grey(120, 120, 120);
  cv::Mat tint = small.pixels.clone();
  for (const auto& allocation : live) {
    const auto rings = to_pixels(allocation.area, small, kShift);
    if (rings.empty()) continue;
    const bool gone = allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
    const bool reserved = allocation.state == db::AllocationState::kReserved;
    cv::fillPoly(tint, rings, gone ? white : reserved ? blue : orange, cv::LINE_AA, kShift);
  }
  cv::addWeighted(tint, 0.62, small.pixels, 0.38, 0, small.pixels);
  for (const auto& allocation : live) {
    const bool gone = allocation.state == db::AllocationState::kCut || allocation.state == db::AllocationState::kScrap;
    const bool reserved = allocation.state == db::AllocationState::kReserved;
    cv::polylines(small.pixels, to_pixels(allocation.area, small, kShift), true,
                  gone       ? grey
                  : reserved ? blue
                             : orange,
                  1, cv::LINE_AA, kShift);
  }

  constexpr int kLegend = 34;
  cv::Mat out(small.pixels.rows + kLegend, small.pixels.cols, CV_8UC3, cv::Scalar(245, 245, 245));
  small.pixels.copyTo(out(cv::Rect(0, 0, small.pixels.cols, small.pixels.rows)));
  int x = 12;
  const auto entry = [&](const cv::Scalar& colour, const char* word) {
    const cv::Rect box(x, small.pixels.rows + 9, 16, 16);
    cv::rectangle(out, box, colour, cv::FILLED);
    cv::rectangle(out, box, grey, 1);
    cv::putText(out, word, {x + 24, small.pixels.rows + 23}, cv::FONT_HERSHEY_SIMPLEX, 0.5, {40, 40, 40}, 1,
                cv::LINE_AA);
    x += 44 + static_cast<int>(cv::getTextSize(word, cv::FONT_HERSHEY_SIMPLEX, 0.5, 1, nullptr).width);
  };
  entry({120, 170, 205}, "free");
  entry(blue, "reserved");
  entry(orange, "being cut / suspect");
  entry(white, "cut");
  entry({225, 228, 230}, "not usable");
  return out;
}

}  // namespace veneer::daemon
