#include "tests/soak/stop_loads.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <thread>

#include "calib/kerf_meter.h"
#include "daemon/api/route_table.h"
#include "daemon/stock/panel_library.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "tests/support/event_listener.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
namespace asio = boost::asio;
using asio::ip::tcp;

constexpr const char* kBookedThen = "2026-01-01T00:00:00.000Z";
constexpr int kBookedPieces = 100'000, kPiecesPerJob = 1000;
const PanelId kBooked{"P-0001"}, kFree{"P-0002"};

cv::Mat random_wood(int side) {
  cv::Mat wood(side, side, CV_8UC3);
  cv::randu(wood, 0, 255);
  cv::GaussianBlur(wood, wood, {0, 0}, 6);
  cv::normalize(wood, wood, 0, 255, cv::NORM_MINMAX);
  return wood;
}

// Threads that each do one thing again and again.
class Crowd {
 public:
  Crowd() = default;
  ~Crowd() {
    ending_ = true;
    for (auto& thread : threads_) thread.join();
  }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  void add(std::function<void()> again) {
    threads_.emplace_back([this, again = std::move(again)] {
      while (!ending_) again();
    });
  }
  bool ending() const { return ending_; }

 private:
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

// Anybody at the TCP door, byte by byte.
class Visitor {
 public:
  explicit Visitor(int port) : socket_(loop_) {
    socket_.connect(tcp::endpoint(asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port)), fault_);
    host_ = fmt::format("127.0.0.1:{}", port);
  }
  void ask(const std::string& target, const std::string& headers = "") {
    const std::string request = fmt::format("GET /api/v1{} HTTP/1.1\r\nHost: {}\r\n{}\r\n", target, host_, headers);
    if (!fault_) asio::write(socket_, asio::buffer(request), fault_);
  }
  tcp::socket& socket() { return socket_; }
  asio::io_context& loop() { return loop_; }
  bool ok() const { return !fault_; }

 private:
  asio::io_context loop_;
  tcp::socket socket_;
  std::string host_;
  boost::system::error_code fault_;
};

class Nothing final : public StopLoad {
 public:
  std::string done() const override { return ""; }
  Status applied() const override { return Ok(); }
};

// Clients of the event stream that read all they are told: as many as one identity may have, of four identities.
class Listeners final : public StopLoad {
 public:
  Listeners(const LaserOnlyCell& cell, int port) {
    constexpr int kIdentities = 4, kOfEach = 8;
    for (int identity = 0; identity < kIdentities; ++identity) {
      const std::string session = identity == 0 ? "" : session_of_a_new_link(cell, port);
      for (int i = 0; i < kOfEach; ++i) readers_.emplace_back([this, port, session] { listen(port, session); });
    }
  }
  ~Listeners() override {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
      for (auto* listener : listening_) listener->end();
    }
    for (auto& reader : readers_) reader.join();
  }
  std::string done() const override {
    const std::lock_guard lock(mutex_);
    return fmt::format("{} clients listen and have read {} events", listening_.size(), events_);
  }
  Status applied() const override {
    const std::lock_guard lock(mutex_);
    if (listening_.size() == readers_.size() && events_ > 0) return Ok();
    return Error{ErrorCode::kUnavailable,
                 fmt::format("only {} of {} clients listen to the event stream", listening_.size(), readers_.size())};
  }

 private:
  static std::string session_of_a_new_link(const LaserOnlyCell& cell, int port) {
    const auto link = cell.api().post("/console-links");
    const std::string url = link ? link->value("url", "") : "";
    const auto at = url.find("token=");
    if (at == std::string::npos) return "";
    const auto session =
        cli::ApiClient(cli::ApiAddress{"", "127.0.0.1", port}).post("/session", {{"token", url.substr(at + 6)}});
    return session ? session->value("session", "") : "";
  }
  void listen(int port, const std::string& session) {
    try {
      testing::EventListener listener(port, session);
      {
        const std::lock_guard lock(mutex_);
        if (ending_) return;
        listening_.insert(&listener);
      }
      while (!listener.next().is_null()) {
        const std::lock_guard lock(mutex_);
        ++events_;
      }
      const std::lock_guard lock(mutex_);
      listening_.erase(&listener);
    } catch (const std::exception&) {  // turned away: applied() tells
    }
  }

  mutable std::mutex mutex_;
  std::set<testing::EventListener*> listening_;  // guarded by mutex_, as the next two
  std::size_t events_ = 0;
  bool ending_ = false;
  std::vector<std::thread> readers_;
};

