// Hostile clients at the TCP door of a daemon, who walk every route of the API: each load begins when it is made and
// ends with it.
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

struct ClientLoadKind {
  std::string name;
  std::string what;  // in a table's words
  std::function<std::unique_ptr<ClientLoad>(int port)> begin;
};

// quiet, slow-header, slow-body, huge, gone, half-read, thousand, flood.
std::vector<ClientLoadKind> client_loads();

}  // namespace veneer::tests
