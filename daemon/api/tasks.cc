#include "daemon/api/tasks.h"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <mutex>
#include <span>
#include <string_view>
#include <utility>

#include "base/hash.h"
#include "daemon/api/api_message.h"

namespace veneer::daemon {
namespace {

constexpr std::size_t kMostOfAList = 20, kMostOfAText = 300, kMostOfABrief = 4096;

std::string text_of(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool is_short(const nlohmann::json& value) {
  const auto one_is_short = [](const nlohmann::json& one) {
    return one.is_string() ? one.get_ref<const std::string&>().size() <= kMostOfAText : one.is_primitive();
  };
  return value.is_array() ? value.size() <= kMostOfAList && std::ranges::all_of(value, one_is_short)
                          : one_is_short(value);
}

// Not the shapes and lists that a client may have asked for.
std::string brief_of(const nlohmann::json& result) {
  if (!result.is_object()) return "";
  nlohmann::json out = nlohmann::json::object();
  std::size_t left = kMostOfABrief - 2;  // of the braces
  for (const auto& [key, value] : result.items()) {
    if (!is_short(value)) continue;
    const std::size_t length = text_of(key).size() + text_of(value).size() + 2;
    if (length > left) continue;
    left -= length;
    out[key] = value;
  }
  return text_of(out);
}

// What says where a device is plugged in or where a file lies: in the results of this kind of work, the field of this
// name.
using PlaceField = std::pair<std::string_view, std::string_view>;
constexpr std::array kPlaceFields{PlaceField{"integrity check", "file"}, PlaceField{"backup", "folder"},
                                  PlaceField{"find cameras", "device"},  PlaceField{"find cameras", "node"},
                                  PlaceField{"find cameras", "problem"}, PlaceField{"try camera", "device"},
                                  PlaceField{"find scanners", "name"},   PlaceField{"find scanners", "problem"}};

// However deep. What is empty names no place.
void strike_places(nlohmann::json& told, std::string_view kind) {
  if (!told.is_structured()) return;
  for (auto part = told.begin(); part != told.end(); ++part) {
    const bool is_place = told.is_object() && part->is_string() &&
                          std::ranges::find(kPlaceFields, PlaceField{kind, part.key()}) != kPlaceFields.end();
    if (!is_place)
      strike_places(*part, kind);
    else if (!part->get_ref<const std::string&>().empty())
      *part = "(an operator is told where)";
  }
}

std::shared_ptr<const TaskResult> without_places(const nlohmann::json& result, std::string_view kind) {
  if (std::ranges::find(kPlaceFields, kind, &PlaceField::first) == kPlaceFields.end()) return nullptr;
  nlohmann::json less = result;
  strike_places(less, kind);
  return less == result ? nullptr : std::make_shared<const TaskResult>(less);
}

}  // namespace

TaskResult::TaskResult(const nlohmann::json& result, std::string_view kind)
    : json(text_of(result)),
      brief(brief_of(result)),
      hash(sha256_hex(std::as_bytes(std::span(json))).substr(0, 32)),
      to_viewers(without_places(result, kind)) {}

const char* to_string(TaskState state) {
  switch (state) {
    case TaskState::kRunning:
      return "running";
    case TaskState::kDone:
      return "done";
    case TaskState::kFailed:
      return "failed";
    case TaskState::kCancelled:
      return "cancelled";
  }
  return "failed";
}

TaskView shown_to_viewers(const TaskView& task, const std::function<void(nlohmann::json&)>& strike) {
  TaskView out = task;
  nlohmann::json told = {out.text, out.error ? out.error->message : ""};
  strike(told);
  out.text = told[0];
  if (out.error) out.error->message = told[1];
  if (out.result && out.result->to_viewers) out.result = out.result->to_viewers;
  return out;
}

nlohmann::json to_list_json(const TaskView& task) {
  nlohmann::json json = {{"id", task.id},
                         {"kind", task.kind},
                         {"state", to_string(task.state)},
                         {"progress", task.progress},
                         {"text", task.text}};
  if (task.shortened) json["shortened"] = true;
  if (task.error) json["error"] = error_json(to_string(task.error->code), task.error->message);
  return json;
}

namespace {

// `object`, as text, with a last property whose value is known as text.
std::string with_last(const nlohmann::json& object, std::string_view name, const std::string& value) {
  std::string text = text_of(object);
  text.reserve(text.size() + name.size() + value.size() + 5);
  text.pop_back();
  return text.append(",\"").append(name).append("\":").append(value).append("}");
}

}  // namespace

std::string task_event(const TaskView& task) {
  const nlohmann::json listed = to_list_json(task);
  const bool has_summary = task.result && !task.result->brief.empty();
  return with_last({{"type", "task"}}, "task",
                   has_summary ? with_last(listed, "summary", task.result->brief) : text_of(listed));
}

std::string to_text(const TaskView& task, const nlohmann::json& more) {
  nlohmann::json json = to_list_json(task);
  json.update(more);
  return task.result ? with_last(json, "result", task.result->json) : text_of(json);
}

// The way from workers to the reactor. Once the registry has shut it, nothing is posted any more, so that the reactor
// may go away while a worker still reports.
struct TaskGate {
  std::mutex mutex;
  boost::asio::io_context* reactor = nullptr;  // guarded by mutex
  TaskRegistry* registry = nullptr;            // reactor only
};

// What worker and registry both hold. Everything mutable is guarded by `mutex`; the registry takes it over on the
// reactor, at most one posted take() being under way.
struct TaskReporter::Shared : std::enable_shared_from_this<TaskReporter::Shared> {
  Shared(std::shared_ptr<TaskGate> gate_in, std::int64_t id_in, std::string kind_in)
      : gate(std::move(gate_in)), id(id_in), kind(std::move(kind_in)) {}