// Clients that read the ledger of 100,000 pieces to its end, page by page, again and again.
class LedgerReaders final : public StopLoad {
 public:
  explicit LedgerReaders(const LaserOnlyCell& cell) {
    for (int i = 0; i < 4; ++i) crowd_.add([this, address = cell.api().address()] { read_all(address); });
  }
  std::string done() const override {
    return fmt::format("{} pages of the ledger, {} times to its end, {} MB", pages_.load(), ends_.load(),
                       bytes_ / 1'000'000);
  }
  Status applied() const override {
    return pages_ > 0 ? Ok() : Status(Error{ErrorCode::kUnavailable, "no page of the ledger was read"});
  }

 private:
  void read_all(const cli::ApiAddress& address) {
    const cli::ApiClient api(address);
    for (std::int64_t cursor = 0; !crowd_.ending();) {
      const auto reply = api.raw(
          "GET", fmt::format("/api/v1/panels/{}/ledger?limit=1000&cursor={}", kBooked.value, cursor), "", "", {});
      if (!reply || reply->status != 200) return std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++pages_;
      bytes_ += reply->body.size();
      const auto page = nlohmann::json::parse(reply->body, nullptr, false);
      if (!page.is_object() || !page.contains("next") || !page["next"].is_number()) {
        ++ends_;
        return;
      }
      cursor = page["next"].get<std::int64_t>();
    }
  }

  std::atomic<std::size_t> pages_{0}, ends_{0}, bytes_{0};
  Crowd crowd_;
};

