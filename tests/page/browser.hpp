#pragma once
/// A real browser: Chromium behind its WebDriver (https://www.w3.org/TR/webdriver2/), which a test speaks to over loopback.

#include "tests/support/program.hpp"

#include <httplib.h>
#include <nlohmann/json.hpp>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace consort {

class Browser {
 public:
  using Json = nlohmann::json;

  /// `dark`: it prefers dark pages.
  explicit Browser(const Folder& folder, bool dark = false) : driver_(folder, "/usr/bin/chromedriver", {"--port=0"}) {
    const std::string before = "started successfully on port ";
    int port = 0;
    const bool begun = eventually([&] {
      const std::string out = driver_.out();
      const std::size_t at = out.find(before);
      if (at != std::string::npos && out.find('.', at + before.size()) != std::string::npos)
        port = std::stoi(out.substr(at + before.size()));
      return port != 0 || driver_.over();
    });
    if (!begun || port == 0) throw std::runtime_error("chromedriver does not start: " + driver_.out() + driver_.err());
    http_.emplace("127.0.0.1", port);
    http_->set_read_timeout(180);
    Json arguments{"--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                   "--user-data-dir=" + (folder.path() / "profile").string()};
    if (dark) arguments.push_back("--blink-settings=preferredColorScheme=0");
    const Json wanted{{"browserName", "chrome"},
                      {"goog:chromeOptions", {{"binary", "/usr/bin/chromium"}, {"args", arguments}}},
                      {"goog:loggingPrefs", {{"browser", "ALL"}}}};
    session_ = post("/session", {{"capabilities", {{"alwaysMatch", wanted}}}}).at("sessionId").get<std::string>();
  }
  ~Browser() {
    if (http_ && !session_.empty()) http_->Delete("/session/" + session_);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& address) { command("url", {{"url", address}}); }
  void resize(int width, int height) { command("window/rect", {{"width", width}, {"height", height}}); }
  /// What `script`, the body of a function, returns.
  Json run(const std::string& script) { return command("execute/sync", {{"script", script}, {"args", Json::array()}}); }
  /// As PNG in base64.
  std::string screenshot() { return get("screenshot").get<std::string>(); }
  /// What the page has said on its console since the last call.
  std::vector<std::string> console() {
    std::vector<std::string> lines;
    for (const Json& entry : command("se/log", {{"type", "browser"}}))
      lines.push_back(entry.at("level").get<std::string>() + ": " + entry.at("message").get<std::string>());
    return lines;
  }

 private:
  static Json value_of(const httplib::Result& answer, const std::string& what) {
    if (!answer) throw std::runtime_error("no answer to " + what);
    const Json json = Json::parse(answer->body);
    if (answer->status != 200) throw std::runtime_error(what + ": " + json.at("value").dump());
    return json.at("value");
  }
  Json post(const std::string& path, const Json& body) { return value_of(http_->Post(path, body.dump(), "application/json"), path); }
  Json command(const std::string& name, const Json& body) { return post("/session/" + session_ + "/" + name, body); }
  Json get(const std::string& name) { return value_of(http_->Get("/session/" + session_ + "/" + name), name); }

  Program driver_;
  std::optional<httplib::Client> http_;
  std::string session_;
};

}  // namespace consort
