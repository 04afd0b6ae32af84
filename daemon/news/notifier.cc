#include "daemon/news/notifier.h"

#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "base/clock.h"
#include "daemon/orders/have_done.h"
#include "daemon/orders/notify_json.h"
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

nlohmann::json notice_json(const Notice& notice) {
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
          text ? notice.sentence : notice_json(notice).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
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
          notice_json(notice).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
          to.mqtt_user,
          to.mqtt_password_file.string()};
}

std::string place_of(const char* scheme, const NetworkAddress& at) {
  return fmt::format("{}{}://{}:{}", scheme, at.tls ? "s" : "", at.host, at.port);
}

}  // namespace

// What the lines have in common.
struct Notifier::Shared {
  Shared(NotifierOptions its_options, WorkRunner& its_workers, Logger its_log,
         std::function<void(const std::string&)> when_told)
      : options(std::move(its_options)),
        workers(its_workers),
        log(std::move(its_log)),
        on_outcome(std::move(when_told)) {}

  const NotifierOptions options;
  WorkRunner& workers;
  const Logger log;
  const std::function<void(const std::string&)> on_outcome;
  std::stop_source stop;
  std::mutex mutex;
  std::condition_variable_any pause;

  template <class Order>
  Status try_once(const Order& order, const std::string& secret) {
    const auto folder = WorkFolder::make(options.data_dir);
    if (!folder) return folder.error();
    WorkOrder work;
    work.kind = Order::kKind;
    work.what = "telling it";
    work.folder = folder->path();
    if (!secret.empty()) work.readable = {secret};
    work.devices.emplace();  // no device, but the network
    work.network = true;
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
};

// To one place, from a thread of its own.
struct Notifier::Line {
  std::string place;  // for people
  std::function<Status(Shared&, const Notice&)> try_once;
  bool failed = false;  // told once, until it works again

  void deliver(Shared& shared, const Notice& notice) {
    Status told = try_once(shared, notice);
    // What is known not to answer is asked once for each notice, not three times.
    for (std::size_t i = 0; !told && !failed && i < shared.options.pauses.size(); ++i) {
      if (!shared.wait(shared.options.pauses[i])) return;
      told = try_once(shared, notice);
    }
    if (shared.stop.stop_requested()) return;
    if (!told && !std::exchange(failed, true))
      shared.log->warn("{} could not be told what happens here: {}", place, told.error().message);
    if (told && std::exchange(failed, false)) shared.log->info("{} is told again what happens here", place);
    shared.on_outcome(told ? "delivered" : "failed");
  }
};

Notifier::Notifier(NotifierOptions options, WorkRunner& workers, Logger log,
                   std::function<void(const std::string&)> on_outcome)
    : shared_(std::make_shared<Shared>(std::move(options), workers, std::move(log), std::move(on_outcome))) {
  const NotifyConfig& to = shared_->options.to;
  const auto open = [&](const char* name, std::string place, auto order_of, std::string secret) {
    auto line = std::make_shared<Line>();
    line->place = std::move(place);
    line->try_once = [order_of, secret = std::move(secret)](Shared& shared, const Notice& notice) {
      return shared.try_once(order_of(shared.options.to, notice), secret);
    };
    lines_.push_back({std::move(line), std::make_unique<Worker>(name, 10)});
  };
  if (to.webhook) open("webhook", place_of("http", *to.webhook), webhook_of, to.webhook_token_file.string());
  if (to.mqtt) open("mqtt", place_of("mqtt", *to.mqtt), publication_of, to.mqtt_password_file.string());
}

Notifier::~Notifier() { shared_->stop.request_stop(); }

void Notifier::try_all(const TaskReporter& reporter) {
  struct Trial {
    TaskReporter reporter;
    std::mutex mutex;
    std::size_t open;  // places that were not heard of
    std::vector<std::string> told;
    std::optional<Error> failed;

    Trial(TaskReporter its_reporter, std::size_t places) : reporter(std::move(its_reporter)), open(places) {}
    void end(const std::string& place, const Status& sent) {
      const std::lock_guard lock(mutex);
      if (sent)
        told.push_back(place);
      else if (!failed)
        failed = Error{sent.error().code, fmt::format("{} was not told: {}", place, sent.error().message)};
      if (--open > 0) return;
      if (failed)
        reporter.fail(*failed);
      else
        reporter.done({{"told", told}});
    }
  };
  const auto trial = std::make_shared<Trial>(reporter, lines_.size());
  for (const OpenLine& open : lines_) {
    const bool taken =
        open.worker->try_post(WaitingRoom{shared_->options.most_waiting}, [shared = shared_, line = open.line, trial] {
          const Notice notice{Notice::What::kAlarm, false, "This is a try: the cell can tell you when it needs you.",
                              utc_timestamp()};
          trial->end(line->place, line->try_once(*shared, notice));
        });
    if (!taken)
      trial->end(open.line->place,
                 Error{ErrorCode::kUnavailable, "many notices wait to be sent there: try again in a minute"});
  }
}

void Notifier::tell(const Notice& notice) {
  const NotifierOptions& options = shared_->options;
  const bool needs_somebody = notice.urgent || notice.what == Notice::What::kOperatorNeeded;
  const WaitingRoom room{options.most_waiting + (needs_somebody ? options.more_for_urgent : 0)};
  for (const OpenLine& open : lines_) {
    const bool taken = open.worker->try_post(room, [shared = shared_, line = open.line, notice] {
      if (!shared->stop.stop_requested()) line->deliver(*shared, notice);
    });
    if (!taken) shared_->on_outcome("dropped");
  }
}

}  // namespace veneer::daemon
