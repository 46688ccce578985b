#include "orchestrator/report/watch.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/page.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

namespace consort {
namespace {

using namespace std::chrono_literals;

constexpr int kMostViewers = 8;
constexpr int kThreads = 32;        // a viewer keeps one; who connects and says nothing keeps one for a second
constexpr auto kLookEvery = 500ms;  // at the record
constexpr auto kLastLook = 3s;
constexpr auto kSignOfLife = 10s;          // on a stream that has nothing to say
constexpr double kShareOfTime = 1.0 / 40;  // drawing takes no more than this

}  // namespace

class Watch::Server {
 public:
  Server(std::filesystem::path folder, int port) : folder_(std::move(folder)) {
    server_.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    server_.set_keep_alive_timeout(1);
    server_.set_read_timeout(2, 0);
    server_.set_write_timeout(5, 0);
    server_.set_payload_max_length(0);
    server_.set_socket_options([](int) {});  // no SO_REUSEPORT: two runs must not share a port
    port_ = port == 0 ? server_.bind_to_any_port("127.0.0.1") : (server_.bind_to_port("127.0.0.1", port) ? port : -1);
    if (port_ <= 0)
      throw ConfigError(fmt::format("--watch: port {} of 127.0.0.1 is not free; allowed: another one, or none: a free one", port));
    route();
    looking_ = std::thread([this] { look(); });
    serving_ = std::thread([this] { server_.listen_after_bind(); });
  }
  ~Server() {
    {
      std::unique_lock lock(mutex_);
      ++version_;
      changed_.notify_all();
      // Whoever looks sees the end.
      if (viewers_ > 0) changed_.wait_for(lock, kLastLook, [&] { return given_ == version_; });
      ends_ = true;
    }
    changed_.notify_all();
    while (!server_.is_running()) std::this_thread::yield();  // else stop() would come before it listens
    server_.stop();
    serving_.join();
    looking_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  [[nodiscard]] int port() const { return port_; }

 private:
  void route() {
    // A page elsewhere may send a browser here under another name; only GET is answered, under our own.
    server_.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      const std::string host = request.get_header_value("Host");
      const std::array known{fmt::format("127.0.0.1:{}", port_), fmt::format("localhost:{}", port_)};
      response.set_header("Cache-Control", "no-store");
      response.set_header("X-Content-Type-Options", "nosniff");
      const bool foreign = std::find(known.begin(), known.end(), host) == known.end();
      if (!foreign && request.method == "GET") return httplib::Server::HandlerResponse::Unhandled;
      response.status = foreign ? 403 : 405;
      response.set_content(foreign ? "served to this host only\n" : "only GET\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    });
    server_.Get(
        "/", [this](const httplib::Request&, httplib::Response& response) { response.set_content(page_of({folder_}, true), "text/html"); });
    server_.Get("/data.json",
                [this](const httplib::Request&, httplib::Response& response) { response.set_content(*data(), "application/json"); });
    server_.Get("/events", [this](const httplib::Request&, httplib::Response& response) { stream(response); });
    server_.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      response.status = 503;
      response.set_content("the record cannot be read just now\n", "text/plain");
    });
  }

  // Says whenever the record has grown.
  void stream(httplib::Response& response) {
    if (++viewers_ > kMostViewers) {
      --viewers_;
      response.status = 503;
      response.set_content(fmt::format("{} viewers look already\n", kMostViewers), "text/plain");
      return;
    }
    auto seen = std::make_shared<std::uint64_t>(0);
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, seen](std::size_t, httplib::DataSink& sink) {
          std::unique_lock lock(mutex_);
          changed_.wait_for(lock, kSignOfLife, [&] { return ends_ || version_ != *seen; });
          if (ends_) return false;
          const std::string text = version_ == *seen ? ": still here\n\n" : fmt::format("id: {0}\ndata: {0}\n\n", version_);
          *seen = version_;
          lock.unlock();
          return sink.write(text.data(), text.size());
        },
        [this](bool) { --viewers_; });
  }

  // What the page shows, drawn once however many ask.
  std::shared_ptr<const std::string> data() {
    const std::lock_guard drawing(drawing_);
    std::uint64_t now = 0;
    {
      const std::lock_guard lock(mutex_);
      now = version_;
    }
    if (data_ && drawn_ == now) return data_;
    const auto began = std::chrono::steady_clock::now();
    data_ = std::make_shared<const std::string>(
        nlohmann::ordered_json::array({page_data(folder_)}).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
    drawn_ = now;
    const std::lock_guard lock(mutex_);
    given_ = now;
    changed_.notify_all();
    rest_ = std::chrono::duration_cast<std::chrono::milliseconds>((std::chrono::steady_clock::now() - began) / kShareOfTime);
    return data_;
  }

  void look() {
    std::optional<Database> record;
    std::int64_t known = -1;
    auto told = std::chrono::steady_clock::time_point{};
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, kLookEvery, [&] { return ends_; })) {
      const bool rested = std::chrono::steady_clock::now() - told >= rest_;
      lock.unlock();
      std::int64_t version = known;
      try {
        if (!record && std::filesystem::exists(folder_ / "record.sqlite")) record.emplace(folder_ / "record.sqlite", Database::Open::read);
        if (record) {
          Statement changes = record->prepare("PRAGMA data_version");  // another connection has committed
          if (changes.step()) version = changes.integer(0);
        }
      } catch (const std::runtime_error&) {  // busy, or just being made: next time
      }
      lock.lock();
      if (version == known || !rested) continue;
      known = version;
      told = std::chrono::steady_clock::now();
      ++version_;
      changed_.notify_all();
    }
  }

  std::filesystem::path folder_;
  httplib::Server server_;
  int port_ = 0;
  std::atomic<int> viewers_{0};
  std::mutex drawing_;  // guards data_ and drawn_
  std::shared_ptr<const std::string> data_;
  std::uint64_t drawn_ = 0;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::uint64_t version_ = 1, given_ = 0;
  std::chrono::milliseconds rest_{0};
  bool ends_ = false;
  std::thread looking_, serving_;
};

Watch::Watch(const std::filesystem::path& folder, int port) : server_(std::make_unique<Server>(folder, port)) {}
Watch::~Watch() = default;
std::string Watch::address() const { return fmt::format("http://127.0.0.1:{}/", server_->port()); }

}  // namespace consort
