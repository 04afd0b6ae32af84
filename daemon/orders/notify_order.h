// What a worker process is asked to tell others, and that it did. Pure; the doing is notify_work.h's, so that whoever
// orders it links no client of foreign servers.
#pragma once

#include <string>

namespace veneer::daemon {

struct CallWebhook {
  static constexpr const char* kKind = "call_webhook";
  bool tls = false;
  std::string host;
  int port = 0;
  std::string path, content_type, body;
  std::string title, priority;  // headers, as ntfy reads them
  std::string token_file;       // "": none
};

struct PublishByMqtt {
  static constexpr const char* kKind = "publish_by_mqtt";
  bool tls = false;
  std::string host;
  int port = 0;
  std::string topic, body;
  std::string user, password_file;  // "": none
};

struct Delivered {
  bool delivered = true;
};

}  // namespace veneer::daemon
