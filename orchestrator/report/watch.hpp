#pragma once
/// The page of a run while it goes on, for browsers on this host. It reads the record like anybody else; the run does not know of it.

#include <filesystem>
#include <memory>
#include <string>

namespace consort {

class Watch {
 public:
  /// Serves the page of `folder` on 127.0.0.1 until destroyed. `port` 0: any that is free. Throws ConfigError if the port is not free.
  Watch(const std::filesystem::path& folder, int port);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  /// For a browser.
  [[nodiscard]] std::string address() const;

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace consort
