// Hostile clients at the doors of a daemon, who walk every route of the API: each load begins when it is made and ends
// with it. Operators leave out what moves, stops or blocks the machine: that is their right, and would end the burn
// that is measured.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace veneer::tests {

class ClientLoad {
 public:
  virtual ~ClientLoad() = default;
  // What it has done so far, for people: a load that did nothing measures nothing.
  virtual std::string done() const = 0;
};

// Where they come in, and as whom.
struct ClientDoors {
  int port = 0;
  std::string socket;
  std::string session;  // an operator's: of a console link that nobody else has
};

struct ClientLoadKind {
  std::string name;
  std::string what;  // in a table's words
  std::function<std::unique_ptr<ClientLoad>(const ClientDoors& doors)> begin;
};

// Of anonymous clients: quiet, slow-header, slow-body, huge, gone, half-read, pictures, thousand, flood, long-header,
// long-query, sign-in, chunks, slow-read, deaf. Of operators over TCP: operators, op-huge, op-deaf; of those at the
// Unix socket: unix, unix-slow, unix-gone.
std::vector<ClientLoadKind> client_loads();

}  // namespace veneer::tests
