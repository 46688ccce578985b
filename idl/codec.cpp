#include "idl/codec.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace consort::wire {
namespace {

// Bounds beyond those of the IDL's own types; consort.idl states them.
constexpr std::uint32_t kMaxAgents = 100'000;
constexpr std::uint32_t kMaxRows = 4096;
constexpr std::uint32_t kMaxValues = 1'000'000;
constexpr std::uint32_t kMaxParts = 10'000;
constexpr std::uint32_t kMaxGraphs = 4096;

void require(bool condition, const char* field) {
  if (!condition) throw Rejected(field);
}

// --- what core and wire have under one name, out and in ----------------------------------------------------------------

void copy_job(auto& to, const auto& from) {
  to.part = from.part;
  to.parts = from.parts;
  to.epoch = from.epoch;
  to.rounds = from.rounds;
  to.report_interval = from.report_interval;
  to.ahead = from.ahead;
  to.realtime = from.realtime;
}

void copy_numbers_of_assignment(auto& to, const auto& from) {
  copy_job(to, from);
  to.agents = from.agents;
  to.dt = from.dt;
  to.window = from.window;
  to.largest_state = from.largest_state;
  to.largest_control = from.largest_control;
  to.relays = from.relays;
  to.steers = from.steers;
  to.plant = from.plant;
  to.tells_links = from.tells_links;
}

void copy_numbers_of_member(auto& to, const auto& from) {
  to.hears_everyone = from.hears_everyone;
  to.remote_readers = from.remote_readers;
  to.measurements = from.measurements;
  to.distances = from.distances;
}

void copy_numbers_of_signal(auto& to, const auto& from) {
  to.number = from.number;
  to.hold_rounds = from.hold_rounds;
  to.first = from.first;
  to.frequency = from.frequency;
}

void copy_state(auto& to, const auto& from) {
  to.process = from.process;
  to.epoch = from.epoch;
  to.round = from.round;
}

// --- writing ----------------------------------------------------------------------------------------------------------

template <class Wire>
Wire* allocate(Arena& arena, std::size_t count) {
  void* memory = arena.allocate(count * sizeof(Wire) + 1, alignof(std::max_align_t));
  std::memset(memory, 0, count * sizeof(Wire));
  return static_cast<Wire*>(memory);
}

// A generated sequence over memory that somebody else owns (DDS only reads it while writing).
template <class Sequence, class Element>
Sequence borrow(const Element* data, auto count) {
  Sequence sequence{};
  sequence._buffer = const_cast<decltype(sequence._buffer)>(data);
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(count);
  sequence._release = false;
  return sequence;
}

// A generated sequence in the arena, element by element.
template <class Sequence, class Range, class Convert>
Sequence convert_all(const Range& range, Arena& arena, Convert convert) {
  using Wire = std::remove_pointer_t<decltype(Sequence::_buffer)>;
  auto* buffer = allocate<Wire>(arena, range.size());
  std::size_t at = 0;
  for (const auto& element : range) buffer[at++] = convert(element);
  return borrow<Sequence>(buffer, range.size());
}

template <class Sequence>
Sequence ids(const std::vector<AgentId>& agents, Arena& arena) {
  return convert_all<Sequence>(agents, arena, [](AgentId agent) { return agent.value; });
}

template <std::size_t Size>
void put(char (&field)[Size], std::string_view text, const char* what) {
  if (text.size() >= Size)
    throw ConfigError(std::string(what) + " '" + std::string(text) + "' is longer than " + std::to_string(Size - 1) + " characters");
  std::memcpy(field, text.data(), text.size());
  field[text.size()] = '\0';
}

// Free text may be cut; names may not.
template <std::size_t Size>
void put_cut(char (&field)[Size], std::string_view text) {
  put(field, text.substr(0, Size - 1), "text");
}

consort_wire_NamedArray named_array(const Values::Entry& entry) {
  consort_wire_NamedArray out{};
  put(out.name, entry.name, "the name");
  out.rows = static_cast<std::uint32_t>(entry.value.rows());
  out.columns = static_cast<std::uint32_t>(entry.value.cols());
  out.values = borrow<decltype(out.values)>(entry.value.data(), entry.value.size());
  return out;
}

consort_wire_LinkRule link_rule(std::uint32_t from, Round since, const LinkSpec& spec, Arena& arena) {
  consort_wire_LinkRule out{};
  out.from = from;
  out.since = since;
  const Values effects = values_of(spec);  // is gone before the sample is written
  out.effects = convert_all<decltype(out.effects)>(effects.entries(), arena, [&arena](const Values::Entry& effect) {
    consort_wire_NamedArray numbers = named_array(effect);
    const auto count = static_cast<std::size_t>(effect.value.size());
    auto* kept = allocate<double>(arena, count);
    std::copy_n(effect.value.data(), count, kept);
    numbers.values = borrow<decltype(numbers.values)>(kept, count);
    return numbers;
  });
  return out;
}

consort_wire_MemberAssignment member_assignment(const MemberTask& member, Arena& arena) {
  consort_wire_MemberAssignment out{};
  copy_numbers_of_member(out, member);
  out.agent = member.agent.value;
  out.process = member.process;
  out.initial = convert_all<decltype(out.initial)>(member.initial.entries(), arena, named_array);
  out.parameters = convert_all<decltype(out.parameters)>(member.parameters.entries(), arena, named_array);
  out.in_neighbours = ids<decltype(out.in_neighbours)>(member.in_neighbours, arena);
  out.links = convert_all<decltype(out.links)>(member.link_changes, arena, [&arena](const LinkModel::Change& change) {
    return link_rule(change.edge->from.value, change.since, change.spec, arena);
  });
  out.model = convert_all<decltype(out.model)>(member.model.entries(), arena, named_array);
  out.told = convert_all<decltype(out.told)>(member.told, arena, [](const Told& told) {
    return consort_wire_Announced{told.from.value, told.since};
  });
  out.first_round = member.presence.from;
  out.end_round = member.presence.until;
  out.late_readers = borrow<decltype(out.late_readers)>(member.late_readers.data(), member.late_readers.size());
  return out;
}

consort_wire_Signal signal(const Signal& in) {
  consort_wire_Signal out{};
  out.where = static_cast<std::uint8_t>(in.on);
  out.kind = static_cast<std::uint8_t>(in.kind);
  copy_numbers_of_signal(out, in);
  out.rows = static_cast<std::uint32_t>(in.amplitude.rows());
  out.columns = static_cast<std::uint32_t>(in.amplitude.cols());
  out.amplitude = borrow<decltype(out.amplitude)>(in.amplitude.data(), in.amplitude.size());
  out.phase_rows = static_cast<std::uint32_t>(in.phase.rows());
  out.phase_columns = static_cast<std::uint32_t>(in.phase.cols());
  out.phase = borrow<decltype(out.phase)>(in.phase.data(), in.phase.size());
  return out;
}

consort_wire_PlantPart plant_part(AgentId agent, std::uint32_t process, const PlantPart& in, Arena& arena) {
  consort_wire_PlantPart out{};
  out.agent = agent.value;
  out.process = process;
  out.parameters = convert_all<decltype(out.parameters)>(in.parameters.entries(), arena, named_array);
  out.initial = convert_all<decltype(out.initial)>(in.initial.entries(), arena, named_array);
  out.sensed = ids<decltype(out.sensed)>(in.sensed, arena);
  out.distances = ids<decltype(out.distances)>(in.distances, arena);
  out.relative = in.relative;
  out.absolute = in.absolute;
  out.stays = convert_all<decltype(out.stays)>(in.presence.stays(), arena, [](const Attendance& stay) {
    return consort_wire_Stay{stay.from, stay.until};
  });
  out.signals = convert_all<decltype(out.signals)>(in.signals, arena, signal);
  return out;
}

consort_wire_Segment segment(const GrantedSegment& in, Arena& arena) {
  consort_wire_Segment out{};
  out.first = in.first;
  out.graph = in.graph;
  out.stated = in.stated.has_value();
  if (!in.stated) return out;
  auto* edges = allocate<std::uint32_t>(arena, 2 * in.stated->size());
  auto* weights = allocate<double>(arena, in.stated->size());
  bool plain = true;
  for (std::size_t e = 0; e < in.stated->size(); ++e) {
    const auto& [edge, weight] = (*in.stated)[e];
    edges[2 * e] = edge.from.value;
    edges[2 * e + 1] = edge.to.value;
    weights[e] = weight;
    plain = plain && weight == 1.0;
  }
  out.edges = borrow<decltype(out.edges)>(edges, 2 * in.stated->size());
  out.weights = borrow<decltype(out.weights)>(weights, plain ? 0 : in.stated->size());
  return out;
}

consort_wire_FieldShape field_shape(const Field& field) {
  consort_wire_FieldShape out{};
  put(out.name, field.name, "the field name");
  out.rows = static_cast<std::uint32_t>(field.rows);
  out.columns = static_cast<std::uint32_t>(field.cols);
  return out;
}

consort_wire_DeliveryRule delivery(const Delivery& in) { return {in.reliable, in.history, in.lifespan, in.deadline, in.liveliness_lease}; }

consort_wire_ProcessReport performance(const Performance& in) {
  return {in.periods, in.missed_deadlines, in.missed_inputs,    in.jitter_p50,           in.jitter_p99,     in.jitter_max,
          in.cpu,     in.resident_bytes,   in.sent_again_bytes, in.dds_deadlines_missed, in.liveliness_lost};
}

// A wire's report on one link: the edge, then the numbers.
template <class Report, class Counters>
Report of_link(const OfLink<Counters>& link) {
  return std::apply(
      [&link](const auto&... numbers) {
        return Report{link.edge.from.value, link.edge.to.value, numbers...};
      },
      Counters::fields(link.counters));
}

consort_wire_MemberReport member_report(const MemberReport& report, Arena& arena) {
  consort_wire_MemberReport out{};
  out.agent = report.agent.value;
  out.rounds = borrow<decltype(out.rounds)>(report.rounds.data(), report.rounds.size());
  out.estimates = borrow<decltype(out.estimates)>(report.estimates.data(), report.estimates.size());
  out.recorded = borrow<decltype(out.recorded)>(report.recorded.data(), report.recorded.size());
  out.hashes = borrow<decltype(out.hashes)>(report.hashes.data(), report.hashes.size());
  auto* counters = allocate<std::uint64_t>(arena, 3 * report.counters.size());
  for (std::size_t r = 0; r < report.counters.size(); ++r) {
    counters[3 * r] = report.counters[r].sent;
    counters[3 * r + 1] = report.counters[r].delivered;
    counters[3 * r + 2] = report.counters[r].lost;
  }
  out.counters = borrow<decltype(out.counters)>(counters, 3 * report.counters.size());
  out.slept = report.slept;
  return out;
}

consort_wire_Refusal refusal(const Refusal& in) {
  consort_wire_Refusal out{};
  put_cut(out.topic, in.topic);
  out.reason = static_cast<std::uint8_t>(in.reason);
  put_cut(out.field, in.field);
  put_cut(out.writer, in.writer);
  put_cut(out.who, in.who);
  out.samples = in.samples;
  return out;
}

// --- reading ----------------------------------------------------------------------------------------------------------

template <class Sequence>
auto view(const Sequence& sequence) {
  return std::span(static_cast<const std::remove_pointer_t<decltype(sequence._buffer)>*>(sequence._buffer), sequence._length);
}

bool all_finite(std::span<const double> values) {
  // x - x is 0 for every finite x and NaN otherwise: one vectorisable sum instead of a branch per value.
  double sum = 0.0;
  for (const double value : values) sum += value - value;
  return sum == 0.0;
}

// Finite, or of somebody who is not there.
bool all_known(std::span<const double> values) {
  return all_finite(values) ||
         std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value) || is_absent(value); });
}

