#pragma once
/// The far end of a run's connection to another host, `consort lend`: starts processes there, passes on what they write and how they end,
/// and ends them with the connection. A line is an object of JSON with one word that says what it is:
///
///     <- {"lends": build, "host": ..., "pid": ..., "arithmetic": ...}          first of all
///     -> {"use": address, "ports": [...]}     <- {"used": address, "why": ""}     or why it cannot be
///     -> {"start": name, "program": ..., "arguments": [...], "key": ...}     <- {"started": name, "pid": ...} or {"failed": name, "why":
///     ...}
///     -> {"signal": name, "number": ...}
///     <- {"log": name, "text": ...}     <- {"died": name, "pid": ..., "signal": ..., "code": ...}
///     -> {"ping": 0}     <- {"pong": 0}
///     -> {"clock": 0}     <- {"time": seconds since 1970}
///     -> {"examine": interface}     <- {"examined": [{"name": ..., "well": ..., "found": ..., "remedy": ...}]}

#include "orchestrator/run/launch.hpp"
#include "orchestrator/run/line_channel.hpp"

#include <nlohmann/json_fwd.hpp>

#include <chrono>
#include <functional>
#include <map>
#include <string>

namespace consort {

/// An end that has not been heard for so long is gone; it is asked for a word so often.
inline constexpr std::chrono::milliseconds kChannelSilence{5000}, kPingEvery{1000};

/// On what, beside the build, it rests that two hosts compute the same numbers, bit for bit.
std::string arithmetic_of_this_host();

class Lending {
 public:
  /// What somebody finds who looks whether this host can take part in a run over an interface.
  using Examine = std::function<nlohmann::ordered_json(const std::string& interface)>;
  /// `programs`: where consort-agent and consort-plant lie. `in`, `out`: closed at its end.
  Lending(std::filesystem::path programs, int in, int out, Examine examine);
  ~Lending();
  Lending(const Lending&) = delete;
  Lending& operator=(const Lending&) = delete;
  /// Until the other end closes, or is silent; then nothing that was started here is left. Empty, or why it ended otherwise.
  std::string serve();

 private:
  void wait();
  void obey(const std::string& line);
  void use(const nlohmann::json& order);
  void start(const nlohmann::json& order);
  void tell(const nlohmann::ordered_json& word);
  void pass_on(const std::string& name);
  void tell_deaths();

  std::filesystem::path programs_;
  Examine examine_;
  LineChannel channel_;
  std::map<std::string, int> outputs_;  // of processes, by name: where they write
  Children children_;
  std::chrono::steady_clock::time_point heard_;
};

}  // namespace consort
