#include "daemon/services/notifier.h"

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <utility>

#include "base/clock.h"
#include "daemon/orders/have_done.h"
#include "daemon/orders/notify_order.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {
namespace {

const char* word_of(Notice::What what) {
  switch (what) {
    case Notice::What::kJobDone:
      return "job";
    case Notice::What::kAlarm:
      return "alarm";
    case Notice::What::kOperatorNeeded:
      return "operator";
  }
  return "alarm";
}

const char* title_of(Notice::What what) {
  switch (what) {
    case Notice::What::kJobDone:
      return "Job done";
    case Notice::What::kAlarm:
      return "Alarm";
    case Notice::What::kOperatorNeeded:
      return "Operator needed";
  }
  return "Alarm";
}

nlohmann::json to_json(const Notice& notice) {
  return {{"schema_version", 1},
          {"event", word_of(notice.what)},
          {"urgent", notice.urgent},
          {"title", title_of(notice.what)},
          {"message", notice.sentence},
          {"at", notice.at},
          {"job", notice.job ? nlohmann::json(*notice.job) : nlohmann::json()}};
}

CallWebhook webhook_of(const NotifyConfig& to, const Notice& notice) {
  const NetworkAddress& at = *to.webhook;
  const bool text = to.webhook_format == "text";
  return {at.tls,
          at.host,
          at.port,
          at.path,
          text ? "text/plain; charset=utf-8" : "application/json",
          text ? notice.sentence : to_json(notice).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
          title_of(notice.what),
          notice.urgent ? "high" : "default",
          to.webhook_token_file.string()};
}

PublishByMqtt publication_of(const NotifyConfig& to, const Notice& notice) {
  const NetworkAddress& at = *to.mqtt;
  return {at.tls,
          at.host,
          at.port,
          to.mqtt_topic + "/" + word_of(notice.what),
          to_json(notice).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
          to.mqtt_user,
          to.mqtt_password_file.string()};
}

std::string place_of(const char* scheme, const NetworkAddress& at) {
  return fmt::format("{}{}://{}:{}", scheme, at.tls ? "s" : "", at.host, at.port);
}

}  // namespace

struct Notifier::Shared {
  Shared(NotifierOptions its_options, WorkRunner& its_workers, Logger its_log,
         std::function<void(const std::string&)> when_told)
      : options(std::move(its_options)),
        workers(its_workers),
        log(std::move(its_log)),
        on_outcome(std::move(when_told)) {}

  NotifierOptions options;
  WorkRunner& workers;
  Logger log;
  std::function<void(const std::string&)> on_outcome;
  std::stop_source stop;
  std::mutex mutex;
  std::condition_variable_any pause;
  // The worker's: told once, until it works again.
  bool webhook_failed = false, mqtt_failed = false;

  template <class Order>
  Status try_once(const Order& order, const std::string& secret) {
    const auto folder = WorkFolder::make(options.data_dir);
    if (!folder) return folder.error();
    WorkOrder work;
    work.kind = Order::kKind;
    work.what = "telling it";
    work.folder = folder->path();
    if (!secret.empty()) work.readable = {secret};
    work.devices.emplace();  // the network, and no device
    work.deadline = options.deadline;
    const auto done = have_done<Delivered>(workers, std::move(work), order, {}, stop.get_token());
    if (done) return Ok();
    if (done.error().code != ErrorCode::kTimeout) return done.error();
    return Error{ErrorCode::kUnavailable, fmt::format("no answer within {} s: look whether it runs",
                                                      std::chrono::duration<double>(options.deadline).count())};
  }

  // False when it is to be given up: the daemon ends.
  bool wait(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex);
    pause.wait_for(lock, stop.get_token(), time, [] { return false; });
    return !stop.stop_requested();
  }

  template <class Order>
  void deliver(const Order& order, const std::string& secret, const std::string& place, bool& failed) {
    Status told = try_once(order, secret);
    // What is known not to answer is asked once for each notice, not three times.
    for (std::size_t i = 0; !told && !failed && i < options.pauses.size(); ++i) {
      if (!wait(options.pauses[i])) return;
      told = try_once(order, secret);
    }
    if (stop.stop_requested()) return;
    if (!told && !std::exchange(failed, true))
      log->warn("{} could not be told what happens here: {}", place, told.error().message);
    if (told && std::exchange(failed, false)) log->info("{} is told again what happens here", place);
    on_outcome(told ? "delivered" : "failed");
  }

  void deliver(const Notice& notice) {
    const NotifyConfig& to = options.to;
    if (to.webhook)
      deliver(webhook_of(to, notice), to.webhook_token_file.string(), place_of("http", *to.webhook), webhook_failed);
    if (to.mqtt)
      deliver(publication_of(to, notice), to.mqtt_password_file.string(), place_of("mqtt", *to.mqtt), mqtt_failed);
  }
};

Notifier::Notifier(NotifierOptions options, WorkRunner& workers, Logger log,
                   std::function<void(const std::string&)> on_outcome)
    : shared_(std::make_shared<Shared>(std::move(options), workers, std::move(log), std::move(on_outcome))) {
  if (shared_->options.to.webhook || shared_->options.to.mqtt) worker_ = std::make_unique<Worker>("notifier", 10);
}

Notifier::~Notifier() { shared_->stop.request_stop(); }

void Notifier::try_all(const TaskReporter& reporter) {
  const bool taken = worker_->try_post(WaitingRoom{shared_->options.most_waiting}, [shared = shared_, reporter] {
    const NotifyConfig& to = shared->options.to;
    const Notice notice{Notice::What::kAlarm, false, "This is a try: the cell can tell you when it needs you.",
                        utc_timestamp()};
    std::vector<std::string> told;
    if (to.webhook) {
      if (const Status sent = shared->try_once(webhook_of(to, notice), to.webhook_token_file.string()); !sent)
        return reporter.fail(sent.error());
      told.push_back(place_of("http", *to.webhook));
    }
    if (to.mqtt) {
      if (const Status sent = shared->try_once(publication_of(to, notice), to.mqtt_password_file.string()); !sent)
        return reporter.fail(sent.error());
      told.push_back(place_of("mqtt", *to.mqtt));
    }
    reporter.done({{"told", told}});
  });
  if (!taken) reporter.fail({ErrorCode::kUnavailable, "many notices wait to be sent: try again in a minute"});
}

void Notifier::tell(Notice notice) {
  if (!worker_) return;
  const NotifierOptions& options = shared_->options;
  const bool needs_somebody = notice.urgent || notice.what == Notice::What::kOperatorNeeded;
  const WaitingRoom room{options.most_waiting + (needs_somebody ? options.more_for_urgent : 0)};
  const bool taken = worker_->try_post(room, [shared = shared_, notice = std::move(notice)] {
    if (!shared->stop.stop_requested()) shared->deliver(notice);
  });
  if (!taken) shared_->on_outcome("dropped");
}

}  // namespace veneer::daemon