template <std::size_t Size>
std::string text(const char (&field)[Size]) {
  return std::string(field, strnlen(field, Size));
}

AgentId agent_id(std::uint32_t value, const char* field) {
  require(value >= 1 && value <= kMaxAgents, field);
  return AgentId{value};
}

template <class Sequence>
std::vector<AgentId> agent_ids(const Sequence& sequence, const char* field) {
  std::vector<AgentId> out;
  out.reserve(sequence._length);
  for (const std::uint32_t value : view(sequence)) {
    out.push_back(agent_id(value, field));
    require(out.size() < 2 || out[out.size() - 2] < out.back(), field);  // ascending
  }
  return out;
}

Matrix matrix(std::uint32_t rows, std::uint32_t columns, std::span<const double> values, const char* field) {
  require(rows <= kMaxRows && columns <= kMaxRows && std::uint64_t{rows} * columns == values.size() && all_finite(values), field);
  return Eigen::Map<const Matrix>(values.data(), rows, columns);
}

template <class Sequence>
Values named_arrays(const Sequence& sequence, const char* field) {
  Values out;
  for (const auto& entry : view(sequence)) {
    const std::string name = text(entry.name);
    require(!name.empty() && !out.has(name) && entry.rows > 0 && entry.columns > 0, field);
    out.set(name, matrix(entry.rows, entry.columns, view(entry.values), field));
  }
  return out;
}

