#include "daemon/store/database_thread.h"

namespace veneer::daemon {

Result<std::unique_ptr<DatabaseThread>> DatabaseThread::open(boost::asio::io_context& reactor,
                                                             const std::function<Result<db::Database>()>& open_file) {
  auto thread = std::make_unique<DatabaseThread>(reactor);
  const Status opened = thread->worker_.call([&]() -> Status {
    auto database = open_file();
    if (!database) return database.error();
    thread->database_.emplace(std::move(*database));
    thread->repositories_.emplace(*thread->database_);
    thread->needs_check_ = thread->database_->needs_check();
    thread->file_ = thread->database_->file();
    return Ok();
  });
  if (!opened) return opened.error();
  return thread;
}

Result<std::unique_ptr<DatabaseThread>> DatabaseThread::open(const std::filesystem::path& file,
                                                             boost::asio::io_context& reactor) {
  return open(reactor, [&file] { return db::Database::open(file); });
}

Result<std::unique_ptr<DatabaseThread>> DatabaseThread::open_unchecked(const std::filesystem::path& file,
                                                                       boost::asio::io_context& reactor) {
  return open(reactor, [&file] { return db::Database::open_unchecked(file); });
}

Result<std::unique_ptr<DatabaseReader>> DatabaseReader::open(const std::filesystem::path& file,
                                                             const CellDevices& devices) {
  auto database = db::Database::open_for_reading(file);
  if (!database) return database.error();
  auto reader = std::make_unique<DatabaseReader>(std::move(*database));
  reader->repositories_.devices = devices;
  return reader;
}

void DatabaseThread::set_devices(const CellDevices& devices) {
  devices_ = devices;
  call([&](Repositories& r) { r.devices = devices; });
}

void DatabaseThread::check(std::function<void(const Status&)> then) {
  worker_.post([this, then = std::move(then)]() mutable {
    const auto checked = [this] { return database_->check_integrity(checking_.get_token()); };
    boost::asio::post(reactor_, [sound = caught(checked), then = std::move(then)] { then(sound); });
  });
}

void DatabaseThread::distrust(const Error& why) {
  worker_.post([this, why] { database_->distrust(why); });
}

void DatabaseThread::dispel(int doubts) {
  worker_.post([this, doubts] { database_->dispel(doubts); });
}

void DatabaseThread::ask_may_write(std::function<void(const Status&)> then) {
  worker_.post([this, then = std::move(then)]() mutable {
    boost::asio::post(reactor_, [may = database_->may_write(), then = std::move(then)] { then(may); });
  });
}

void DatabaseThread::owe(std::function<Status(Repositories&)> write, std::function<void()> tried,
                         std::function<void(const Status&)> settled) {
  worker_.post([this, owed = Owed{std::move(write), std::move(settled)}, tried = std::move(tried)]() mutable {
    {
      const Doubts doubts(*this);
      owed_.push_back(std::move(owed));
      pay();
    }
    if (tried) boost::asio::post(reactor_, std::move(tried));
  });
}

void DatabaseThread::pay() {
  while (!owed_.empty()) {
    const Status written = caught([this] { return owed_.front().write(*repositories_); });
    if (!written && !has_settled(written.error().code)) {
      why_owed_ = written.error().message;
      return;
    }
    if (owed_.front().settled)
      boost::asio::post(reactor_, [settled = std::move(owed_.front().settled), written] { settled(written); });
    owed_.pop_front();
  }
}

void DatabaseThread::tell_doubt() noexcept {
  try {
    if (auto why = database_->take_doubt(); why && on_doubt_)
      boost::asio::post(reactor_, [told = on_doubt_, why = std::move(*why)] { told(why); });
  } catch (const std::exception&) {
    // Out of memory: the next start checks it all the same.
  }
}

DatabaseThread::~DatabaseThread() {
  cancel_check();
  worker_.call([this] {
    repositories_.reset();
    database_.reset();
  });
}

}  // namespace veneer::daemon
