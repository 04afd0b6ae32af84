#include "tests/support/camera_file.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace veneer::tests {
namespace {

constexpr std::size_t kRoom = 1 << 16;  // bytes of a buffer
constexpr unsigned kMostBuffers = 3;

bool complete(UMockdevIoctlClient* client, int error) {
  umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
  return true;
}

// The structure that the call points at, changed in place.
template <class T, class Use>
bool with(UMockdevIoctlClient* client, Use use) {
  UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
  UMockdevIoctlData* data = arg == nullptr ? nullptr : umockdev_ioctl_data_resolve(arg, 0, sizeof(T), nullptr);
  if (data == nullptr) return complete(client, EFAULT);
  const int error = use(*reinterpret_cast<T*>(data->data));
  g_object_unref(data);
  return complete(client, error);
}

template <std::size_t kSize>
void write_text(__u8 (&to)[kSize], const std::string& text) {
  std::memset(to, 0, kSize);
  std::memcpy(to, text.data(), std::min(text.size(), kSize - 1));
}

}  // namespace

CameraFile::CameraFile() : testbed_(umockdev_testbed_new()), handler_(umockdev_ioctl_base_new()) {
  g_signal_connect_after(handler_, "handle-ioctl",
                         G_CALLBACK(+[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) -> gboolean {
                           return static_cast<CameraFile*>(self)->answer(client) ? TRUE : FALSE;
                         }),
                         this);
  gchar* root = umockdev_testbed_get_root_dir(testbed_);
  const std::filesystem::path played = root;
  g_free(root);
  // The name that lasts is the file itself: umockdev knows an open file by the name it was opened by.
  umockdev_testbed_attach_ioctl(testbed_, kDevice, handler_, nullptr);
  const std::filesystem::path file = played.string() + kDevice;
  std::filesystem::create_directories(file.parent_path());
  file_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  static_cast<void>(::ftruncate(file_, kMostBuffers * kRoom) == 0);
}

CameraFile::~CameraFile() {
  g_object_unref(testbed_);
  g_object_unref(handler_);
  ::close(file_);
}

void CameraFile::add_control(__u32 id, __u32 type, const std::string& title, int least, int most, int usual,
                             int value) {
  change([&](Play& play) {
    Control& control = play.controls[id];
    control.about.id = id, control.about.type = type;
    control.about.minimum = least, control.about.maximum = most, control.about.step = 1;
    control.about.default_value = usual;
    write_text(control.about.name, title);
    control.value = value;
  });
}

int CameraFile::query_control(v4l2_queryctrl& query) {
  if ((query.id & V4L2_CTRL_FLAG_NEXT_CTRL) == 0) return EINVAL;
  const auto next = play_.controls.upper_bound(query.id & ~V4L2_CTRL_FLAG_NEXT_CTRL);
  if (next == play_.controls.end()) return EINVAL;
  query = next->second.about;
  return 0;
}

int CameraFile::share(v4l2_requestbuffers& wanted) {
  buffers_ = wanted.count = std::min(wanted.count, kMostBuffers);
  queue_.clear();
  return 0;
}

int CameraFile::place_of(v4l2_buffer& buffer) const {
  if (buffer.index >= buffers_) return EINVAL;
  buffer.m.offset = static_cast<__u32>(buffer.index * kRoom);
  buffer.length = kRoom;
  return 0;
}

int CameraFile::give(v4l2_buffer& buffer) {
  if (!streams_) return EINVAL;
  if (queue_.empty() || !play_.frame) return EAGAIN;
  const FramePlan plan = play_.frame(given_++);
  buffer.index = queue_.front();
  queue_.pop_front();
  static_cast<void>(place_of(buffer));
  const auto size = static_cast<ssize_t>(plan.bytes.size());
  const bool written = ::pwrite(file_, plan.bytes.data(), plan.bytes.size(), buffer.m.offset) == size;
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  buffer.bytesused = static_cast<__u32>(plan.bytes.size());
  buffer.flags = plan.flags;
  buffer.timestamp.tv_sec = now.tv_sec, buffer.timestamp.tv_usec = now.tv_nsec / 1000;
  return written ? 0 : EIO;
}