// The daemon plans one job after the other, and planners of veneerctl keep every core busy.
class Planners final : public StopLoad {
 public:
  Planners(const LaserOnlyCell& cell, const fs::path& bin_dir, const fs::path& dir) {
    cv::imwrite((dir / "wood.png").string(), random_wood(1200));
    const cv::Mat target = random_wood(500);
    cv::imwrite((dir / "target.png").string(), target);
    std::vector<unsigned char> png;
    cv::imencode(".png", target, png);
    crowd_.add([this, bin_dir, dir] {
      auto planner =
          ChildProcess::start({(bin_dir / "veneerctl").string(), "plan", "--target", (dir / "target.png").string(),
                               "--panel", (dir / "wood.png").string() + ",dpi=200", "--size-mm", "60", "--patch-mm",
                               "6", "--dpi", "200", "--out", (dir / "plan").string()},
                              dir / "plan.log");
      if (!planner) return;
      while (!crowd_.ending() && planner->running()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++plans_;
    });
    crowd_.add([this, address = cell.api().address(), body = std::string(png.begin(), png.end())] {
      const cli::ApiClient api(address);
      auto begun = api.request("POST", "/jobs?name=soak&size_mm=40&patch_mm=5&panels=" + kFree.value, body,
                               "application/octet-stream");
      if (!begun) return refused(begun.error().message);
      const auto made = api.wait_task((*begun)["task"]);
      if (!made) return refused(made.error().message);
      ++jobs_;
      static_cast<void>(api.post(fmt::format("/jobs/{}/cancel", (*made)["job"].get<int>())));
    });
  }
  std::string done() const override {
    return fmt::format("{} plans by veneerctl, {} by the daemon", plans_.load(), jobs_.load());
  }
  Status applied() const override {
    const std::lock_guard lock(mutex_);
    if (plans_ > 0 && jobs_ > 0) return Ok();
    return Error{ErrorCode::kUnavailable, fmt::format("nothing was planned: {} by veneerctl, {} by the daemon; {}",
                                                      plans_.load(), jobs_.load(), refusal_)};
  }

 private:
  void refused(const std::string& sentence) {
    {
      const std::lock_guard lock(mutex_);
      refusal_ = sentence;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::atomic<int> plans_{0}, jobs_{0};
  mutable std::mutex mutex_;
  std::string refusal_;  // of the daemon, the last one; guarded by mutex_
  Crowd crowd_;
};

// Both at once, as in a shop where everybody looks on while pictures are planned.
class ListenersAndPlanners final : public StopLoad {
 public:
  ListenersAndPlanners(const LaserOnlyCell& cell, const fs::path& bin_dir, const fs::path& dir)
      : listeners_(cell, cell.tcp_port()), planners_(cell, bin_dir, dir) {}
  std::string done() const override { return listeners_.done() + "; " + planners_.done(); }
  Status applied() const override {
    const Status listened = listeners_.applied();
    return listened ? planners_.applied() : listened;
  }

 private:
  Listeners listeners_;
  Planners planners_;
};

// Operators who send pictures of 48 MB that are none.
class Uploads final : public StopLoad {
 public:
  explicit Uploads(const LaserOnlyCell& cell) {
    const auto body = std::make_shared<std::string>(48'000'000, 'p');
    for (int i = 0; i < 2; ++i)
      crowd_.add([this, body, address = cell.api().address()] {
        const auto reply = cli::ApiClient(address).raw("POST", "/api/v1/jobs?name=none&size_mm=40&patch_mm=5", *body,
                                                       "application/octet-stream", {});
        // Refused at the door it would not be an upload.
        if (reply && (reply->status < 300 || reply->status == 400 || reply->status == 422)) ++uploads_;
        if (!reply || reply->status >= 500) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      });
  }
  std::string done() const override { return fmt::format("{} uploads of 48 MB", uploads_.load()); }
  Status applied() const override {
    return uploads_ > 0 ? Ok() : Status(Error{ErrorCode::kUnavailable, "no upload was taken"});
  }

 private:
  std::atomic<int> uploads_{0};
  Crowd crowd_;
};

// Operators who send JSON as large as the doors let through: one where a picture is expected, one as a drawing that
// would take a gigabyte if it were read as it is.
class JsonUploads final : public StopLoad {
 public:
  explicit JsonUploads(const LaserOnlyCell& cell) {
    const auto list_of = [](std::string text, const std::string& item, std::size_t bytes) {
      while (text.size() + item.size() + 2 < bytes) text += item;
      text.back() = ']';
      return std::make_shared<const std::string>(text + "}");
    };
    send(cell, "/api/v1/jobs", list_of(R"({"plan":[)", "0,", 48'000'000), 413);
    send(cell, "/api/v1/laser/run", list_of(R"({"points_mm":[)", R"({"x":[]},)", daemon::kDrawingBody), 400);
  }
  std::string done() const override {
    return fmt::format("{} bodies of 48 MB and {} of 24 MiB were refused", refused_[0].load(), refused_[1].load());
  }
  Status applied() const override {
    if (refused_[0] > 0 && refused_[1] > 0) return Ok();
    return Error{ErrorCode::kUnavailable, "no JSON was taken in and refused: " + done()};
  }

 private:
  void send(const LaserOnlyCell& cell, const std::string& path, std::shared_ptr<const std::string> body, int status) {
    crowd_.add([this, path, body = std::move(body), status, address = cell.api().address()] {
      const auto reply = cli::ApiClient(address).raw("POST", path, *body, "application/json", {});
      if (reply && reply->status == status) ++refused_.at(status == 413 ? 0 : 1);
      if (!reply || reply->status >= 500) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    });
  }
  std::array<std::atomic<int>, 2> refused_{};
  Crowd crowd_;
};

// Clients that ask for the ledger and are gone before it comes, 48 at a time, some 270 a second.
class HangUps final : public StopLoad {
 public:
  explicit HangUps(int port) {
    crowd_.add([this, port] {
      const auto begun = std::chrono::steady_clock::now();
      std::vector<std::unique_ptr<Visitor>> visitors;
      for (int i = 0; i < 48; ++i) {
        visitors.push_back(std::make_unique<Visitor>(port));
        visitors.back()->ask("/panels/" + kBooked.value + "/ledger");
        asked_ += visitors.back()->ok() ? 1 : 0;
      }
      visitors.clear();
      std::this_thread::sleep_until(begun + std::chrono::milliseconds(178));
    });
  }
  std::string done() const override { return fmt::format("{} clients hung up", asked_.load()); }
  Status applied() const override {
    return asked_ > 0 ? Ok() : Status(Error{ErrorCode::kUnavailable, "no client came as far as asking"});
  }

 private:
  std::atomic<int> asked_{0};
  Crowd crowd_;
};

Status book_pieces(daemon::Repositories& r) {
  db::PanelRecord panel;
  panel.id = kBooked;
  panel.name = "booked";
  panel.width = panel.height = Millimetres(2000);
  panel.created_at = kBookedThen;
  if (Status added = r.panels.add(panel, {}, {}); !added) return added;
  constexpr int kColumns = 320;
  constexpr double kPitch = 6, kSide = 5;
  for (int first = 0; first < kBookedPieces; first += kPiecesPerJob) {
    db::NewPlan job;
    job.name = fmt::format("booked {}", first);
    job.plan_json = job.options_json = "{}";
    job.planned_on = {{kBooked, 1}};
    for (int i = first; i < first + kPiecesPerJob; ++i) {
      db::PlannedPatch& piece = job.pieces.emplace_back();
      piece.mark = fmt::format("A{}", i);
      const int column = i % kColumns, row = i / kColumns;
      const double x = 10 + kPitch * column, y = 10 + kPitch * row;
      for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {kSide, 0.0}, {kSide, kSide}, {0.0, kSide}}) {
        piece.artwork_outline.push_back(point<ArtworkFrame>(dx, dy));
        piece.panel_outline.push_back(point<PanelFrame>(x + dx, y + dy));
      }
      piece.panel = kBooked;
      piece.allocation = Region<PanelFrame>(piece.panel_outline);
    }
    if (auto created = r.jobs.create(job, kBookedThen); !created) return created.error();
  }
  return Ok();
}

}  // namespace