LinkSpec link_spec(const consort_wire_LinkRule& rule) {
  try {
    return link_of(named_arrays(rule.effects, "link.effects"));
  } catch (const ConfigError&) {
    throw Rejected("link.effects");
  }
}

// Changes of links, ascending by their round.
template <class Sequence, class EdgeOf>
std::vector<LinkModel::Change> link_changes(const Sequence& rules, const EdgeOf& edge_of) {
  std::vector<LinkModel::Change> out;
  for (const auto& rule : view(rules)) {
    out.push_back({rule.since, edge_of(rule), link_spec(rule)});
    require(out.size() < 2 || out[out.size() - 2].since <= out.back().since, "link.since");
  }
  return out;
}

Delivery delivery(const consort_wire_DeliveryRule& in) {
  require(in.history >= 1 && in.history <= kMaxAgents, "delivery.history");
  require(in.lifespan > 0.0 && std::isfinite(in.lifespan), "delivery.lifespan");
  require(in.deadline > 0.0 && std::isfinite(in.deadline), "delivery.deadline");
  require(in.liveliness_lease > 0.0 && std::isfinite(in.liveliness_lease), "delivery.liveliness_lease");
  return {in.reliable, in.history, in.lifespan, in.deadline, in.liveliness_lease};
}

Performance performance(std::uint32_t process, const consort_wire_ProcessReport& in) {
  for (const double value : {in.jitter_p50, in.jitter_p99, in.jitter_max, in.cpu})
    require(value >= 0.0 && std::isfinite(value), "performance");
  return {process,       in.periods, in.missed_deadlines, in.missed_inputs,    in.jitter_p50,           in.jitter_p99,
          in.jitter_max, in.cpu,     in.resident_bytes,   in.sent_again_bytes, in.dds_deadlines_missed, in.liveliness_lost};
}