bool CameraFile::answer(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  const unsigned long request = umockdev_ioctl_client_get_request(client);
  if (play_.unplugged) return complete(client, ENODEV);
  if (const auto fails = play_.fails.find(request); fails != play_.fails.end()) return complete(client, fails->second);
  switch (request) {
    case VIDIOC_QUERYCAP:
      return with<v4l2_capability>(client, [&](v4l2_capability& can) {
        write_text(can.driver, play_.driver), write_text(can.card, "Played Camera"), write_text(can.bus_info, "usb-1");
        can.capabilities = play_.capabilities | V4L2_CAP_DEVICE_CAPS, can.device_caps = play_.capabilities;
        return 0;
      });
    case VIDIOC_ENUM_FMT:
      return with<v4l2_fmtdesc>(client, [&](v4l2_fmtdesc& format) {
        if (format.index > 0) return EINVAL;
        format.pixelformat = play_.code;
        return 0;
      });
    case VIDIOC_ENUM_FRAMESIZES:
      return with<v4l2_frmsizeenum>(client, [&](v4l2_frmsizeenum& size) {
        if (size.index > 0) return EINVAL;
        size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
        size.discrete = {play_.width, play_.height};
        return 0;
      });
    case VIDIOC_S_FMT:
      return with<v4l2_format>(client, [&](v4l2_format& format) {
        v4l2_pix_format& pix = format.fmt.pix;
        pix.width = play_.width, pix.height = play_.height, pix.pixelformat = play_.code;
        pix.bytesperline = play_.line.value_or(play_.code == V4L2_PIX_FMT_YUYV ? play_.width * 2 : 0);
        pix.field = V4L2_FIELD_NONE, pix.colorspace = V4L2_COLORSPACE_SRGB;
        return 0;
      });
    case VIDIOC_QUERYCTRL:
      return with<v4l2_queryctrl>(client, [&](v4l2_queryctrl& query) { return query_control(query); });
    case VIDIOC_QUERYMENU:
      return with<v4l2_querymenu>(client, [&](v4l2_querymenu& item) {
        const auto& choices = play_.controls.at(item.id).choices;
        if (item.index >= choices.size() || choices[item.index].empty()) return EINVAL;
        // Of a packed structure, to which no reference can be had.
        std::memset(item.name, 0, sizeof item.name);
        std::memcpy(item.name, choices[item.index].data(), std::min(choices[item.index].size(), sizeof item.name - 1));
        return 0;
      });
    case VIDIOC_G_CTRL:
      return with<v4l2_control>(client, [&](v4l2_control& control) {
        control.value = play_.controls.at(control.id).value;
        return 0;
      });
    case VIDIOC_S_CTRL:
      return with<v4l2_control>(client, [&](v4l2_control& control) {
        Control& of_it = play_.controls.at(control.id);
        if (control.value < of_it.about.minimum || control.value > of_it.about.maximum) return ERANGE;
        of_it.value = control.value;
        return 0;
      });
    case VIDIOC_REQBUFS:
      return with<v4l2_requestbuffers>(client, [&](v4l2_requestbuffers& wanted) { return share(wanted); });
    case VIDIOC_QUERYBUF:
      return with<v4l2_buffer>(client, [&](v4l2_buffer& buffer) { return place_of(buffer); });
    case VIDIOC_QBUF:
      return with<v4l2_buffer>(client, [&](v4l2_buffer& buffer) {
        if (buffer.index >= buffers_ || std::ranges::count(queue_, buffer.index) != 0) return EINVAL;
        queue_.push_back(buffer.index);
        return 0;
      });
    case VIDIOC_DQBUF:
      return with<v4l2_buffer>(client, [&](v4l2_buffer& buffer) { return give(buffer); });
    case VIDIOC_STREAMON:
      streams_ = true;
      return complete(client, 0);
    case VIDIOC_STREAMOFF:
      streams_ = false;
      queue_.clear();
      return complete(client, 0);
    default:
      return false;
  }
}

}  // namespace veneer::tests
