#include "drivers/transport/stream_transport.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <utility>

namespace veneer {

namespace asio = boost::asio;

StreamTransport::StreamTransport(asio::io_context& io, std::string name)
    : io_(io), name_(std::move(name)), descriptor_(io), generation_(std::make_shared<int>(0)) {}

StreamTransport::~StreamTransport() { StreamTransport::close(); }

void StreamTransport::listen(OnBytes on_bytes, OnClosed on_closed) {
  on_bytes_ = std::move(on_bytes);
  on_closed_ = std::move(on_closed);
}

void StreamTransport::run_on(int descriptor) {
  boost::system::error_code error;
  descriptor_.assign(descriptor, error);
  if (error) {
    ::close(descriptor);
    return fail(
        {ErrorCode::kUnavailable,
         fmt::format("{} does not work as a device ({}): correct the port in the configuration, then restart veneerd",
                     name_, error.message())});
  }
  descriptor_.non_blocking(true, error);
  read_more();
  write_more();
}

void StreamTransport::read_more() {
  descriptor_.async_read_some(asio::buffer(incoming_), [this, alive = std::weak_ptr<int>(generation_)](
                                                           const boost::system::error_code& error, std::size_t size) {
    if (alive.expired()) return;
    if (error) return disconnected(error);
    // A copy: the handler may close this transport.
    const OnBytes on_bytes = on_bytes_;
    on_bytes({incoming_.data(), size});
    if (!alive.expired()) read_more();
  });
}

void StreamTransport::write(std::string_view bytes) {
  if (!on_closed_) return;
  unsent_ += bytes;
  write_more();
}

// Waits for the descriptor and writes by hand: bytes stay ours until the kernel takes them, so that write_urgent() can
// drop them.
void StreamTransport::write_more() {
  if (waiting_to_write_ || unsent_.empty() || !descriptor_.is_open()) return;
  waiting_to_write_ = true;
  descriptor_.async_wait(asio::posix::stream_descriptor::wait_write,
                         [this, alive = std::weak_ptr<int>(generation_)](const boost::system::error_code& error) {
                           if (alive.expired()) return;
                           waiting_to_write_ = false;
                           if (error) return disconnected(error);
                           const ssize_t written = ::write(descriptor_.native_handle(), unsent_.data(), unsent_.size());
                           if (written > 0) unsent_.erase(0, static_cast<std::size_t>(written));
                           if (written < 0 && errno != EAGAIN && errno != EINTR)
                             return disconnected({errno, boost::system::system_category()});
                           write_more();
                         });
}

void StreamTransport::write_urgent(std::string_view bytes) noexcept {
  unsent_.clear();
  if (!descriptor_.is_open()) return;
  const int descriptor = descriptor_.native_handle();
  drop_unsent(descriptor);
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    if (written == 0 || errno != EAGAIN) return;  // the link is dead; reading will say so
    // The kernel's buffer is full and could not be dropped: the bytes wait a moment for room, not longer.
    constexpr int kWaitMs = 20;
    pollfd room{descriptor, POLLOUT, 0};
    if (::poll(&room, 1, kWaitMs) <= 0) return;
  }
}

void StreamTransport::close() noexcept {
  generation_ = std::make_shared<int>(0);
  boost::system::error_code ignored;
  descriptor_.close(ignored);
  unsent_.clear();
  waiting_to_write_ = false;
  on_bytes_ = nullptr;
  on_closed_ = nullptr;
}

void StreamTransport::disconnected(const boost::system::error_code& error) {
  fail({ErrorCode::kDisconnected,
        fmt::format("the link {} is gone ({}): check the cable and the device's power", name_,
                    error == asio::error::eof ? "closed by the other side" : error.message())});
}

void StreamTransport::fail(Error error) {
  const OnClosed on_closed = std::move(on_closed_);
  close();
  if (!on_closed) return;
  asio::post(io_, [on_closed, told = std::move(error)] { on_closed(told); });
}

}  // namespace veneer
