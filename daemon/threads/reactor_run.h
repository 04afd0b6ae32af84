// The loop that owns the laser, from its first handler to its last, whatever they throw.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>

#include "base/result.h"

namespace veneer::daemon {

// Runs `reactor` until it is stopped; Ok() when nothing was thrown.
//
// An exception that reaches the loop has broken a chain of handlers that keeps itself going: a port that is read, a
// timer that is set again, a door that lets clients in. Nobody knows which one, so the loop is not trusted with the
// machine any more. `end` is called at once, before any other handler, with one sentence: it darkens the machine and
// sees to it that the reactor is stopped when what must be written is written. Handlers run until then, so that it can
// be; what they throw is dropped, and after `kMostFaults` of them the loop ends without waiting. Then the sentence is
// the error, kInternal.
//
// `end` must not throw.
inline constexpr int kMostFaults = 16;
Status run_reactor(boost::asio::io_context& reactor, const std::function<void(const std::string& sentence)>& end);

}  // namespace veneer::daemon