Attendance attendance(std::uint32_t first, std::uint32_t end, const char* field) {
  require(first < end, field);
  return {first, end};
}

MemberTask member(const consort_wire_MemberAssignment& in) {
  MemberTask out;
  copy_numbers_of_member(out, in);
  out.agent = agent_id(in.agent, "member.agent");
  out.process = agent_id(in.process, "member.process").value;
  out.initial = named_arrays(in.initial, "member.initial");
  out.parameters = named_arrays(in.parameters, "member.parameters");
  out.in_neighbours = agent_ids(in.in_neighbours, "member.in_neighbours");
  require(!out.hears_everyone || out.in_neighbours.empty(), "member.in_neighbours");
  require(in.remote_readers <= kMaxAgents, "member.remote_readers");
  out.link_changes = link_changes(in.links, [&](const auto& rule) { return Edge{agent_id(rule.from, "link.from"), out.agent}; });
  out.model = named_arrays(in.model, "member.model");
  require(in.measurements <= kMaxValues, "member.measurements");
  require(in.distances <= kMaxAgents, "member.distances");
  for (const auto& told : view(in.told)) {
    out.told.push_back({agent_id(told.agent, "member.told"), told.since});
    require(out.told.size() < 2 || out.told[out.told.size() - 2].from < out.told.back().from, "member.told");
  }
  out.presence = attendance(in.first_round, in.end_round, "member.first_round");
  for (const std::uint32_t round : view(in.late_readers)) {
    require(out.late_readers.empty() || out.late_readers.back() <= round, "member.late_readers");
    out.late_readers.push_back(round);
  }
  return out;
}

Signal signal(const consort_wire_Signal& in) {
  Signal out;
  require(in.where <= static_cast<std::uint8_t>(Disturbance::On::measurement), "signal.where");
  require(in.kind <= static_cast<std::uint8_t>(Signal::Kind::constant), "signal.kind");
  require(in.hold_rounds >= 1, "signal.hold_rounds");
  require(std::isfinite(in.frequency), "signal.frequency");
  out.on = static_cast<Disturbance::On>(in.where);
  out.kind = static_cast<Signal::Kind>(in.kind);
  copy_numbers_of_signal(out, in);
  out.amplitude = matrix(in.rows, in.columns, view(in.amplitude), "signal.amplitude");
  out.phase = matrix(in.phase_rows, in.phase_columns, view(in.phase), "signal.phase");
  return out;
}