static fs::path empty_bed(const fs::path& data_dir) { return data_dir / "empty-bed.png"; }

Status prepare_stop_data(const fs::path& data_dir) {
  fs::create_directories(data_dir);
  asio::io_context reactor;
  auto database = daemon::DatabaseThread::open(data_dir / "veneerd.db", reactor);
  if (!database) return database.error();
  if (Status booked = (*database)->call(book_pieces); !booked) return booked;

  const daemon::PanelLibrary library(data_dir);
  const cv::Mat wood = random_wood(1800);
  const auto map = library.store_picture(wood, "panels/" + kFree.value, "map");
  const auto mask =
      library.store_picture(cv::Mat(wood.size(), CV_8UC1, cv::Scalar(255)), "panels/" + kFree.value, "mask");
  if (!map) return map.error();
  if (!mask) return mask.error();
  db::PanelRecord panel;
  panel.id = kFree;
  panel.name = "free";
  panel.width = panel.height = daemon::kMapResolution.to_mm(Pixels(wood.cols));
  panel.map_file = map->file, panel.mask_file = mask->file, panel.map_hash = map->sha256;
  panel.created_at = kBookedThen;
  // Only wood of which the back is known is planned.
  const db::FiducialRecord tag{
      db::FiducialKind::kTag, 200, Face::kBack, {{-30_mm, 0_mm}, {-22_mm, 0_mm}, {-22_mm, 8_mm}, {-30_mm, 8_mm}}};
  return (*database)->call([&](daemon::Repositories& r) { return r.panels.add(panel, {}, {tag}); });
}

EmptyBed::EmptyBed(const fs::path& data_dir) : file_(empty_bed(data_dir)), thread_([this] { take_pictures(); }) {}

