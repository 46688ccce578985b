#pragma once
/// What is worth a person's while, but ends no run: strangers, samples that were refused, builds that differ. Each is told once. Pure.

#include "idl/card.hpp"
#include "idl/refusal.hpp"

#include <set>
#include <string>
#include <utility>
#include <vector>

namespace consort {

class Remarks {
 public:
  /// Adds to what was refused; the first time that somebody's samples are, it is worth a remark.
  void refused(std::vector<Refusal> refusals);
  void add(std::string text) { new_.push_back(std::move(text)); }
  /// A process (`who`, on `host`) of that build has been let in. If it is made of other sources than this one, it may compute differently.
  void let_in(const wire::Build& build, const std::string& who, const std::string& host);
  /// Those since the last call.
  std::vector<std::string> take() { return std::exchange(new_, {}); }
  /// All samples refused so far; by writer, topic and reason.
  [[nodiscard]] const std::vector<Refusal>& refusals() const { return refusals_; }

 private:
  std::vector<std::string> new_;
  std::vector<Refusal> refusals_;
  std::set<std::pair<std::string, std::string>> other_sources_;  // commit and host
};

}  // namespace consort