PlantPart plant_part(const consort_wire_PlantPart& in) {
  PlantPart out;
  out.parameters = named_arrays(in.parameters, "agent.parameters");
  out.initial = named_arrays(in.initial, "agent.initial");
  for (const std::uint32_t sensed : view(in.sensed)) out.sensed.push_back(agent_id(sensed, "agent.sensed"));
  out.distances = agent_ids(in.distances, "agent.distances");
  out.relative = in.relative;
  out.absolute = in.absolute;
  require(out.relative || (!out.sensed.empty() && !out.absolute), "agent.sensed");
  require(in.stays._length >= 1, "agent.stays");
  Round before = 0;
  for (const auto& stay : view(in.stays)) {
    const bool first = &stay == view(in.stays).data();
    require(first || stay.first_round > before, "agent.stays");
    before = stay.end_round;
    Attendance one = attendance(stay.first_round, stay.end_round, "agent.stays");
    if (first)
      out.presence = std::move(one);
    else
      out.presence.again.push_back(std::move(one));
  }
  for (const auto& entry : view(in.signals)) out.signals.push_back(signal(entry));
  return out;
}

GrantedSegment segment(const consort_wire_Segment& in) {
  GrantedSegment out{in.first, in.graph, {}};
  const auto edges = view(in.edges);
  const auto weights = view(in.weights);
  require(in.graph < kMaxGraphs, "segment.graph");
  require(in.stated || edges.empty(), "segment.stated");
  if (!in.stated) return out;
  require(edges.size() % 2 == 0 && (weights.empty() || weights.size() == edges.size() / 2), "segment.edges");
  out.stated.emplace();
  out.stated->reserve(edges.size() / 2);
  for (std::size_t e = 0; e < edges.size() / 2; ++e) {
    const Edge edge{agent_id(edges[2 * e], "segment.edges"), agent_id(edges[2 * e + 1], "segment.edges")};
    const double weight = weights.empty() ? 1.0 : weights[e];
    require(edge.from != edge.to && weight > 0.0 && std::isfinite(weight), "segment.weights");
    out.stated->push_back({edge, weight});
  }
  return out;
}

template <class Sequence>
consort::Layout layout(const Sequence& sequence, const char* field) {
  consort::Layout out;
  std::uint64_t total = 0;
  for (const auto& shape : view(sequence)) {
    require(shape.rows <= kMaxRows && shape.columns <= kMaxRows, field);
    out.fields.push_back({text(shape.name), shape.rows, shape.columns});
    total += std::uint64_t{shape.rows} * shape.columns;
    require(total <= kMaxValues && !out.fields.back().name.empty(), field);
  }
  return out;
}

Refusal refusal(const consort_wire_Refusal& in) {
  require(in.reason <= static_cast<std::uint8_t>(Refusal::Reason::build), "refusal.reason");
  return {text(in.topic), static_cast<Refusal::Reason>(in.reason), text(in.field), text(in.writer), text(in.who), in.samples};
}

MemberReport member_report(const consort_wire_MemberReport& in) {
  MemberReport out;
  out.agent = agent_id(in.agent, "report.agent");
  const auto rounds = view(in.rounds);
  const auto estimates = view(in.estimates);
  const auto hashes = view(in.hashes);
  const auto counters = view(in.counters);
  require(hashes.size() == rounds.size() && counters.size() == 3 * rounds.size(), "report.hashes");
  require(rounds.empty() ? estimates.empty() : estimates.size() % rounds.size() == 0, "report.estimates");
  require(all_known(estimates), "report.estimates");
  const auto recorded = view(in.recorded);
  require(rounds.empty() ? recorded.empty() : recorded.size() % rounds.size() == 0, "report.recorded");
  require(all_known(recorded), "report.recorded");
  for (std::size_t r = 1; r < rounds.size(); ++r) require(rounds[r - 1] < rounds[r], "report.rounds");
  out.rounds.assign(rounds.begin(), rounds.end());
  out.estimates.assign(estimates.begin(), estimates.end());
  out.recorded.assign(recorded.begin(), recorded.end());
  out.hashes.assign(hashes.begin(), hashes.end());
  for (std::size_t r = 0; r < rounds.size(); ++r) out.counters.push_back({counters[3 * r], counters[3 * r + 1], counters[3 * r + 2]});
  out.slept = in.slept;
  return out;
}

}  // namespace

