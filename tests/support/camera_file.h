// A camera as a device file: umockdev answers the kernel's calls of Video4Linux for this process, without any kernel
// module, and its frames lie in the file, which is shared as a driver's memory is.
//
// Threading: calls come on umockdev's thread, all else from the test's; both take the lock. One at a time in a process.
#pragma once

#include <linux/videodev2.h>
#include <umockdev.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/under_umockdev.h"

namespace veneer::tests {

class CameraFile {
 public:
  static constexpr const char* kDevice = "/dev/v4l/by-id/usb-Played_Camera_4711-video-index0";

  struct Control {
    v4l2_queryctrl about{};
    int value = 0;
    std::vector<std::string> choices;
  };
  // What a frame is to be, before its buffer is handed out.
  struct FramePlan {
    std::vector<std::uint8_t> bytes;
    __u32 flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  };
  // What it is, for a test to change.
  struct Play {
    __u32 capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    std::string driver = "played";
    __u32 code = V4L2_PIX_FMT_YUYV;
    std::optional<__u32> line;  // bytes, where they are not those of YUYV
    __u32 width = 64, height = 32;
    std::map<__u32, Control> controls;
    std::function<FramePlan(int number)> frame;  // none: no frame comes
    std::map<unsigned long, int> fails;          // calls and their errors
    bool unplugged = false;
  };

  CameraFile();
  ~CameraFile();
  CameraFile(const CameraFile&) = delete;
  CameraFile& operator=(const CameraFile&) = delete;

  void change(const std::function<void(Play&)>& how) {
    const std::lock_guard lock(mutex_);
    how(play_);
  }
  // A control with its value; `id` also as V4L2 names it.
  void add_control(__u32 id, __u32 type, const std::string& title, int least, int most, int usual, int value);
  int value_of(__u32 id) {
    const std::lock_guard lock(mutex_);
    return play_.controls.at(id).value;
  }
  int frames_given() {
    const std::lock_guard lock(mutex_);
    return given_;
  }
  bool streams() {
    const std::lock_guard lock(mutex_);
    return streams_;
  }

 private:
  bool answer(UMockdevIoctlClient* client);
  int query_control(v4l2_queryctrl& query);
  int share(v4l2_requestbuffers& wanted);
  int place_of(v4l2_buffer& buffer) const;
  int give(v4l2_buffer& buffer);

  std::mutex mutex_;  // guards all below
  Play play_;
  UMockdevTestbed* testbed_;
  UMockdevIoctlBase* handler_;
  // Behind the device. Open all the time: umockdev's list of open files has no lock against two threads.
  int file_ = -1;
  std::deque<__u32> queue_;
  unsigned buffers_ = 0;
  int given_ = 0;
  bool streams_ = false;
};

}  // namespace veneer::tests
