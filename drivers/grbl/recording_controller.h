// A file that stands for a controller: `file:/path` as the port of a GRBL laser. Every byte the driver sends is written
// into it but the status questions, and an ideal machine answers: it takes each line, is at its end at once, homes at
// the lower left corner and has its zero there. Nothing is burnt.
//
// Contract and threading: drivers/transport.h.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "base/units.h"
#include "drivers/recording_file.h"
#include "drivers/transport.h"

namespace veneer::grbl {

class RecordingController final : public Transport {
 public:
  // `io` must outlive it.
  RecordingController(boost::asio::io_context& io, std::filesystem::path path, Millimetres travel_x,
                      Millimetres travel_y);

  Status open(OnBytes on_bytes, OnClosed on_closed) override;
  void write(std::string_view bytes) override;
  void write_urgent(std::string_view bytes) noexcept override;
  void close() noexcept override;

 private:
  // What the parser holds, as $G tells it.
  struct Modes {
    int motion = 0;  // G0 to G3
    bool relative = false;
    int power_mode = 5;  // M3, M4, M5
    bool air = false;
    double feed = 0, power = 0;
  };
  void take(char byte);
  void realtime(unsigned char byte);
  void execute(const std::string& line);
  void system_command(const std::string& line);
  void block(const std::string& line);
  void reset();
  std::string report() const;
  std::string modes() const;
  void say(std::string bytes);

  boost::asio::io_context& io_;
  std::filesystem::path path_;
  Millimetres travel_x_, travel_y_;
  RecordingFile file_;
  OnBytes on_bytes_;
  std::shared_ptr<int> generation_;  // renewed by open() and close(), so that late answers know they are late
  std::string line_;
  Modes modes_;
  std::array<double, 3> at_{};  // mm
  std::array<int, 3> overrides_{100, 100, 100};
  bool held_ = false, checking_ = false;
};

}  // namespace veneer::grbl
