#include "drivers/transport/usb_port.h"

#include <fmt/format.h>
#include <libusb.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/post.hpp>
#include <functional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

namespace veneer {
namespace {

constexpr int kInterface = 0;
constexpr unsigned kUrgentTimeout = 2000;  // ms
// STOP may be pressed again while the first is still on its way.
constexpr std::size_t kUrgentTransfers = 4;
constexpr std::size_t kUrgentBytes = 64;  // drivers/usb_transport.h
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
//
// Threading: all but reap(), tell() and ended() is the reactor's. A flight belongs to the reactor while it is not
// `busy`, to libusb and the session's thread while it is, and until whoever submitted it was told of its end.
class UsbPort::Session {
 public:
  enum class End { kDone, kTimedOut, kFailed };
  // Called on the session's thread.
  using OnEnd = std::function<void(End, std::string bytes, const char* why)>;

  Session() = default;
  ~Session() {
    close();
    if (thread_.joinable()) thread_.join();
    for (auto& flight : flights_) free(std::move(flight));
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
    if (opened && !make_flights()) opened = Error{ErrorCode::kUnavailable, "no memory is left for USB transfers"};
    if (devices != nullptr) libusb_free_device_list(devices, 1);
    if (opened.ok()) thread_ = std::thread([this] { reap(); });
    return opened;
  }

  // False when the transfer could not even be submitted. The one before has ended.
  bool submit(const UsbRequest& request, OnEnd on_end) {
    Flight& flight = ordinary();
    flight.on_end = std::move(on_end);
    flight.reads = false;
    const auto timeout = static_cast<unsigned>(
        std::max<std::int64_t>(1, std::chrono::duration_cast<std::chrono::milliseconds>(request.timeout).count()));
    if (const auto* setup = std::get_if<UsbSetup>(&request.what)) {
      flight.bytes.resize(LIBUSB_CONTROL_SETUP_SIZE);
      libusb_fill_control_setup(flight.bytes.data(), setup->request_type, setup->request, setup->value, setup->index,
                                0);
      libusb_fill_control_transfer(flight.transfer, handle_, flight.bytes.data(), &Session::ended, &flight, timeout);
    } else if (const auto* write = std::get_if<UsbWrite>(&request.what)) {
      flight.bytes.assign(write->bytes.begin(), write->bytes.end());
      fill_bulk(flight, write->endpoint, timeout);
    } else if (const auto* read = std::get_if<UsbRead>(&request.what)) {
      flight.bytes.resize(read->most_bytes);
      flight.reads = true;
      fill_bulk(flight, read->endpoint, timeout);
    }
    return send_off(flight);
  }

  // When none of the reserved transfers is free, as many of the same are on their way already.
  void submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept {
    for (const auto& flight : std::span(flights_).subspan(1)) {
      if (flight->busy.load(std::memory_order_acquire)) continue;
      flight->bytes.assign(bytes.begin(), bytes.end());  // within what is reserved
      fill_bulk(*flight, endpoint, kUrgentTimeout);
      static_cast<void>(send_off(*flight));  // should it fail, so does the next transfer, and that is told
      return;
    }
  }

  // Of one that has ended meanwhile libusb knows it.
  void cancel() noexcept { static_cast<void>(libusb_cancel_transfer(ordinary().transfer)); }

  void close() noexcept {
    if (closing_.exchange(true)) return;
    if (context_ != nullptr) libusb_interrupt_event_handler(context_);
  }

 private:
  struct Flight {
    libusb_transfer* transfer = nullptr;
    std::vector<unsigned char> bytes;
    bool reads = false;
    OnEnd on_end;
    std::atomic<bool> busy = false;
    bool landed = false;  // libusb has given it back, and nobody was told yet
  };

  Flight& ordinary() { return *flights_.front(); }
  bool make_flights() {
    while (flights_.size() < 1 + kUrgentTransfers) {
      auto flight = std::make_unique<Flight>();
      flight->bytes.reserve(kUrgentBytes);
      flight->transfer = libusb_alloc_transfer(0);
      if (flight->transfer == nullptr) return false;
      flights_.push_back(std::move(flight));
    }
    return true;
  }
  // One that libusb never gave back stays where it is: the kernel may still write into it.
  static void free(std::unique_ptr<Flight> flight) {
    if (flight->busy)
      static_cast<void>(flight.release());
    else
      libusb_free_transfer(flight->transfer);
  }
  void fill_bulk(Flight& flight, std::uint8_t endpoint, unsigned timeout) noexcept {
    libusb_fill_bulk_transfer(flight.transfer, handle_, endpoint, flight.bytes.data(),
                              static_cast<int>(flight.bytes.size()), &Session::ended, &flight, timeout);
  }
  static bool send_off(Flight& flight) noexcept {
    flight.busy.store(true, std::memory_order_relaxed);  // what it hands over is ordered by libusb's own locks
    if (libusb_submit_transfer(flight.transfer) == 0) return true;
    flight.busy.store(false, std::memory_order_relaxed);
    return false;
  }

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

