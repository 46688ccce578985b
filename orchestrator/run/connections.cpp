#include "orchestrator/run/connections.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/lending.hpp"
#include "orchestrator/run/line_channel.hpp"
#include "orchestrator/run/run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <utility>

namespace consort {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLastMoment{3000};  // what is left at the far end ends in this time
constexpr std::chrono::milliseconds kLongWork{30'000};  // ssh has got through to it by then, and a host has been examined

std::string text_of(const ordered_json& word) { return word.dump(-1, ' ', false, json::error_handler_t::replace); }

// Its exit code, or 128 and the signal; killed if it does not end by itself.
int end_of(pid_t pid, std::chrono::milliseconds patience) {
  const auto end = Clock::now() + patience;
  int status = 0;
  while (::waitpid(pid, &status, WNOHANG) == 0) {
    if (Clock::now() > end) ::kill(pid, SIGKILL);
    ::poll(nullptr, 0, 2);
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

Connection::Connection(std::string name, const std::vector<std::string>& command, std::filesystem::path log_directory)
    : name_(std::move(name)), command_(command), log_directory_(std::move(log_directory)) {
  std::array<int, 2> to{}, from{};
  if (::pipe2(to.data(), O_CLOEXEC) != 0 || ::pipe2(from.data(), O_CLOEXEC) != 0 || (wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) < 0)
    throw RunError("host " + name_ + ": no more files can be opened; `consort doctor` checks the limits");
  if (log_directory_.empty()) memory_ = ::memfd_create("errors", MFD_CLOEXEC);
  errors_ = log_directory_.empty() ? fmt::format("/proc/self/fd/{}", memory_) : (log_directory_ / ("host-" + name_ + ".log")).string();
  channel_ = std::make_unique<LineChannel>(from[0], to[1]);
  try {
    pid_ = spawn(command_, {{kRunKeyVariable, ""}}, {to[0], from[1], errors_}, 0);
  } catch (...) {
    ::close(to[0]);
    ::close(from[1]);
    close_files();
    throw;
  }
  ::close(to[0]);
  ::close(from[1]);
  thread_ = std::thread([this] { run(); });
}

void Connection::leave() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ::eventfd_write(wake_, 1);
}

Connection::~Connection() {
  leave();
  thread_.join();
  close_files();
}

void Connection::close_files() const {
  ::close(wake_);
  if (memory_ >= 0) ::close(memory_);
}

// Until the far end closes, which it does when this one has.
void Connection::run() {
  auto heard = Clock::now(), pinged = heard;
  std::optional<Clock::time_point> left;
  std::string why;
  while (channel_->open() && why.empty()) {
    std::vector<pollfd> descriptors{{wake_, POLLIN, 0}};
    channel_->wait_for(descriptors);
    ::poll(descriptors.data(), descriptors.size(), static_cast<int>(kPingEvery.count() / 4));
    eventfd_t ignored = 0;
    ::eventfd_read(wake_, &ignored);
    const auto now = Clock::now();
    std::vector<std::string> lines;
    {
      const std::lock_guard lock(mutex_);
      lines.swap(to_say_);
      if (ending_ && !left) left = now;
    }
    for (const std::string& line : lines) channel_->send(line);
    if (now - pinged > kPingEvery) {
      pinged = now;
      channel_->send(text_of({{"ping", 0}}));
    }
    channel_->flush();
    if (left) channel_->close_out();
    for (const std::string& line : channel_->take()) {
      heard = now;
      hear(line);
    }
    const std::lock_guard lock(mutex_);
    if (left && now - *left > kLastMoment) break;
    const auto patience = lent_ && awaited_.empty() ? kChannelSilence : kLongWork;
    if (!left && now - heard > patience) why = fmt::format("it has been silent for {:g} s", 1e-3 * static_cast<double>(patience.count()));
  }
  channel_->close_out();
  const bool hangs = channel_->open();
  const int code = end_of(pid_, std::chrono::milliseconds(hangs ? 0 : 500));
  const std::string tail = tail_of(errors_);
  if (why.empty()) why = fmt::format("{} ended with code {}", command_.front(), code);
  conclude(fmt::format("the connection to {} has closed: {}{}{}", name_, why, remedy(code), tail.empty() ? "" : ";\n" + tail));
}

std::string Connection::remedy(int code) const {
  const std::lock_guard lock(mutex_);
  if (lent_) return {};
  if (code == 127) return "; is `consort` installed there, and on the path of a shell that is no terminal's? Else name it: `consort: PATH`";
  if (command_.front() == "ssh" && code == 255)
    return fmt::format("; try `ssh -oBatchMode=yes {} true`, which has to work without a question", command_[command_.size() - 2]);
  return {};
}

// Everybody there is gone with it.
void Connection::conclude(const std::string& why) {
  const std::lock_guard lock(mutex_);
  closed_ = why;
  for (const auto& [name, pid] : alive_) deaths_.push_back({.name = name, .pid = pid, .host = name_, .how = why});
  alive_.clear();
  changed_.notify_all();
}

void Connection::hear(const std::string& line) {
  const json word = json::parse(line, nullptr, false);
  if (!word.is_object()) return;  // a login shell may have said something, too
  try {
    if (word.contains("log")) return keep_log(word.at("log").get<std::string>(), word.at("text").get<std::string>());
    const std::lock_guard lock(mutex_);
    if (word.contains("lends")) {
      lent_ = {word.at("lends").get<std::string>(), word.at("host").get<std::string>(), word.at("arithmetic").get<std::string>()};
    } else if (!awaited_.empty() && word.contains(awaited_)) {
      answer_ = line;
    } else if (word.contains("started")) {
      const auto name = word.at("started").get<std::string>();
      alive_[name] = started_[name] = word.at("pid").get<pid_t>();
    } else if (word.contains("failed") || word.contains("died")) {
      const bool failed = word.contains("failed");
      Death death{.name = word.at(failed ? "failed" : "died").get<std::string>(), .host = name_};
      started_.erase(death.name);
      alive_.erase(death.name);
      if (failed) {
        death.how = "could not be started: " + word.at("why").get<std::string>();
      } else {
        death.pid = word.at("pid").get<pid_t>();
        death.signal = word.at("signal").get<int>();
        death.exit_code = word.at("code").get<int>();
        death.log_tail = tail_of(log_directory_ / (death.name + ".log"));
      }
      deaths_.push_back(std::move(death));
    }
  } catch (const json::exception&) {  // of another build, as its first word says
  }
  changed_.notify_all();
}

void Connection::keep_log(const std::string& name, const std::string& text) const {
  {
    const std::lock_guard lock(mutex_);
    if (!alive_.contains(name)) return;  // no file but those of processes that were started
  }
  std::ofstream(log_directory_ / (name + ".log"), std::ios::app) << text;
}

void Connection::say(const std::string& line) {
  {
    const std::lock_guard lock(mutex_);
    to_say_.push_back(line);
  }
  ::eventfd_write(wake_, 1);
}

const Lent& Connection::lent(const std::atomic<int>* interrupt) {
  std::unique_lock lock(mutex_);
  constexpr std::chrono::milliseconds kLookAround{50};
  while (!changed_.wait_for(lock, kLookAround, [this] { return lent_ || closed_; }))
    if (interrupt != nullptr && *interrupt != 0) throw RunError("interrupted before " + name_ + " answered");
  if (closed_) throw RunError(*closed_);
  return *lent_;
}

std::string Connection::use(const std::string& address, const std::vector<std::uint16_t>& ports) {
  const json answer = json::parse(ask(text_of({{"use", address}, {"ports", ports}}), "used"));
  if (const auto why = answer.value("why", std::string()); !why.empty()) throw RunError("host " + name_ + ": " + why);
  return answer.value("used", address);
}

std::string Connection::ask(const std::string& order, const std::string& answer) {
  {
    const std::lock_guard lock(mutex_);
    awaited_ = answer;
    answer_.reset();
  }
  say(order);
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return answer_ || closed_; });
  if (!answer_) throw RunError(*closed_);
  awaited_.clear();
  return *std::exchange(answer_, {});
}

void Connection::start(const std::string& name, const std::string& program, const std::vector<std::string>& arguments,
                       const std::string& key) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) {
      deaths_.push_back({.name = name, .host = name_, .how = "could not be started: " + *closed_});
      return;
    }
    alive_[name] = started_[name] = 0;
  }
  say(text_of({{"start", name}, {"program", program}, {"arguments", arguments}, {"key", key}}));
}

void Connection::signal(const std::string& name, int number) { say(text_of({{"signal", name}, {"number", number}})); }

std::optional<Death> Connection::next_death() {
  const std::lock_guard lock(mutex_);
  if (deaths_.empty()) return std::nullopt;
  Death death = std::move(deaths_.front());
  deaths_.pop_front();
  return death;
}

std::map<std::string, pid_t> Connection::take_started() {
  std::unique_lock lock(mutex_);
  changed_.wait(
      lock, [this] { return closed_ || std::all_of(started_.begin(), started_.end(), [](const auto& each) { return each.second != 0; }); });
  return std::exchange(started_, {});
}

std::size_t Connection::alive() const {
  const std::lock_guard lock(mutex_);
  return alive_.size();
}

}  // namespace consort
