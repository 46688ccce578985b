#include "core/metrics/divergence.hpp"

#include "core/stop.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace consort {
namespace {

constexpr double kRise = 100.0;
constexpr double kRounding = 1e-12;  // relative to the numbers themselves; a sum of many rounds' roundings stays below
constexpr Round kFewest = 8;         // rounds below which a half says nothing

bool ideal_links(const Experiment& experiment, const ProtocolChoice& protocol) {
  bool ideal = true;
  experiment.links_of(protocol).for_each([&](const LinkSpec& link) { ideal = ideal && link.ideal(); });
  return ideal;
}

// Mode realtime: everything came, and in time.
bool kept_time(const Trace& trace) {
  return std::all_of(trace.network.begin(), trace.network.end(),
                     [](const NetworkTotals& link) { return link.counters.lost == 0 && link.counters.late == 0; }) &&
         std::all_of(trace.processes.begin(), trace.processes.end(),
                     [](const Performance& process) { return process.missed_inputs == 0 && process.missed_deadlines == 0; });
}

// Nothing happens to agents and edges from round `half` on.
bool quiet_from(const Experiment& experiment, Round half) {
  const auto later = [half](const auto& event) { return event.round >= half; };
  if (std::any_of(experiment.link_events.begin(), experiment.link_events.end(), later)) return false;
  const auto events = process_events(experiment);
  return std::none_of(events.begin(), events.end(), later);
}

// The reports of rounds after `after`, up to `last`, at least the latest of these: [first, end).
struct Window {
  std::size_t first = 0, end = 0;
};
Window window(const Trace& trace, Round after, Round last) {
  const auto place = [&](Round k) {
    return static_cast<std::size_t>(std::upper_bound(trace.rounds.begin(), trace.rounds.end(), k) - trace.rounds.begin());
  };
  Window out{place(after), place(last)};
  out.first = std::min(out.first, out.end - 1);
  return out;
}

struct Peak {
  std::size_t report = 0;
  double value = 0.0;
};
Peak largest(Window window, const std::function<double(std::size_t)>& of) {
  Peak peak{window.first, 0.0};
  for (std::size_t report = window.first; report < window.end; ++report)
    if (const double value = of(report); value > peak.value) peak = {report, value};
  return peak;
}

double largest_modulus(std::span<const double> numbers) {
  double largest = 0.0;
  for (const double number : numbers)
    if (!is_absent(number)) largest = std::max(largest, std::abs(number));
  return largest;
}

// The numbers that a rise is measured beside.
std::span<const double> numbers(const Trace& trace, std::size_t report) {
  return trace.truth == Truth::none ? trace.agreed_at(report) : trace.report(report).states;
}

// The same agents are there in both reports.
bool same_agents(const Trace& trace, std::size_t one, std::size_t other) {
  for (std::size_t i = 0; i < trace.agents; ++i)
    if (is_absent(numbers(trace, one)[i * numbers(trace, one).size() / trace.agents]) !=
        is_absent(numbers(trace, other)[i * numbers(trace, other).size() / trace.agents]))
      return false;
  return true;
}

// How much more those are at the end than in the middle who hear nobody, and whom the others follow. 1: no more, or there are none.
double growth_of_leaders(const Experiment& experiment, Seed run_seed, const Trace& trace, Window middle, Window end) {
  const auto graph = experiment.schedule(run_seed).at(trace.last_round - 1);
  const std::size_t width = trace.agreed_dimension();
  const auto of_leaders = [&](std::size_t report) {
    double peak = 0.0;
    for (std::size_t i = 0; i < trace.agents; ++i)
      if (graph->in_degree(agent_at(i)) == 0 && graph->out_degree(agent_at(i)) > 0)
        peak = std::max(peak, largest_modulus(trace.agreed_at(report).subspan(i * width, width)));
    return peak;
  };
  const double before = largest(middle, of_leaders).value, after = largest(end, of_leaders).value;
  return before > 0.0 ? std::max(1.0, after / before) : 1.0;
}

}  // namespace

std::optional<Divergence> divergence(const Experiment& experiment, Seed run_seed, const ProtocolChoice& protocol, const Trace& trace) {
  const Round last = trace.last_round, half = last / 2;
  if (last < kFewest || trace.rounds.empty() || trace.rounds.back() != last || trace.converged) return std::nullopt;
  const bool disturbed = experiment.plant && !experiment.plant->disturbances.empty();
  if (disturbed || !ideal_links(experiment, protocol) || !quiet_from(experiment, half) || !kept_time(trace)) return std::nullopt;
  const Window middle = window(trace, half / 2, half), end = window(trace, last - last / 8, last);
  const auto apart = [&](std::size_t report) { return deviation(trace, trace.report(report)); };
  const auto size = [&](std::size_t report) { return largest_modulus(numbers(trace, report)); };
  const Peak before = largest(middle, apart), after = largest(end, apart);
  if (trace.rounds[before.report] >= trace.rounds[after.report] || !same_agents(trace, before.report, after.report)) return std::nullopt;
  const double size_before = std::max(size(0), largest(middle, size).value), size_after = largest(end, size).value;
  double least = kRise * std::max(before.value, kRounding * size_before);
  if (std::isfinite(size_after)) least = std::max(least, kRounding * size_after);
  if (!(after.value > least)) return std::nullopt;
  if (trace.truth == Truth::none) least *= growth_of_leaders(experiment, run_seed, trace, middle, end);
  if (!(after.value > least)) return std::nullopt;
  return Divergence{trace.truth != Truth::none, trace.rounds[before.report], trace.rounds[after.report], before.value, after.value};
}

}  // namespace consort
