#include "drivers/transport/usb_file.h"

#include <boost/asio/post.hpp>
#include <utility>

namespace veneer {

UsbFile::UsbFile(boost::asio::io_context& io, std::filesystem::path path)
    : io_(io), path_(std::move(path)), generation_(std::make_shared<int>(0)) {}

Status UsbFile::open(OnReply on_reply, OnClosed) {
  close();
  if (Status opened = file_.open(path_); !opened) return opened;
  on_reply_ = std::move(on_reply);
  return Ok();
}

void UsbFile::submit(UsbRequest request) {
  if (!file_.is_open()) return;
  UsbReply reply;
  if (const auto* write = std::get_if<UsbWrite>(&request.what)) {
    // The question for the lines is no part of what is sent.
    asked_ = write->bytes == "\xA0";
    if (!asked_) {
      record(write->bytes);
      follow(write->bytes);
    }
  } else if (std::holds_alternative<UsbRead>(request.what)) {
    reply.done = std::exchange(asked_, false);
    if (reply.done) reply.bytes = std::string(finished_ ? "\xFF\xEC\x6F\x08\x13\x00" : "\xFF\xCE\x6F\x08\x13\x00", 6);
  }
  boost::asio::post(io_, [this, alive = std::weak_ptr<int>(generation_), reply] {
    if (!alive.expired() && on_reply_) on_reply_(reply);
  });
}

void UsbFile::submit_urgent(std::uint8_t, std::string_view bytes) noexcept {
  if (file_.is_open()) record(bytes);
  generation_ = std::make_shared<int>(0);
  asked_ = finished_ = false;
  tail_.clear();
}

void UsbFile::close() noexcept {
  generation_ = std::make_shared<int>(0);
  on_reply_ = nullptr;
  file_.close();
}

// A packet clears what the lines said before; FNSE ends a program.
void UsbFile::follow(const std::string& packet) {
  constexpr std::string_view kFinish = "FNSE";
  constexpr std::size_t kFrameBytes = 34, kHeadBytes = 2, kPayloadBytes = 30;
  finished_ = false;
  if (packet.size() != kFrameBytes) return;
  tail_ += packet.substr(kHeadBytes, kPayloadBytes);
  finished_ = tail_.find(kFinish) != std::string::npos;
  tail_ = finished_ ? std::string() : tail_.substr(tail_.size() - kFinish.size());
}

void UsbFile::record(std::string_view bytes) {
  file_.write(bytes);
  file_.flush();
}

}  // namespace veneer