consort_wire_Assignment encode(const Assignment& in, Arena& arena) {
  consort_wire_Assignment out{};
  copy_numbers_of_assignment(out, in);
  out.seed = in.seed.value;
  put(out.protocol, in.protocol, "the protocol's name");
  out.recorded = in.recorded ? *in.recorded ? 2 : 1 : 0;
  out.parameters = convert_all<decltype(out.parameters)>(in.parameters.entries(), arena, named_array);
  out.standard_link = link_rule(0, 0, in.standard_link, arena);
  out.link_changes = convert_all<decltype(out.link_changes)>(
      in.link_changes, arena, [&arena](const LinkModel::Change& change) { return link_rule(0, change.since, change.spec, arena); });
  out.delivery = delivery(in.delivery);
  out.joining = convert_all<decltype(out.joining)>(in.joining, arena, [](const auto& item) {
    return consort_wire_Joiner{item.first.value, item.second};
  });
  out.members =
      convert_all<decltype(out.members)>(in.members, arena, [&](const MemberTask& member) { return member_assignment(member, arena); });
  return out;
}

Assignment decode(const consort_wire_Assignment& in) {
  Assignment out;
  require(in.parts >= 1 && in.parts <= kMaxParts && in.part < in.parts, "part");
  require(in.agents >= 1 && in.agents <= kMaxAgents, "agents");
  require(in.dt > 0.0 && std::isfinite(in.dt), "dt");
  require(in.report_interval >= 1 && in.window >= 1, "report_interval");
  require(in.ahead >= 1, "ahead");
  require(in.recorded <= 2, "recorded");
  require(in.largest_state <= kMaxValues, "largest_state");
  require(in.largest_control <= kMaxValues, "largest_control");
  copy_numbers_of_assignment(out, in);
  out.seed = Seed{in.seed};
  out.protocol = text(in.protocol);
  if (in.recorded > 0) out.recorded = in.recorded == 2;
  out.parameters = named_arrays(in.parameters, "parameters");
  out.standard_link = link_spec(in.standard_link);
  out.link_changes = link_changes(in.link_changes, [](const auto&) { return std::optional<Edge>(); });
  out.delivery = delivery(in.delivery);
  for (const auto& joining : view(in.joining)) {
    require(joining.first_round >= 1, "joining.first_round");
    require(out.joining.emplace(agent_id(joining.agent, "joining.agent"), joining.first_round).second, "joining.agent");
  }
  out.members.reserve(in.members._length);
  for (const auto& entry : view(in.members)) {
    out.members.push_back(member(entry));
    const auto& added = out.members.back();
    require(added.agent.value <= in.agents && (added.in_neighbours.empty() || added.in_neighbours.back().value <= in.agents),
            "member.agent");
    require(added.told.empty() || added.told.back().from.value <= in.agents, "member.told");
  }
  return out;
}

consort_wire_PlantAssignment encode(const PlantAssignment& in, Arena& arena) {
  check(in.agents.size() == in.task.parts.size() && in.agents.size() == in.process_of.size(), "a plant assignment names every part");
  consort_wire_PlantAssignment out{};
  copy_job(out, in);
  out.seed = in.task.seed.value;
  put(out.model, in.task.model, "the plant model's name");
  out.dt = in.task.dt;
  out.steered = in.steered;
  out.delivery = delivery(in.delivery);
  auto* parts = allocate<consort_wire_PlantPart>(arena, in.agents.size());
  for (std::size_t i = 0; i < in.agents.size(); ++i) parts[i] = plant_part(in.agents[i], in.process_of[i], in.task.parts[i], arena);
  out.agents = borrow<decltype(out.agents)>(parts, in.agents.size());
  return out;
}

PlantAssignment decode(const consort_wire_PlantAssignment& in) {
  PlantAssignment out;
  require(in.parts >= 1 && in.parts <= kMaxParts && in.part < in.parts, "part");
  require(in.dt > 0.0 && std::isfinite(in.dt), "dt");
  require(in.report_interval >= 1, "report_interval");
  require(in.ahead >= 1, "ahead");
  copy_job(out, in);
  out.steered = in.steered;
  out.delivery = delivery(in.delivery);
  out.task.model = text(in.model);
  out.task.seed = Seed{in.seed};
  out.task.dt = in.dt;
  for (const auto& entry : view(in.agents)) {
    out.agents.push_back(agent_id(entry.agent, "agents.agent"));
    out.process_of.push_back(agent_id(entry.process, "agents.process").value);
    require(out.agents.size() < 2 || out.agents[out.agents.size() - 2] < out.agents.back(), "agents.agent");
    out.task.parts.push_back(plant_part(entry));
  }
  return out;
}