EmptyBed::~EmptyBed() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_all();
  thread_.join();
}

void EmptyBed::take_pictures() {
  cv::RNG noise(1);
  cv::Mat picture(480, 640, CV_8UC1);
  const fs::path writing = file_.parent_path() / "next-bed.png";
  std::unique_lock lock(mutex_);
  do {
    noise.fill(picture, cv::RNG::NORMAL, 90, 3);
    cv::imwrite(writing.string(), picture);
    fs::rename(writing, file_);
  } while (!end_.wait_for(lock, std::chrono::milliseconds(200), [this] { return ending_; }));
}

std::string table_of_camera(const fs::path& data_dir) {
  return fmt::format("[camera]\nkind = \"file\"\ndevice = \"{}\"\n", empty_bed(data_dir).string());
}

Status certify_kerf(const fs::path& data_dir, const std::string& laser_port) {
  db::CertificateRecord kerf;
  kerf.kind = db::CertificateKind::kKerf;
  kerf.issued_at = kBookedThen;
  kerf.expires_at = "2999-01-01T00:00:00.000Z";
  calib::KerfMeasurement measured;
  measured.mean = Millimetres(0.1);
  nlohmann::json payload = daemon::to_payload(measured);
  payload["device"] = daemon::device_name(kerf.kind, {"twin at 300 dpi", "twin:camera", "grbl serial:" + laser_port});
  kerf.payload = payload.dump();
  asio::io_context reactor;
  auto database = daemon::DatabaseThread::open(data_dir / "veneerd.db", reactor);
  if (!database) return database.error();
  const auto issued = (*database)->call([&](daemon::Repositories& r) { return r.certificates.issue(kerf); });
  return issued ? Ok() : Status(issued.error());
}

std::vector<StopLoadKind> stop_loads() {
  using Begun = std::unique_ptr<StopLoad>;
  const auto nothing = [](const LaserOnlyCell&, const fs::path&, const fs::path&) -> Begun {
    return std::make_unique<Nothing>();
  };
  return {
      {"quiet", nothing},
      {"log", nothing, true},
      {"events",
       [](const LaserOnlyCell& cell, const fs::path&, const fs::path&) -> Begun {
         return std::make_unique<Listeners>(cell, cell.tcp_port());
       }},
      {"ledger",
       [](const LaserOnlyCell& cell, const fs::path&, const fs::path&) -> Begun {
         return std::make_unique<LedgerReaders>(cell);
       }},
      {"planning",
       [](const LaserOnlyCell& cell, const fs::path& bin_dir, const fs::path& dir) -> Begun {
         return std::make_unique<Planners>(cell, bin_dir, dir);
       }},
      {"events+planning",
       [](const LaserOnlyCell& cell, const fs::path& bin_dir, const fs::path& dir) -> Begun {
         return std::make_unique<ListenersAndPlanners>(cell, bin_dir, dir);
       }},
      {"upload",
       [](const LaserOnlyCell& cell, const fs::path&, const fs::path&) -> Begun {
         return std::make_unique<Uploads>(cell);
       }},
      {"json",
       [](const LaserOnlyCell& cell, const fs::path&, const fs::path&) -> Begun {
         return std::make_unique<JsonUploads>(cell);
       }},
      {"hang-up",
       [](const LaserOnlyCell& cell, const fs::path&, const fs::path&) -> Begun {
         return std::make_unique<HangUps>(cell.tcp_port());
       }},
  };
}

FullPipe::FullPipe(const fs::path& path) : descriptor_(-1) {
  if (::mkfifo(path.c_str(), 0600) != 0) return;
  descriptor_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  const std::string bytes(4096, 'x');
  while (::write(descriptor_, bytes.data(), bytes.size()) > 0) {
  }
}

FullPipe::~FullPipe() { ::close(descriptor_); }

bool FullPipe::is_full() const {
  const char byte = 'x';
  return descriptor_ >= 0 && ::write(descriptor_, &byte, 1) < 0 && errno == EAGAIN;
}

}  // namespace veneer::tests
