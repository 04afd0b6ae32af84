// Times and limits of the Lihuiyu driver. All durations are device time.
#pragma once

#include <chrono>

#include "base/clock.h"
#include "drivers/lihuiyu/egv_encoder.h"

namespace veneer::lihuiyu {

struct LihuiyuOptions {
  Board board = Board::kM2;
  // The board knows neither its travel nor its position.
  double travel_x_mm = 300, travel_y_mm = 200;

  // Asking for the board's lines: while a packet waits or is confirmed, while a program's end is awaited, at rest.
  Duration busy_poll_period = std::chrono::milliseconds(10);
  Duration poll_period = std::chrono::milliseconds(20);
  Duration rest_poll_period = std::chrono::milliseconds(500);

  // Of transfers. A board that said it takes packets takes one at once. One that does so only later may have lost its
  // supply in between, and with it its program, without any poll having seen that: so this and the polls' period must
  // be shorter than what a supply and a board need to come back.
  Duration write_timeout = std::chrono::milliseconds(150);
  Duration status_timeout = std::chrono::milliseconds(100);
  Duration drain_timeout = std::chrono::milliseconds(5);  // late answers are thrown away for this long

  Duration connect_timeout = std::chrono::milliseconds(4500);
  Duration silence_timeout = std::chrono::seconds(2);  // without a status that makes sense
  Duration busy_timeout = std::chrono::seconds(15);    // a board that stays busy has locked up
  Duration finish_timeout = std::chrono::seconds(10);  // beyond the time the motion can need
  Duration reset_retry = std::chrono::milliseconds(200);
  int rejects = 10;  // of one packet, before the link is given up

  // The board does not say when it is home: it is left alone for at least this long, and then until it is not busy.
  Duration homing_wait = std::chrono::seconds(3);
  Duration homing_timeout = std::chrono::seconds(60);

  bool recording = false;  // the port is a file: LaserLimits::burns

  double packet_motion_s = 0.09;  // see egv_encoder.h
  // How slow a board may be: dark ways, and motion in compact mode against what the speed code says.
  double slowest_rapid_mm_s = 60;
  double slowest_share = 0.6;
  // A program that ends before this share of its shortest duration has not been executed.
  double earliest_share = 0.95;

  // Device time runs `scale` times as fast as real time, but links, processes and schedulers do not: stretches the
  // limits on them.
  static LihuiyuOptions for_time_scale(double scale);
  // For a file that stands for a board: it is home at once, and done with a program as soon as it has it.
  static LihuiyuOptions for_recording();
};

}  // namespace veneer::lihuiyu
