#pragma once
/// UDP ports, DDS domains and names of runs on this host: who has which.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace consort {

/// Nobody on this host has that UDP port.
bool port_is_free(std::uint16_t port);

/// A block of UDP ports nobody else uses, reserved as long as the object lives (advisory lock files keep concurrent runs apart).
class PortBlock {
 public:
  /// Throws RunError saying how many ports were wanted and where it looked.
  explicit PortBlock(std::size_t ports);
  /// These. Throws ConfigError that begins "--ports: " where one of them is taken.
  PortBlock(std::size_t ports, std::uint16_t first);
  ~PortBlock();
  PortBlock(const PortBlock&) = delete;
  PortBlock& operator=(const PortBlock&) = delete;
  [[nodiscard]] std::uint16_t first() const { return first_; }

 private:
  bool reserve(std::size_t unit, std::size_t units, std::size_t ports);
  void release();
  std::vector<int> locks_;
  std::uint16_t first_ = 0;
};

/// Says who else on this host uses the well-known ports of a DDS domain, by lock files beside those of the port blocks.
class DomainShare {
 public:
  DomainShare() = default;
  ~DomainShare();
  DomainShare(const DomainShare&) = delete;
  DomainShare& operator=(const DomainShare&) = delete;
  /// From now on, until it ends, this one does. Where no lock can be had, nobody is known to.
  void enter(unsigned domain);
  /// Does anybody else now?
  [[nodiscard]] bool with_others() const;

 private:
  int lock_ = -1;
};

/// What tells runs of one name, key and domain apart on a host: there is one of them at a time. Their processes would take part in both.
class SoleRun {
 public:
  /// Throws ConfigError that names the other one's pid.
  SoleRun(const std::string& name, const std::string& key, unsigned domain);
  ~SoleRun();
  SoleRun(const SoleRun&) = delete;
  SoleRun& operator=(const SoleRun&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace consort