  // Called by libusb on the session's thread. It is C, and no exception may pass through it.
  static void LIBUSB_CALL ended(libusb_transfer* transfer) noexcept {
    static_cast<Flight*>(transfer->user_data)->landed = true;
  }

  // Throws where there is no memory to tell it in: then it is still to be told.
  static void tell(Flight& flight) {
    const libusb_transfer* transfer = flight.transfer;
    const auto length = static_cast<std::size_t>(transfer->actual_length);
    End end = End::kFailed;
    const char* why = "transfer error";
    switch (transfer->status) {
      case LIBUSB_TRANSFER_COMPLETED: {
        const bool whole =
            flight.reads || transfer->type == LIBUSB_TRANSFER_TYPE_CONTROL || length == flight.bytes.size();
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
    if (flight.reads) bytes.assign(flight.bytes.begin(), flight.bytes.begin() + transfer->actual_length);
    OnEnd on_end = std::exchange(flight.on_end, nullptr);
    flight.landed = false;
    flight.busy.store(false, std::memory_order_release);  // from here on it may be another one's
    if (!on_end) return;
    try {
      on_end(end, std::move(bytes), why);
    } catch (...) {
      // Nobody has heard of it, so nobody has submitted the flight anew.
      flight.on_end = std::move(on_end);
      flight.landed = true;
      throw;
    }
  }

  // What cannot be told stays landed for the next turn. Of a port that is closed nobody wants to hear.
  void tell_landed() noexcept {
    for (const auto& flight : flights_) {
      if (!flight->landed) continue;
      try {
        if (closing_)
          flight->landed = false, flight->busy.store(false, std::memory_order_release);
        else
          tell(*flight);
      } catch (...) {
      }
    }
  }

  void reap() noexcept {
    pthread_setname_np(pthread_self(), "usb");
    const auto never = std::chrono::steady_clock::time_point::max();
    auto give_up = never;
    while (!closing_ || !idle()) {
      const auto now = std::chrono::steady_clock::now();
      if (closing_ && give_up == never) give_up = now + kLastTransfers;
      if (now >= give_up) cancel_all();
      timeval wait{0, 50'000};
      const int handled = libusb_handle_events_timeout_completed(context_, &wait, nullptr);
      tell_landed();
      if (handled != 0) break;
    }
  }

  bool idle() const {
    return std::ranges::none_of(flights_,
                                [](const auto& flight) { return flight->busy.load(std::memory_order_acquire); });
  }
  void cancel_all() noexcept {
    for (const auto& flight : flights_) static_cast<void>(libusb_cancel_transfer(flight->transfer));
  }

  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::thread thread_;
  std::atomic<bool> closing_ = false;
  // The ordinary one, then the urgent ones: as they were made, until the thread has ended.
  std::vector<std::unique_ptr<Flight>> flights_;
};

UsbPort::UsbPort(boost::asio::io_context& io, UsbAddress address)
    : io_(io), address_(std::move(address)), opened_(std::make_shared<int>(0)), generation_(std::make_shared<int>(0)) {}

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
  const auto on_end = [this, opened = std::weak_ptr<int>(opened_), wanted = std::weak_ptr<int>(generation_)](
                          Session::End end, const std::string& bytes, const char* why) {
    boost::asio::post(io_, [this, opened, wanted, end, bytes, why] {
      if (opened.expired()) return;
      under_way_ = false;
      if (!wanted.expired()) {
        if (end == Session::End::kFailed) return fail(gone(why));
        // A copy: the handler may close this port.
        const OnReply on_reply = on_reply_;
        on_reply({end == Session::End::kDone, bytes});
      }
      if (!opened.expired()) next();
    });
  };
  if (!session_->submit(request, on_end)) fail(gone("it takes no transfers"));
}

void UsbPort::submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept {
  if (!session_) return;
  session_->submit_urgent(endpoint, bytes);
  session_->cancel();
  generation_ = std::make_shared<int>(0);
  waiting_.clear();
}

void UsbPort::close() noexcept {
  opened_ = std::make_shared<int>(0);
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
