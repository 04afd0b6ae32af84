#include "tests/support/board_file.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <utility>

namespace veneer::tests {
namespace {

bool complete(UMockdevIoctlClient* client, int error) {
  umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
  return true;
}
// A part of what the ioctl points at. None when the caller was killed meanwhile: nobody is left to ask for it.
UMockdevIoctlData* part_of(UMockdevIoctlData* whole, gsize offset, gsize size) {
  return whole == nullptr ? nullptr : umockdev_ioctl_data_resolve(whole, offset, size, nullptr);
}
usbdevfs_urb& urb_of(UMockdevIoctlData* data) { return *reinterpret_cast<usbdevfs_urb*>(data->data); }

}  // namespace

BoardFile::BoardFile(const sim::BoardOptions& options) : board_(options, 5, this), host_(board_) {
  board_.put_head({-250, -30});
  board_.power_on(now());
  testbed_ = umockdev_testbed_new();
  handler_ = umockdev_ioctl_base_new();
  g_signal_connect_after(handler_, "handle-ioctl",
                         G_CALLBACK(+[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) -> gboolean {
                           return static_cast<BoardFile*>(self)->answer(client) ? TRUE : FALSE;
                         }),
                         this);
  umockdev_testbed_attach_ioctl(testbed_, "/dev/bus/usb/001/002", handler_, nullptr);
  // 1a86:5512, USB 1.10, one vendor-specific interface: bulk IN 0x82, bulk OUT 0x02, interrupt IN 0x81.
  umockdev_testbed_add_from_string(testbed_,
                                   "P: /devices/usb1/1-1\n"
                                   "N: bus/usb/001/002\n"
                                   "E: SUBSYSTEM=usb\n"
                                   "E: DRIVER=usb\n"
                                   "E: BUSNUM=001\n"
                                   "E: DEVNUM=002\n"
                                   "E: DEVNAME=/dev/bus/usb/001/002\n"
                                   "E: DEVTYPE=usb_device\n"
                                   "A: bConfigurationValue=1\\n\n"
                                   "A: busnum=1\\n\n"
                                   "A: devnum=2\\n\n"
                                   "A: speed=12\\n\n"
                                   "H: descriptors="
                                   "12011001FF000208861A12550403000200010902270001010080300904000003FF0102000705820220"
                                   "00000705020220000007058103080001\n",
                                   nullptr);
}

BoardFile::~BoardFile() {
  g_object_unref(testbed_);
  g_object_unref(handler_);
}

// Where a place is looked for, in small steps, and so few at once that the board's time waits for a busy machine: else
// there would be ever more of them.
void BoardFile::advance() {
  constexpr Duration kStep = std::chrono::microseconds(100), kAtOnce = std::chrono::milliseconds(2);
  if (place_) {
    const TimePoint until = std::min(now(), looked_at_ + kAtOnce);
    while (!stood_ && looked_at_ < until) {
      looked_at_ = std::min(looked_at_ + kStep, until);
      host_.advance_to(looked_at_);
      if (place_(board_)) stood_ = looked_at_;
    }
    ahead_ = looked_at_ - SteadyClock().now();
    if (stood_) place_ = nullptr;
  }
  host_.advance_to(now());
}

std::vector<sim::BurnSegment> BoardFile::burns() {
  const std::lock_guard lock(mutex_);
  advance();
  return burns_;
}

// What a former process left under way is of no use to the next.
void BoardFile::opened_anew() {
  host_.reopen();
  asked_.clear();
  for (const auto& [id, flying] : flying_) done_.push_back(flying);
  flying_.clear();
  for (const Flying& flying : std::exchange(done_, {})) {
    g_object_unref(flying.buffer);
    g_object_unref(flying.urb);
  }
}

bool BoardFile::answer(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
  switch (umockdev_ioctl_client_get_request(client)) {
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* data = part_of(arg, 0, sizeof(guint32));
      if (data == nullptr) return complete(client, EFAULT);
      const guint32 capabilities = USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM;
      std::memcpy(data->data, &capabilities, sizeof(capabilities));
      g_object_unref(data);
      return complete(client, 0);
    }
    case USBDEVFS_GETDRIVER:
      return complete(client, ENODATA);
    case USBDEVFS_IOCTL:
      // A kernel driver is detached, and attached again in the end.
      detached_ = true;
      return complete(client, 0);
    case USBDEVFS_CLAIMINTERFACE:
      opened_anew();
      if (!board_.plugged()) return complete(client, ENODEV);
      claimed_detached_ = detached_;
      return complete(client, 0);
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
      return complete(client, 0);
    case USBDEVFS_SUBMITURB:
      return submit(client, arg);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(client, arg);
    case USBDEVFS_DISCARDURB:
      return discard(client, arg);
    default:
      return false;
  }
}