consort_wire_Grant encode(const Grant& in, Arena& arena) {
  consort_wire_Grant out{};
  out.epoch = in.epoch;
  out.until = in.until;
  out.report_at = in.report_at;
  out.start_ns = in.start_ns;
  out.whole = in.whole;
  out.reached = in.reached;
  out.segments = convert_all<decltype(out.segments)>(in.segments, arena, [&](const GrantedSegment& part) { return segment(part, arena); });
  return out;
}

Grant decode(const consort_wire_Grant& in) {
  Grant out{in.epoch, in.until, in.report_at, {}, in.start_ns, in.whole, in.reached};
  require(in.report_at <= in.until, "report_at");
  for (const auto& part : view(in.segments)) {
    out.segments.push_back(segment(part));
    require(out.segments.size() < 2 || out.segments[out.segments.size() - 2].first < part.first, "segment.first");
  }
  return out;
}

consort_wire_Command encode(const Command& in, Arena& arena) {
  consort_wire_Command out{};
  out.epoch = in.epoch;
  out.kind = static_cast<std::uint8_t>(in.order);
  out.round = in.round;
  out.agents = ids<decltype(out.agents)>(in.agents, arena);
  put_cut(out.to, in.to);
  put_cut(out.note, in.note);
  return out;
}

Command decode(const consort_wire_Command& in) {
  require(in.kind <= static_cast<std::uint8_t>(Order::refused), "kind");
  return {in.epoch, static_cast<Order>(in.kind), agent_ids(in.agents, "agents"), in.round, text(in.to), text(in.note)};
}

consort_wire_Layout encode(const Layouts& in, Arena& arena) {
  consort_wire_Layout out{};
  out.agent = in.agent.value;
  out.epoch = in.epoch;
  out.message = convert_all<decltype(out.message)>(in.message.fields, arena, field_shape);
  out.estimate = convert_all<decltype(out.estimate)>(in.estimate.fields, arena, field_shape);
  out.recorded = convert_all<decltype(out.recorded)>(in.recorded.fields, arena, field_shape);
  out.noise_offset = static_cast<std::uint32_t>(in.message.noise_offset);
  out.noise_size = static_cast<std::uint32_t>(in.message.noise_size);
  out.announcement = convert_all<decltype(out.announcement)>(in.announcement.entries(), arena, named_array);
  return out;
}

Layouts decode(const consort_wire_Layout& in) {
  Layouts out{agent_id(in.agent, "agent"),
              in.epoch,
              layout(in.message, "message"),
              layout(in.estimate, "estimate"),
              named_arrays(in.announcement, "announcement"),
              layout(in.recorded, "recorded")};
  require(std::uint64_t{in.noise_offset} + in.noise_size <= out.message.size(), "noise_size");
  out.message.noise_offset = in.noise_offset;
  out.message.noise_size = in.noise_size;
  return out;
}

consort_wire_Presence encode(const Presence& in, Arena& arena) {
  consort_wire_Presence out{};
  copy_state(out, in);
  out.state = static_cast<std::uint8_t>(in.state);
  out.pid = in.pid;
  put_cut(out.host, in.host);
  out.agents = ids<decltype(out.agents)>(in.agents, arena);
  out.waiting_agent = in.waiting_agent.value;
  out.waiting_for = ids<decltype(out.waiting_for)>(in.waiting_for, arena);
  put_cut(out.note, in.note);
  return out;
}

Presence decode(const consort_wire_Presence& in) {
  Presence out;
  require(in.state <= static_cast<std::uint8_t>(State::leaving), "state");
  require(in.waiting_agent <= kMaxAgents, "waiting_agent");
  require(in.process <= kMaxAgents, "process");
  copy_state(out, in);
  out.state = static_cast<State>(in.state);
  out.pid = in.pid;
  out.host = text(in.host);
  out.agents = agent_ids(in.agents, "agents");
  out.waiting_agent = AgentId{in.waiting_agent};
  out.waiting_for = agent_ids(in.waiting_for, "waiting_for");
  out.note = text(in.note);
  return out;
}

