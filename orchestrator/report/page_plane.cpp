#include "orchestrator/report/page_plane.hpp"

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostFrames = 120, kMostInPlane = 100, kMostEstimatesInPlane = 12;

}  // namespace

PagePlane::PagePlane(const RecordedRun& run, Truth truth) : run_(run), truth_(truth) {
  if (run_.agents > kMostInPlane) return;
  const auto plant = run_.of_kind("plant"), estimate = run_.of_kind("estimate");
  std::vector<std::size_t> places;  // among the plant's numbers
  for (std::size_t c = 0; c < plant.size(); ++c)
    if (run_.columns[plant[c]].field == "position") places.push_back(c);
  if (places.size() == 2) {
    position_ = {plant[places[0]], plant[places[1]]};
    if (truth_ == Truth::state) estimates_.emplace_back(estimate[places[0]], estimate[places[1]]);
    if (truth_ == Truth::everybody && run_.agents <= kMostEstimatesInPlane)
      for (std::size_t j = 0; j < run_.agents; ++j)
        estimates_.emplace_back(estimate[j * plant.size() + places[0]], estimate[j * plant.size() + places[1]]);
  } else if (plant.empty()) {
    std::vector<std::size_t> x;
    for (const std::size_t c : estimate)
      if (run_.columns[c].field == "x") x.push_back(c);
    if (x.size() == 2) position_ = x;
  }
}

Json PagePlane::point(std::span<const double> all, std::size_t agent, std::size_t x, std::size_t y) const {
  const std::size_t first = agent * run_.columns.size();
  const double a = all[first + x], b = all[first + y];
  return std::isfinite(a) && std::isfinite(b) ? Json{a, b} : Json();
}

void PagePlane::add(double time, std::span<const double> all) {
  const std::size_t report = report_++;
  if (position_.empty()) return;
  const std::size_t stride = std::max<std::size_t>(1, (run_.reports + kMostFrames - 1) / kMostFrames);
  if (report % stride != 0 && report + 1 != run_.reports) return;
  Json truth = Json::array(), seen = Json::array();
  for (std::size_t i = 0; i < run_.agents; ++i) {
    truth.push_back(point(all, i, position_[0], position_[1]));
    if (estimates_.empty()) continue;
    Json of_one = Json::array();
    for (const auto& [x, y] : estimates_) of_one.push_back(point(all, i, x, y));
    seen.push_back(std::move(of_one));
  }
  Json frame{{"time", time}, {"truth", std::move(truth)}};
  if (!estimates_.empty()) frame["seen"] = std::move(seen);
  frames_.push_back(std::move(frame));
}

Json PagePlane::finish() {
  if (frames_.empty()) return {};
  return {{"truth", !run_.of_kind("plant").empty()}, {"everybody", truth_ == Truth::everybody}, {"frames", std::move(frames_)}};
}

}  // namespace consort
