// Records every byte written to a USB device into a file. Reads are answered as a Lihuiyu board does that takes every
// packet and has ended each program as soon as it has the whole of it. Nothing is burnt.
#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "drivers/recording_file.h"
#include "drivers/usb_transport.h"

namespace veneer {

class UsbFile final : public UsbTransport {
 public:
  UsbFile(boost::asio::io_context& io, std::filesystem::path path);

  Status open(OnReply on_reply, OnClosed on_closed) override;
  void submit(UsbRequest request) override;
  void submit_urgent(std::uint8_t endpoint, std::string_view bytes) noexcept override;
  void close() noexcept override;

 private:
  void record(std::string_view bytes);
  void follow(const std::string& packet);

  boost::asio::io_context& io_;
  std::filesystem::path path_;
  RecordingFile file_;
  bool asked_ = false;
  bool finished_ = false;
  std::string tail_;  // the last letters of the program, over the borders of packets
  OnReply on_reply_;
  std::shared_ptr<int> generation_;
};

}  // namespace veneer
