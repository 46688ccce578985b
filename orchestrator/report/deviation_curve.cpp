#include "core/stop.hpp"
#include "orchestrator/report/curves.hpp"
#include "orchestrator/report/page_run.hpp"

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

using Numbers = std::span<const double>;  // of one report: agents x columns

// The numbers of one kind, agent after agent.
class Picked {
 public:
  Picked(const RecordedRun& run, std::string_view kind) : width_(run.columns.size()), at_(run.of_kind(kind)) {}
  Numbers of(Numbers all) {
    values_.clear();
    for (std::size_t first = 0; first < all.size(); first += width_)
      for (const std::size_t at : at_) values_.push_back(all[first + at]);
    return values_;
  }

 private:
  std::size_t width_;
  std::vector<std::size_t> at_;
  std::vector<double> values_;
};

}  // namespace

Trace outline_of(const RecordedRun& run) {
  Trace trace;
  trace.agents = run.agents;
  trace.dimension = run.of_kind("estimate").size();
  trace.state_dimension = run.of_kind("plant").size();
  trace.truth = run.entry().truth;
  trace.agrees_on_states = trace.state_dimension > 0 && run.entry().agrees_on_states();
  return trace;
}

DeviationCurve deviation_curve(const RecordedRun& run, Seconds dt, std::size_t most) {
  const Trace outline = outline_of(run);
  Picked estimates(run, "estimate"), states(run, "plant");
  // Distances between all pairs, where an agent agrees on more than one number.
  const double n = static_cast<double>(run.agents);
  const double work = outline.truth == Truth::none && outline.agreed_dimension() > 1 ? n * n : n;
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::ceil(work * static_cast<double>(run.reports) / 2e8)));
  Decimation decimation(1, (run.reports - 1) / stride + 1 + ((run.reports - 1) % stride == 0 ? 0 : 1), most);
  std::size_t report = 0;
  run.for_each([&](Round k, Numbers all) {
    if (report % stride == 0 || report + 1 == run.reports) {
      const RoundReport now{k, estimates.of(all), {}, {}, states.of(all)};
      const double value = deviation(outline, now);
      decimation.add(k * dt, std::span(&value, 1));
    }
    ++report;
  });
  Curves curves = decimation.finish();
  return {std::move(curves.x), std::move(curves.y[0])};
}

}  // namespace consort
