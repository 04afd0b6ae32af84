#include "drivers/transport/usb_port.h"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/post.hpp>
#include <functional>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

namespace veneer {
namespace {

constexpr int kInterface = 0;
constexpr Duration kUrgentTimeout = std::chrono::seconds(2);
// How long a closed port waits for its last transfers, the urgent one above all.
constexpr std::chrono::milliseconds kLastTransfers{200};

// Where a device is plugged in, as the kernel names it: "1-2.4".
std::string place_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string place = std::to_string(libusb_get_bus_number(device)) + "-";
  for (int i = 0; i < count; ++i) place += (i > 0 ? "." : "") + std::to_string(ports[static_cast<std::size_t>(i)]);
  return place;
}

}  // namespace

// One opened device and the thread that reaps its transfers.
class UsbPort::Session {
 public:
  enum class End { kDone, kTimedOut, kFailed };
  // Called on the session's thread.
  using OnEnd = std::function<void(End, std::string bytes, const char* why)>;

  Session() = default;
  ~Session() {
    close();
    if (thread_.joinable()) thread_.join();
    if (handle_ != nullptr) {
      libusb_release_interface(handle_, kInterface);
      libusb_close(handle_);
    }
    if (context_ != nullptr) libusb_exit(context_);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  Status open(const UsbAddress& address) {
    if (const int error = libusb_init(&context_); error != 0) {
      context_ = nullptr;
      return Error{
          ErrorCode::kUnavailable,
          fmt::format("USB cannot be used here ({}): give the daemon access to USB devices", libusb_strerror(error))};
    }
    libusb_device** devices = nullptr;
    const ssize_t count = libusb_get_device_list(context_, &devices);
    std::vector<libusb_device*> found;
    std::string places;
    for (ssize_t i = 0; i < count; ++i) {
      libusb_device_descriptor descriptor{};
      if (libusb_get_device_descriptor(devices[i], &descriptor) != 0) continue;
      if (descriptor.idVendor != address.vendor || descriptor.idProduct != address.product) continue;
      const std::string place = place_of(devices[i]);
      if (!address.place.empty() && place != address.place) continue;
      found.push_back(devices[i]);
      places += (places.empty() ? "@" : ", @") + place;
    }
    Status opened = claim(address, found, places);
    if (devices != nullptr) libusb_free_device_list(devices, 1);
    if (opened.ok()) thread_ = std::thread([this] { reap(); });
    return opened;
  }

  // False when the transfer could not even be submitted.
  bool submit(const UsbRequest& request, OnEnd on_end) {
    auto flight = std::make_unique<Flight>();
    flight->session = this;
    flight->on_end = std::move(on_end);
    libusb_transfer* transfer = libusb_alloc_transfer(0);
    if (transfer == nullptr) return false;
    const auto timeout = static_cast<unsigned>(
        std::max<std::int64_t>(1, std::chrono::duration_cast<std::chrono::milliseconds>(request.timeout).count()));
    if (const auto* setup = std::get_if<UsbSetup>(&request.what)) {
      flight->bytes.resize(LIBUSB_CONTROL_SETUP_SIZE);
      libusb_fill_control_setup(flight->bytes.data(), setup->request_type, setup->request, setup->value, setup->index,
                                0);
      libusb_fill_control_transfer(transfer, handle_, flight->bytes.data(), &Session::ended, flight.get(), timeout);
    } else if (const auto* write = std::get_if<UsbWrite>(&request.what)) {
      flight->bytes.assign(write->bytes.begin(), write->bytes.end());
      libusb_fill_bulk_transfer(transfer, handle_, write->endpoint, flight->bytes.data(),
                                static_cast<int>(flight->bytes.size()), &Session::ended, flight.get(), timeout);
    } else if (const auto* read = std::get_if<UsbRead>(&request.what)) {
      flight->bytes.resize(read->most_bytes);
      flight->reads = true;
      libusb_fill_bulk_transfer(transfer, handle_, read->endpoint, flight->bytes.data(),
                                static_cast<int>(flight->bytes.size()), &Session::ended, flight.get(), timeout);
    }
    transfer->flags = LIBUSB_TRANSFER_FREE_TRANSFER;
    const std::lock_guard lock(mutex_);
    if (libusb_submit_transfer(transfer) != 0) {
      transfer->flags = 0;
      libusb_free_transfer(transfer);
      return false;
    }
    in_flight_.insert(transfer);
    static_cast<void>(flight.release());  // its end takes it back
    return true;
  }

  void cancel_all() noexcept {
    const std::lock_guard lock(mutex_);
    for (libusb_transfer* transfer : in_flight_) libusb_cancel_transfer(transfer);
  }

  void close() noexcept {
    if (closing_.exchange(true)) return;
    if (context_ != nullptr) libusb_interrupt_event_handler(context_);
  }

 private:
  struct Flight {
    Session* session = nullptr;
    std::vector<unsigned char> bytes;
    bool reads = false;
    OnEnd on_end;
  };

  Status claim(const UsbAddress& address, const std::vector<libusb_device*>& found, const std::string& places) {
    const std::string name = fmt::format("usb:{:04x}:{:04x}", address.vendor, address.product);
    if (found.empty())
      return Error{ErrorCode::kUnavailable,
                   fmt::format("no device {}{}{} is plugged in: check the cable and the laser's supply", name,
                               address.place.empty() ? "" : "@", address.place)};
    if (found.size() > 1)
      return Error{ErrorCode::kUnavailable,
                   fmt::format("there are {} devices {}: add the place of the right one, one of {}", found.size(), name,
                               places)};
    int error = libusb_open(found.front(), &handle_);
    if (error == 0) {
      libusb_set_auto_detach_kernel_driver(handle_, 1);
      int configuration = 0;
      if (libusb_get_configuration(handle_, &configuration) == 0 && configuration != 1)
        error = libusb_set_configuration(handle_, 1);
      if (error == 0) error = libusb_claim_interface(handle_, kInterface);
      if (error != 0) {
        libusb_close(handle_);
        handle_ = nullptr;
      }
    }
    if (error == 0) return Ok();
    handle_ = nullptr;
    const char* remedy = error == LIBUSB_ERROR_ACCESS ? "install the udev rule of systemd/70-veneerd.rules"
                         : error == LIBUSB_ERROR_BUSY ? "another program has it open; close it"
                                                      : "unplug it and plug it in again";
    return Error{ErrorCode::kUnavailable,
                 fmt::format("the device {} cannot be opened ({}): {}", name, libusb_strerror(error), remedy)};
  }

  static void LIBUSB_CALL ended(libusb_transfer* transfer) {
    const std::unique_ptr<Flight> flight(static_cast<Flight*>(transfer->user_data));
    const auto length = static_cast<std::size_t>(transfer->actual_length);
    End end = End::kFailed;
    const char* why = "transfer error";
    switch (transfer->status) {
      case LIBUSB_TRANSFER_COMPLETED: {
        const bool whole =
            flight->reads || transfer->type == LIBUSB_TRANSFER_TYPE_CONTROL || length == flight->bytes.size();
        end = whole ? End::kDone : End::kTimedOut;
        break;
      }
      case LIBUSB_TRANSFER_TIMED_OUT:
      case LIBUSB_TRANSFER_CANCELLED:
        end = End::kTimedOut;
        break;
      case LIBUSB_TRANSFER_NO_DEVICE:
        why = "it was unplugged";
        break;
      case LIBUSB_TRANSFER_STALL:
        why = "the device refused a transfer";
        break;
      case LIBUSB_TRANSFER_OVERFLOW:
      case LIBUSB_TRANSFER_ERROR:
        break;
    }
    std::string bytes;
    if (flight->reads) bytes.assign(flight->bytes.begin(), flight->bytes.begin() + transfer->actual_length);
    Session* session = flight->session;
    {
      const std::lock_guard lock(session->mutex_);
      session->in_flight_.erase(transfer);
    }
    flight->on_end(end, std::move(bytes), why);
  }

  void reap() {
    const auto never = std::chrono::steady_clock::time_point::max();
    auto give_up = never;
    while (!closing_ || !idle()) {
      const auto now = std::chrono::steady_clock::now();
      if (closing_ && give_up == never) give_up = now + kLastTransfers;
      if (now >= give_up) cancel_all();
      timeval wait{0, 50'000};
      if (libusb_handle_events_timeout_completed(context_, &wait, nullptr) != 0) break;
    }
  }

  bool idle() {
    const std::lock_guard lock(mutex_);
    return in_flight_.empty();
  }

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::thread thread_;
  std::atomic<bool> closing_ = false;
  std::mutex mutex_;
  std::set<libusb_transfer*> in_flight_;  // guarded by mutex_
};

UsbPort::UsbPort(boost::asio::io_context& io, UsbAddress address)
    : io_(io), address_(std::move(address)), generation_(std::make_shared<int>(0)) {}

UsbPort::~UsbPort() { UsbPort::close(); }

Status UsbPort::open(OnReply on_reply, OnClosed on_closed) {
  close();
  closing_.reset();
  auto session = std::make_unique<Session>();
  if (Status opened = session->open(address_); !opened.ok()) return opened;
  session_ = std::move(session);
  on_reply_ = std::move(on_reply);
  on_closed_ = std::move(on_closed);
  return Ok();
}

void UsbPort::submit(UsbRequest request) {
  if (!session_) return;
  waiting_.push_back(std::move(request));
  next();
}

void UsbPort::next() {
  if (under_way_ || waiting_.empty() || !session_) return;
  under_way_ = true;
  const UsbRequest request = std::move(waiting_.front());
  waiting_.pop_front();
  const auto on_end = [this, alive = std::weak_ptr<int>(generation_)](Session::End end, const std::string& bytes,
                                                                      const char* why) {
    boost::asio::post(io_, [this, alive, end, bytes, why] {
      if (alive.expired()) return;
      under_way_ = false;
      if (end == Session::End::kFailed) return fail(gone(why));
      // A copy: the handler may close this port.
      const OnReply on_reply = on_reply_;
      on_reply({end == Session::End::kDone, bytes});
      if (!alive.expired()) next();
    });
  };
  if (!session_->submit(request, on_end)) fail(gone("it takes no transfers"));
}

void UsbPort::submit_urgent(UsbWrite write) noexcept {
  if (!session_) return;
  generation_ = std::make_shared<int>(0);
  waiting_.clear();
  under_way_ = false;
  session_->cancel_all();
  // Should it fail, so does the next transfer, and that is told.
  session_->submit({std::move(write), kUrgentTimeout}, [](Session::End, const std::string&, const char*) {});
}

void UsbPort::close() noexcept {
  generation_ = std::make_shared<int>(0);
  waiting_.clear();
  under_way_ = false;
  on_reply_ = nullptr;
  on_closed_ = nullptr;
  if (!session_) return;
  session_->close();
  closing_ = std::move(session_);
}

void UsbPort::fail(Error error) {
  const OnClosed on_closed = std::move(on_closed_);
  close();
  if (on_closed) boost::asio::post(io_, [on_closed, told = std::move(error)] { on_closed(told); });
}

Error UsbPort::gone(const std::string& why) const {
  return {ErrorCode::kDisconnected,
          fmt::format("the USB device {:04x}:{:04x} is gone ({}): check the cable and the laser's supply",
                      address_.vendor, address_.product, why)};
}

}  // namespace veneer