bool BoardFile::submit(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
  advance();
  if (host_.gone()) return complete(client, ENODEV);
  UMockdevIoctlData* data = part_of(arg, 0, sizeof(usbdevfs_urb));
  if (data == nullptr) return complete(client, EFAULT);
  usbdevfs_urb& urb = urb_of(data);
  UMockdevIoctlData* buffer = part_of(data, offsetof(usbdevfs_urb, buffer), static_cast<gsize>(urb.buffer_length));
  if (buffer == nullptr) {
    g_object_unref(data);
    return complete(client, EFAULT);
  }
  // The kernel knows no timeouts; libusb discards what takes too long.
  sim::HostTransfer transfer{{}, std::chrono::hours(1), next_id_++};
  const std::string bytes(reinterpret_cast<const char*>(buffer->data), static_cast<std::size_t>(urb.buffer_length));
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[i]); };
    transfer.what = sim::HostSetup{at(0), at(1), static_cast<std::uint16_t>(at(2) | at(3) << 8),
                                   static_cast<std::uint16_t>(at(4) | at(5) << 8)};
    configured_first_ = transfer.id == 1;
  } else if ((urb.endpoint & 0x80) != 0) {
    transfer.what = sim::HostRead{urb.endpoint, bytes.size()};
  } else {
    // "I" and nothing else: a program begins with it too, but goes on.
    if (bytes.size() > 3 && bytes.compare(2, 2, "IF") == 0 && bytes.find_first_not_of('F', 3) >= bytes.size() - 2)
      resets_.push_back(std::chrono::steady_clock::now());
    transfer.what = sim::HostWrite{urb.endpoint, bytes};
  }
  asked_ += urb.type == USBDEVFS_URB_TYPE_CONTROL ? 'c' : (urb.endpoint & 0x80) != 0 ? 'r' : 'w';
  flying_[transfer.id] = {data, buffer};
  host_.submit(std::move(transfer), now());
  return complete(client, 0);
}

bool BoardFile::reap(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
  advance();
  for (const sim::HostReply& reply : host_.take_replies()) {
    const auto found = flying_.find(reply.id);
    if (found == flying_.end()) continue;
    usbdevfs_urb& urb = urb_of(found->second.urb);
    const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
    urb.status = reply.end == sim::HostReply::End::kError ? -EPROTO : 0;
    urb.actual_length = control ? 0 : urb.buffer_length;
    if (!control && (urb.endpoint & 0x80) != 0) {
      urb.actual_length = static_cast<int>(reply.bytes.size());
      std::memcpy(found->second.buffer->data, reply.bytes.data(), reply.bytes.size());
    }
    done_.push_back(found->second);
    flying_.erase(found);
  }
  if (done_.empty()) {
    // The emulated file always looks ready to libusb.
    std::this_thread::sleep_for(std::chrono::microseconds(100));
    return complete(client, EAGAIN);
  }
  UMockdevIoctlData* pointer = part_of(arg, 0, sizeof(gpointer));
  if (pointer == nullptr) return complete(client, EFAULT);
  const Flying ended = done_.front();
  done_.erase(done_.begin());
  umockdev_ioctl_data_set_ptr(pointer, 0, ended.urb);
  complete(client, 0);
  g_object_unref(pointer);
  g_object_unref(ended.buffer);
  g_object_unref(ended.urb);
  return true;
}

bool BoardFile::discard(UMockdevIoctlClient* client, UMockdevIoctlData* arg) {
  if (arg == nullptr) return complete(client, EFAULT);
  asked_ += 'd';
  gulong address = 0;
  std::memcpy(&address, arg->data, sizeof(address));
  for (auto flying = flying_.begin(); flying != flying_.end(); ++flying) {
    if (flying->second.urb->client_addr != address) continue;
    host_.cancel(flying->first);
    usbdevfs_urb& urb = urb_of(flying->second.urb);
    urb.status = -ENOENT;
    urb.actual_length = 0;
    done_.push_back(flying->second);
    flying_.erase(flying);
    return complete(client, 0);
  }
  return complete(client, EINVAL);
}

}  // namespace veneer::tests