consort_wire_Telemetry encode(const Telemetry& in, Arena& arena) {
  consort_wire_Telemetry out{};
  copy_state(out, in);
  out.last = in.last;
  out.members =
      convert_all<decltype(out.members)>(in.members, arena, [&](const MemberReport& report) { return member_report(report, arena); });
  out.links = convert_all<decltype(out.links)>(in.links, arena, [](const auto& link) { return of_link<consort_wire_LinkReport>(link); });
  out.network =
      convert_all<decltype(out.network)>(in.network, arena, [](const auto& link) { return of_link<consort_wire_NetworkReport>(link); });
  out.performance = performance(in.performance);
  out.refusals = convert_all<decltype(out.refusals)>(in.refusals, arena, [](const Refusal& each) { return refusal(each); });
  return out;
}

Telemetry decode(const consort_wire_Telemetry& in) {
  Telemetry out;
  require(in.process <= kMaxAgents, "process");
  copy_state(out, in);
  out.last = in.last;
  for (const auto& report : view(in.members)) out.members.push_back(member_report(report));
  for (const auto& [from, to, delivered, lost, duplicated, reordered, superseded] : view(in.links))
    out.links.push_back({{agent_id(from, "links.from"), agent_id(to, "links.to")}, {delivered, lost, duplicated, reordered, superseded}});
  for (const auto& [from, to, sent, received, lost, late, duplicated, reordered] : view(in.network))
    out.network.push_back(
        {{agent_id(from, "network.from"), agent_id(to, "network.to")}, {sent, received, lost, late, duplicated, reordered}});
  out.performance = performance(in.process, in.performance);
  for (const auto& each : view(in.refusals)) out.refusals.push_back(refusal(each));
  return out;
}

consort_wire_Information encode(const Information& in) {
  return {in.epoch, in.sender.value, in.round, borrow<decltype(consort_wire_Information::values)>(in.values.data(), in.values.size())};
}

Information decode(const consort_wire_Information& in) {
  const auto values = view(in.values);
  require(values.size() <= kMaxValues && all_finite(values), "values");
  return {in.epoch, agent_id(in.sender, "sender"), in.round, values};
}

consort_wire_Measurement encode(const Measurement& in) {
  return {in.epoch, in.round, borrow<decltype(consort_wire_Measurement::values)>(in.values.data(), in.values.size())};
}

Measurement decode(const consort_wire_Measurement& in) {
  const auto values = view(in.values);
  require(values.size() <= kMaxValues && all_known(values), "values");
  return {in.epoch, in.round, values};
}

consort_wire_Actuation encode(const Actuation& in) {
  return {in.epoch, in.process, in.round, borrow<decltype(consort_wire_Actuation::values)>(in.values.data(), in.values.size())};
}

Actuation decode(const consort_wire_Actuation& in) {
  const auto values = view(in.values);
  require(values.size() <= kMaxValues && all_finite(values), "values");
  return {in.epoch, agent_id(in.process, "process").value, in.round, values};
}

consort_wire_Standing encode(const Standing& in, Arena& arena) {
  consort_wire_Standing out{};
  out.epoch = in.epoch;
  out.process = in.process;
  out.slowest = in.slowest;
  out.readers = convert_all<decltype(out.readers)>(in.readers, arena, [](const auto& reader) { return reader.first.value; });
  out.rounds = convert_all<decltype(out.rounds)>(in.readers, arena, [](const auto& reader) { return reader.second; });
  out.gaps = convert_all<decltype(out.gaps)>(in.gaps, arena, [](const Standing::Gap& gap) {
    return consort_wire_Gap{gap.sender.value, gap.first, gap.rounds, gap.asked};
  });
  return out;
}

Standing decode(const consort_wire_Standing& in) {
  require(in.process <= kMaxAgents, "process");
  Standing out{in.epoch, in.process, in.slowest, {}, {}};
  const std::vector<AgentId> readers = agent_ids(in.readers, "readers");
  const auto rounds = view(in.rounds);
  require(rounds.size() == readers.size(), "rounds");
  for (std::size_t i = 0; i < readers.size(); ++i) out.readers.emplace(readers[i], rounds[i]);
  for (const auto& gap : view(in.gaps)) {
    require(gap.sender <= kMaxAgents, "gaps.sender");
    require(gap.rounds >= 1, "gaps.rounds");
    out.gaps.push_back({AgentId{gap.sender}, gap.first, gap.rounds, gap.asked});
  }
  return out;
}

}  // namespace consort::wire
