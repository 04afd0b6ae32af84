#include "drivers/v4l2/video_device.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

namespace veneer::v4l2 {
namespace {

constexpr unsigned kBuffers = 4;
constexpr auto kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr __u32 kBigEndian = 1U << 31;  // of a format, as v4l2_fourcc_be() has it

// Drivers whose pictures a program makes. They show no bed.
constexpr std::array<std::string_view, 3> kMadeUp = {"vivid", "vimc", "v4l2 loopback"};

// A driver may be told to stop in the midst of a call.
int call(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

template <std::size_t kSize>
std::string text_of(const __u8 (&text)[kSize]) {
  const char* begin = reinterpret_cast<const char*>(text);
  std::string out(begin, ::strnlen(begin, kSize));
  std::erase_if(out, [](char c) { return static_cast<unsigned char>(c) < ' ' || static_cast<unsigned char>(c) > '~'; });
  return out;
}

std::string code_of(__u32 format) {
  std::string out;
  for (int shift = 0; shift < 32; shift += 8) {
    const char c = static_cast<char>(format >> shift & 0x7f);
    out += c >= ' ' && c <= '~' ? c : '?';  // it goes into sentences and to terminals
  }
  while (!out.empty() && out.back() == ' ') out.pop_back();
  if ((format & kBigEndian) != 0) out += "-BE";
  return out;
}

__u32 format_of(std::string_view code) {
  __u32 out = 0;
  for (int i = 0; i < 4; ++i)
    out |= static_cast<__u32>(static_cast<unsigned char>(static_cast<std::size_t>(i) < code.size() ? code[i] : ' '))
           << (8 * i);
  return out;
}

CameraControl::Kind kind_of(__u32 type) {
  switch (type) {
    case V4L2_CTRL_TYPE_BOOLEAN:
      return CameraControl::Kind::kYesNo;
    case V4L2_CTRL_TYPE_INTEGER:
      return CameraControl::Kind::kWhole;
    case V4L2_CTRL_TYPE_MENU:
      return CameraControl::Kind::kChoice;
    default:
      return CameraControl::Kind::kOther;
  }
}

// Frames lie in memory that the driver writes into; each is copied before its buffer is handed back.
class Mapping {
 public:
  Mapping(void* at, std::size_t size) : at_(at), size_(size) {}
  ~Mapping() {
    if (at_ != nullptr) ::munmap(at_, size_);
  }
  Mapping(Mapping&& other) noexcept : at_(std::exchange(other.at_, nullptr)), size_(other.size_) {}
  Mapping& operator=(Mapping&&) = delete;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  const std::uint8_t* begin() const { return static_cast<const std::uint8_t*>(at_); }
  std::size_t size() const { return size_; }

 private:
  void* at_;
  std::size_t size_;
};

class VideoDevice final : public OpenCamera {
 public:
  VideoDevice(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  ~VideoDevice() override {
    end();
    ::close(fd_);
  }
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;

  Status introduce() {
    v4l2_capability can{};
    if (call(fd_, VIDIOC_QUERYCAP, &can) != 0) return no_camera();
    const __u32 caps = (can.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? can.device_caps : can.capabilities;
    if ((caps & V4L2_CAP_VIDEO_CAPTURE) == 0 || (caps & V4L2_CAP_STREAMING) == 0) return no_camera();
    if (const std::string driver = text_of(can.driver); std::ranges::find(kMadeUp, driver) != kMadeUp.end())
      return Error{
          ErrorCode::kRefused,
          fmt::format("{} shows what a program makes up ({}), not the bed: use a real camera, or leave the camera "
                      "simulated",
                      name_, driver)};
    card_ = text_of(can.card), bus_ = text_of(can.bus_info);
    return Ok();
  }

  const std::string& camera() const override { return name_; }
  std::string card() const override { return card_; }
  std::string bus() const override { return bus_; }

  Result<std::vector<OfferedFormat>> formats() override {
    std::vector<OfferedFormat> out;
    v4l2_fmtdesc format{};
    format.type = kCapture;
    for (; call(fd_, VIDIOC_ENUM_FMT, &format) == 0; ++format.index)
      // What the kernel's own programs would convert is not the camera's.
      if ((format.flags & V4L2_FMT_FLAG_EMULATED) == 0) add_sizes(format.pixelformat, out);
    if (out.empty()) return failed("telling its formats");
    return out;
  }

  Result<FrameFormat> set_format(const std::string& code, int width, int height) override {
    v4l2_format format{};
    format.type = kCapture;
    format.fmt.pix.width = static_cast<__u32>(width), format.fmt.pix.height = static_cast<__u32>(height);
    format.fmt.pix.pixelformat = format_of(code);
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (call(fd_, VIDIOC_S_FMT, &format) != 0) return failed("taking its format");
    const v4l2_pix_format& pix = format.fmt.pix;
    // Two half pictures of two moments.
    if (pix.field != V4L2_FIELD_NONE && pix.field != V4L2_FIELD_ANY)
      return Error{ErrorCode::kRefused, fmt::format("the camera {} gives only every other line at a time: use another "
                                                    "camera",
                                                    name_)};
    // As they are told, and no number that only looks so.
    constexpr __u32 kMost = std::numeric_limits<int>::max();
    if (pix.width > kMost || pix.height > kMost || pix.bytesperline > kMost)
      return Error{ErrorCode::kRefused,
                   fmt::format("the driver of the camera {} tells a size of {} x {} pixels in lines "
                               "of {} bytes: update the kernel or use another camera",
                               name_, pix.width, pix.height, pix.bytesperline)};
    FrameFormat out{code_of(pix.pixelformat),
                    static_cast<int>(pix.width),
                    static_cast<int>(pix.height),
                    static_cast<int>(pix.bytesperline),
                    false,
                    false};
    const __u32 usual_encoding = V4L2_MAP_YCBCR_ENC_DEFAULT(pix.colorspace);
    const __u32 encoding = pix.ycbcr_enc != V4L2_YCBCR_ENC_DEFAULT ? pix.ycbcr_enc : usual_encoding;
    const __u32 usual_range = V4L2_MAP_QUANTIZATION_DEFAULT(false, pix.colorspace, encoding);
    const __u32 range = pix.quantization != V4L2_QUANTIZATION_DEFAULT ? pix.quantization : usual_range;
    out.high_definition = encoding == V4L2_YCBCR_ENC_709 || encoding == V4L2_YCBCR_ENC_XV709;
    out.full_range = range == V4L2_QUANTIZATION_FULL_RANGE;
    return out;
  }

  Result<std::vector<CameraControl>> controls() override {
    std::vector<CameraControl> out;
    v4l2_queryctrl query{};
    query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    for (; call(fd_, VIDIOC_QUERYCTRL, &query) == 0; query.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
      const CameraControl::Kind kind = kind_of(query.type);
      if (kind == CameraControl::Kind::kOther || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) continue;
      v4l2_control now{};
      now.id = query.id;
      const bool readable = (query.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0 && call(fd_, VIDIOC_G_CTRL, &now) == 0;
      if (!readable) {
        if (errno == ENODEV) return gone();
        continue;  // what cannot be read back cannot be relied on
      }
      CameraControl& control = out.emplace_back();
      control.id = query.id, control.name = control_name(text_of(query.name)), control.kind = kind;
      control.least = query.minimum, control.most = query.maximum, control.step = query.step;
      control.usual = query.default_value, control.value = now.value;
      control.active = (query.flags & V4L2_CTRL_FLAG_INACTIVE) == 0;
      control.settable = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
      if (kind == CameraControl::Kind::kChoice) add_choices(query, control);
    }
    if (errno == ENODEV) return gone();
    return out;
  }

  Status set(const CameraControl& control, std::int64_t value) override {
    v4l2_control to{};
    to.id = control.id, to.value = static_cast<__s32>(value);
    if (call(fd_, VIDIOC_S_CTRL, &to) == 0) return Ok();
    if (errno == ENODEV) return gone();
    return Error{ErrorCode::kRefused,
                 fmt::format("the camera {} does not take {} = {} ({}): set another value (veneerctl camera "
                             "list has its range)",
                             name_, control.name, value, std::generic_category().message(errno))};
  }

  Status start() override {
    if (Status shared = share_buffers(); !shared) return shared;
    int type = kCapture;
    if (call(fd_, VIDIOC_STREAMON, &type) != 0) return failed("beginning");
    streams_ = true;
    return Ok();
  }

  Result<std::optional<Frame>> next(Duration wait) override {
    pollfd ready{fd_, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(wait).count();
    const int came = ::poll(&ready, 1, static_cast<int>(std::max<decltype(ms)>(ms, 0)));
    if (came < 0 && errno != EINTR) return failed("waiting for a picture");
    if (came <= 0) return std::optional<Frame>();
    v4l2_buffer buffer = empty_buffer();
    if (call(fd_, VIDIOC_DQBUF, &buffer) != 0) {
      if (errno != EAGAIN) return failed("giving a picture");
      // Some drivers say that there is something to be read before there is.
      const timespec moment{0, 2'000'000};
      ::nanosleep(&moment, nullptr);
      return std::optional<Frame>();
    }
    Result<Frame> frame = copy_of(buffer);
    if (call(fd_, VIDIOC_QBUF, &buffer) != 0) return failed("taking back a picture's memory");
    if (!frame) return frame.error();
    return std::optional(std::move(*frame));
  }

  void end() noexcept override {
    int type = kCapture;
    if (std::exchange(streams_, false)) call(fd_, VIDIOC_STREAMOFF, &type);
    mappings_.clear();
    v4l2_requestbuffers none{};
    none.type = kCapture, none.memory = V4L2_MEMORY_MMAP;
    if (std::exchange(shares_, false)) call(fd_, VIDIOC_REQBUFS, &none);
  }

 private:
  Error gone() const {
    return {ErrorCode::kUnavailable,
            fmt::format("the camera {} was unplugged: plug it in again and look at its cable", name_)};
  }
  Error no_camera() const {
    return {ErrorCode::kRefused,
            fmt::format("{} is no camera that gives pictures: take one that veneerctl camera list has", name_)};
  }
  Error failed(std::string_view doing) const {
    const int why = errno;
    if (why == ENODEV) return gone();
    if (why == EBUSY)
      return {ErrorCode::kUnavailable,
              fmt::format("the camera {} is used by another program: close that, then try again", name_)};
    if (why == ENOSPC)
      return {ErrorCode::kUnavailable,
              fmt::format("there is no room on the USB bus for pictures of the camera {}: plug it into another socket, "
                          "or set a smaller width and height",
                          name_)};
    return {ErrorCode::kDeviceFault, fmt::format("the camera {} failed while {} ({}): unplug it and plug it in again",
                                                 name_, doing, std::generic_category().message(why))};
  }

  void add_sizes(__u32 pixelformat, std::vector<OfferedFormat>& out) const {
    v4l2_frmsizeenum size{};
    size.pixel_format = pixelformat;
    for (; call(fd_, VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
      OfferedFormat& one = out.emplace_back();
      one.code = code_of(pixelformat);
      if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
        one.width = one.most_width = static_cast<int>(size.discrete.width);
        one.height = one.most_height = static_cast<int>(size.discrete.height);
        continue;
      }
      const v4l2_frmsize_stepwise& steps = size.stepwise;
      one.width = static_cast<int>(steps.min_width), one.height = static_cast<int>(steps.min_height);
      one.most_width = static_cast<int>(steps.max_width), one.most_height = static_cast<int>(steps.max_height);
      one.step_width = std::max(1, static_cast<int>(steps.step_width));
      one.step_height = std::max(1, static_cast<int>(steps.step_height));
      break;  // it has one only
    }
  }

  void add_choices(const v4l2_queryctrl& query, CameraControl& control) const {
    v4l2_querymenu item{};
    item.id = query.id;
    for (__s64 index = query.minimum; index <= query.maximum; ++index) {
      item.index = static_cast<__u32>(index);
      if (call(fd_, VIDIOC_QUERYMENU, &item) == 0) control.choices.emplace_back(index, text_of(item.name));
    }
  }

  static v4l2_buffer empty_buffer() {
    v4l2_buffer buffer{};
    buffer.type = kCapture, buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }

  Status share_buffers() {
    v4l2_requestbuffers room{};
    room.type = kCapture, room.memory = V4L2_MEMORY_MMAP, room.count = kBuffers;
    if (call(fd_, VIDIOC_REQBUFS, &room) != 0) return failed("making room for pictures");
    shares_ = true;
    for (__u32 i = 0; i < room.count; ++i) {
      v4l2_buffer buffer = empty_buffer();
      buffer.index = i;
      if (call(fd_, VIDIOC_QUERYBUF, &buffer) != 0) return failed("making room for pictures");
      void* at = ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, fd_, static_cast<off_t>(buffer.m.offset));
      if (at == MAP_FAILED) return failed("sharing its memory");
      mappings_.emplace_back(at, buffer.length);
      if (call(fd_, VIDIOC_QBUF, &buffer) != 0) return failed("making room for pictures");
    }
    return Ok();
  }

  Result<Frame> copy_of(const v4l2_buffer& buffer) const {
    if (buffer.index >= mappings_.size() || buffer.bytesused > mappings_[buffer.index].size())
      return Error{ErrorCode::kDeviceFault,
                   fmt::format("the driver of the camera {} says that it wrote more than there is room for: update the "
                               "kernel or use another camera",
                               name_)};
    Frame out;
    const Mapping& memory = mappings_[buffer.index];
    out.bytes.assign(memory.begin(), memory.begin() + buffer.bytesused);
    out.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
    // The clock of std::chrono::steady_clock, and so of base/clock.h.
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      out.taken = TimePoint(std::chrono::seconds(buffer.timestamp.tv_sec) +
                            std::chrono::microseconds(buffer.timestamp.tv_usec));
    return out;
  }

  const int fd_;
  const std::string name_;
  std::string card_, bus_;
  std::vector<Mapping> mappings_;
  bool shares_ = false, streams_ = false;
};

std::string group_of(gid_t id) {
  std::array<char, 4096> room{};
  group entry{};
  group* found = nullptr;
  return ::getgrgid_r(id, &entry, room.data(), room.size(), &found) == 0 && found != nullptr ? entry.gr_name : "";
}

}  // namespace

bool is_for_group(gid_t group, mode_t mode) {
  return group != 0 && (mode & (S_IRGRP | S_IWGRP)) == (S_IRGRP | S_IWGRP);
}

Error not_opened(const std::string& device, int why, const std::string& group, bool for_group) {
  if ((why == EACCES || why == EPERM) && !for_group)
    return {ErrorCode::kUnavailable, fmt::format("the camera {} may be used by root only: write "
                                                 "SUBSYSTEM==\"video4linux\", GROUP=\"video\", MODE=\"0660\" into "
                                                 "/etc/udev/rules.d/70-cameras.rules, then plug it in again, or start "
                                                 "this computer again where it is built in",
                                                 device)};
  if (why == EACCES || why == EPERM)
    return {ErrorCode::kUnavailable,
            fmt::format("the camera {} may not be used by the cell's program: put SupplementaryGroups={} into its unit "
                        "(systemctl edit veneerd), then start it again",
                        device, group.empty() ? "video" : group)};
  if (why == ENOENT || why == ENODEV || why == ENXIO)
    return {ErrorCode::kUnavailable,
            fmt::format("the camera {} is not there: plug it in, and see veneerctl camera list for its name", device)};
  if (why == EBUSY)
    return {ErrorCode::kUnavailable,
            fmt::format("the camera {} is used by another program: close that, then try again", device)};
  return {ErrorCode::kUnavailable, fmt::format("the camera {} cannot be opened ({}): unplug it and plug it in again",
                                               device, std::generic_category().message(why))};
}

Result<std::unique_ptr<OpenCamera>> open_camera(const std::filesystem::path& device) {
  const int fd = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    const int why = errno;
    struct stat about {};
    const bool told = ::stat(device.c_str(), &about) == 0;
    return not_opened(device.string(), why, told ? group_of(about.st_gid) : "",
                      !told || is_for_group(about.st_gid, about.st_mode));
  }
  auto camera = std::make_unique<VideoDevice>(fd, device.string());
  if (Status is_one = camera->introduce(); !is_one) return is_one.error();
  return std::unique_ptr<OpenCamera>(std::move(camera));
}

}  // namespace veneer::v4l2
