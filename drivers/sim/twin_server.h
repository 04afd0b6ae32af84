// The twin's Unix socket: JSON lines, one object each way. Quick requests are answered on the reactor, slow ones by the
// one worker, so that a lid opens while a scan is being made.
//
// Threading: bound to the reactor that runs `io`; owns the worker.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/thread_pool.hpp>
#include <filesystem>
#include <memory>

#include "base/log.h"
#include "base/result.h"
#include "drivers/sim/twin_service.h"

namespace veneer::sim {

class TwinServer {
 public:
  TwinServer(boost::asio::io_context& io, TwinService& service, Logger log);
  ~TwinServer();
  // kConflict when another twin answers there; a dead socket file is replaced.
  Status listen(const std::filesystem::path& socket);
  // Ends the worker's current request and removes the socket.
  void stop();

 private:
  class Session;
  void accept();

  boost::asio::io_context& io_;
  TwinService& service_;
  Logger log_;
  boost::asio::local::stream_protocol::acceptor acceptor_;
  boost::asio::thread_pool worker_{1};
  std::filesystem::path path_;
};

}  // namespace veneer::sim
