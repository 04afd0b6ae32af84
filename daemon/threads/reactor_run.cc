#include "daemon/threads/reactor_run.h"

#include <exception>
#include <optional>

namespace veneer::daemon {
namespace {

// Of the exception that is being handled.
std::string sentence_of_fault() {
  std::string what = "of an unknown kind";
  try {
    throw;
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
    // Not even a name.
  }
  return "veneerd met an error of its own program (" + what +
         ") and ends with the beam off: look at the panel, then Clear and Reset, and report it";
}

}  // namespace

Status run_reactor(boost::asio::io_context& reactor, const std::function<void(const std::string&)>& end) {
  std::optional<Error> fault;
  for (int faults = 0; faults < kMostFaults; ++faults) {
    try {
      reactor.run();
      break;
    } catch (...) {
      if (fault) continue;
      fault = Error{ErrorCode::kInternal, sentence_of_fault()};
      reactor.restart();  // it stops by itself when the handler that threw was all it had to do
      end(fault->message);
    }
  }
  return fault ? Status(*fault) : Ok();
}

}  // namespace veneer::daemon
