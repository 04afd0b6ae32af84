// The daemon's end of the guardian (guardian/guarded_machine.h): who darkens the machine when this process dies.
//
// The guardian is a process that does not die with this one. Under systemd it is a unit of its own and listens at a
// socket; elsewhere the daemon starts one in a session of its own. When it is lost it is looked for, or started, again;
// until it watches, ready() refuses. So it does while the guardian does not answer: one that hangs watches nothing.
//
// Bound to the reactor.
#pragma once

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/log.h"
#include "base/result.h"
#include "guardian/guarded_machine.h"

namespace veneer::daemon {

struct GuardianOptions {
  std::string socket;             // where a guardian listens; "" = start one
  std::filesystem::path program;  // what to start
  std::filesystem::path record;   // where the one that is started keeps what it watches
  guardian::GuardedMachine machine;
  std::chrono::milliseconds ping{1000};     // is asked so often whether it is there
  std::chrono::milliseconds silence{5000};  // an answer that takes longer is none
};

class GuardianLink {
 public:
  // `on_change` is called on the reactor whenever what ready() says has changed.
  GuardianLink(boost::asio::io_context& reactor, GuardianOptions options, Logger log,
               std::function<void()> on_change = {});
  ~GuardianLink();  // without done(): to the guardian that is a death
  GuardianLink(const GuardianLink&) = delete;
  GuardianLink& operator=(const GuardianLink&) = delete;

  // Waits until the guardian watches, having darkened what an earlier daemon left behind; `patience` at most, then goes
  // on trying in the background. To be called once, before the reactor runs.
  void begin(std::chrono::milliseconds patience);
  // kRefused while nobody watches, or while what an earlier daemon left behind is not dark: no beam may begin.
  Status ready() const;
  // The machine is dark and its port is closed.
  void done();

  void on_change(std::function<void()> then) { on_change_ = std::move(then); }

 private:
  bool open();
  bool start_one();
  void listen();
  void take(const std::string& line);
  void lost();
  void try_again();
  void ask_whether_there();
  void reap();

  GuardianOptions options_;
  Logger log_;
  std::function<void()> on_change_;
  boost::asio::local::stream_protocol::socket socket_;
  boost::asio::steady_timer again_, ping_;
  std::string incoming_;
  pid_t child_ = 0;
  bool ready_ = false, watched_before_ = false;
  bool watches_ = false;                                        // has said "ready" on this connection
  std::optional<std::chrono::steady_clock::time_point> asked_;  // not answered yet
  bool left_behind_ = false;                                    // by an earlier daemon, and not dark yet
  std::shared_ptr<int> alive_;                                  // handlers hold it weakly
};

}  // namespace veneer::daemon