  const std::shared_ptr<TaskGate> gate;
  const std::int64_t id;
  const std::string kind;
  std::stop_source stop;

  std::mutex mutex;
  bool posted = false;
  bool over = false;
  double progress = 0;
  std::string text;
  std::optional<Result<std::shared_ptr<const TaskResult>>> end;

  void post_take() {
    const std::lock_guard lock(gate->mutex);
    if (!gate->reactor) return;
    boost::asio::post(*gate->reactor, [self = shared_from_this()] {
      if (self->gate->registry) self->gate->registry->take(self);
    });
  }
  template <class Change>
  void report(Change change) {
    {
      const std::lock_guard lock(mutex);
      if (over) return;
      change();
      if (posted) return;
      posted = true;
    }
    post_take();
  }
  void report_end(const Result<nlohmann::json>& how) {
    // On whose thread it was made, without the lock.
    auto written = how ? Result<std::shared_ptr<const TaskResult>>(std::make_shared<const TaskResult>(*how, kind))
                       : Result<std::shared_ptr<const TaskResult>>(how.error());
    report([&] {
      end = std::move(written);
      over = true;
    });
  }
};

namespace {

// Ends the task when its last reporter goes away without having said how it ended.
std::shared_ptr<void> make_guard(std::function<void()> on_last) {
  return std::shared_ptr<void>(nullptr, [on_last = std::move(on_last)](void*) { on_last(); });
}

}  // namespace

std::int64_t TaskReporter::id() const { return shared_->id; }
std::stop_token TaskReporter::stop_token() const { return shared_->stop.get_token(); }

void TaskReporter::progress(double fraction, std::string text) const {
  shared_->report([&] {
    shared_->progress = std::max(shared_->progress, std::clamp(fraction, 0.0, 1.0));
    shared_->text = std::move(text);
  });
}

void TaskReporter::done(const nlohmann::json& result) const { shared_->report_end(result); }
void TaskReporter::fail(Error error) const { shared_->report_end(std::move(error)); }
void TaskReporter::finish(const Result<nlohmann::json>& result) const { shared_->report_end(result); }

struct TaskRegistry::Entry {
  TaskView view;
  std::stop_source stop;
  TimePoint last_event;
  bool untold = false;  // something has changed since
};

TaskRegistry::TaskRegistry(boost::asio::io_context& reactor, const Clock& clock, std::unique_ptr<OneShotTimer> timer,
                           std::function<void(const TaskView&)> on_change)
    : clock_(clock), timer_(std::move(timer)), on_change_(std::move(on_change)), gate_(std::make_shared<TaskGate>()) {
  gate_->reactor = &reactor;
  gate_->registry = this;
}

TaskRegistry::~TaskRegistry() {
  {
    const std::lock_guard lock(gate_->mutex);
    gate_->reactor = nullptr;
  }
  gate_->registry = nullptr;
  for (const auto& entry : entries_) {
    if (entry->view.state == TaskState::kRunning) entry->stop.request_stop();
  }
}

void TaskRegistry::go_on(std::int64_t last_id, std::vector<TaskView> before) {
  for (TaskView& view : before) {
    last_id = std::max(last_id, view.id);
    auto entry = std::make_unique<Entry>();
    entry->view = std::move(view);
    entries_.push_back(std::move(entry));
  }
  last_id_ = last_id + kSkipped;
  prune();
}

TaskReporter TaskRegistry::start(std::string kind, std::string text) {
  auto shared = std::make_shared<TaskReporter::Shared>(gate_, ++last_id_, kind);
  shared->text = text;
  auto entry = std::make_unique<Entry>();
  entry->view.id = shared->id;
  entry->view.kind = std::move(kind);
  entry->view.text = std::move(text);
  entry->stop = shared->stop;
  entry->last_event = clock_.now();
  entries_.push_back(std::move(entry));
  prune();
  if (on_change_) on_change_(entries_.back()->view);

  // The reporter's copies share a guard; posted take()s hold only what is inside it.
  auto guard = make_guard([shared] {
    shared->report_end(Error{ErrorCode::kInternal, "the work ended without saying how: see the daemon's log"});
  });
  return TaskReporter(std::shared_ptr<TaskReporter::Shared>(guard, shared.get()));
}

void TaskRegistry::take(const std::shared_ptr<TaskReporter::Shared>& shared) {
  const auto found = std::ranges::find(entries_, shared->id, [](const auto& entry) { return entry->view.id; });
  if (found == entries_.end()) return;
  Entry& entry = **found;
  TaskView& view = entry.view;
  {
    const std::lock_guard lock(shared->mutex);
    shared->posted = false;
    entry.untold |= shared->text != view.text || shared->progress != view.progress;
    view.progress = shared->progress;
    view.text = shared->text;
    if (shared->end) {
      entry.untold = true;
      if (shared->end->ok()) {
        view.state = TaskState::kDone;
        view.progress = 1;
        view.result = std::move(shared->end->value());
      } else {
        view.error = shared->end->error();
        view.state = view.error->code == ErrorCode::kCancelled ? TaskState::kCancelled : TaskState::kFailed;
      }
      shared->end.reset();
    }
  }
  if (!entry.untold) return;
  if (view.state != TaskState::kRunning || clock_.now() - entry.last_event >= kEventInterval) return tell(entry);
  if (timed_) return;
  timed_ = true;
  timer_->after(kEventInterval - (clock_.now() - entry.last_event), [this] { tell_due(); });
}

void TaskRegistry::tell(Entry& entry) {
  entry.last_event = clock_.now();
  entry.untold = false;
  const TaskView told = entry.view;  // on_change may start another task, which may prune this one
  if (on_change_) on_change_(told);
}

void TaskRegistry::tell_due() {
  timed_ = false;
  const TimePoint now = clock_.now();
  std::vector<std::int64_t> due;
  std::optional<Duration> wait;
  for (const auto& entry : entries_) {
    if (!entry->untold) continue;
    const Duration left = kEventInterval - (now - entry->last_event);
    if (left <= Duration::zero())
      due.push_back(entry->view.id);
    else
      wait = std::min(wait.value_or(left), left);
  }
  if (wait) {
    timed_ = true;
    timer_->after(*wait, [this] { tell_due(); });
  }
  for (const std::int64_t id : due) {
    const auto found = std::ranges::find(entries_, id, [](const auto& entry) { return entry->view.id; });
    if (found != entries_.end()) tell(**found);
  }
}

void TaskRegistry::prune() {
  while (entries_.size() > kKept) {
    const auto over =
        std::ranges::find_if(entries_, [](const auto& entry) { return entry->view.state != TaskState::kRunning; });
    if (over == entries_.end()) return;
    entries_.erase(over);
  }
}

const TaskView* TaskRegistry::find(std::int64_t id) const {
  const auto found = std::ranges::find(entries_, id, [](const auto& entry) { return entry->view.id; });
  return found == entries_.end() ? nullptr : &(*found)->view;
}

std::vector<const TaskView*> TaskRegistry::list() const {
  std::vector<const TaskView*> views;
  views.reserve(entries_.size());
  for (const auto& entry : entries_) views.push_back(&entry->view);
  return views;
}

std::vector<const TaskView*> TaskRegistry::running() const {
  auto views = list();
  std::erase_if(views, [](const TaskView* view) { return view->state != TaskState::kRunning; });
  return views;
}

Status TaskRegistry::cancel(std::int64_t id) {
  const auto found = std::ranges::find(entries_, id, [](const auto& entry) { return entry->view.id; });
  if (found == entries_.end()) {
    return Error{ErrorCode::kNotFound, "there is no task " + std::to_string(id) + ", or it is long over"};
  }
  if ((*found)->view.state != TaskState::kRunning) {
    return Error{ErrorCode::kConflict, "task " + std::to_string(id) + " is over already"};
  }
  (*found)->stop.request_stop();
  return Ok();
}

}  // namespace veneer::daemon
