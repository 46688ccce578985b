#include "tests/fuzz/wire_bytes.hpp"

#include "idl/codec.hpp"
#include "tests/support/wire_samples.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_serdata_default.h>

#include <array>
#include <concepts>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace consort::fuzz {
namespace {

constexpr std::uint32_t kXcdr1 = 1;

template <class Wire>
struct Type {
  Type(std::uint8_t topic_number, const dds_topic_descriptor_t& topic_descriptor) : number(topic_number), descriptor(topic_descriptor) {
    sertype.type.size = descriptor.m_size;
    sertype.type.align = descriptor.m_align;
    sertype.type.flagset = descriptor.m_flagset;
    sertype.type.ops.nops = descriptor.m_nops;
    sertype.type.ops.ops = const_cast<std::uint32_t*>(descriptor.m_ops);  // only read
  }

  Fate take(std::span<const std::uint8_t> bytes) const {
    // The deserialiser works in place, on memory that is aligned.
    std::unique_ptr<std::uint64_t[]> copy(new std::uint64_t[bytes.size() / 8 + 1]);
    if (!bytes.empty()) std::memcpy(copy.get(), bytes.data(), bytes.size());
    std::uint32_t used = 0;
    if (!dds_stream_normalize(copy.get(), static_cast<std::uint32_t>(bytes.size()), false, kXcdr1, &sertype, false, &used))
      return Fate::malformed;
    dds_istream_t in;
    dds_istream_init(&in, used, copy.get(), kXcdr1);
    Wire sample{};
    const auto free = [this](Wire* contents) { dds_stream_free_sample(contents, descriptor.m_ops); };
    const std::unique_ptr<Wire, decltype(free)> contents(&sample, free);
    dds_stream_read_sample(&in, &sample, &sertype);
    return decode_twice(sample);
  }

  /// What has been decoded can be sent on, and is decoded again.
  static Fate decode_twice(const Wire& sample) {
    try {
      const auto value = wire::decode(sample);
      wire::Arena arena;
      if constexpr (requires { wire::encode(value, arena); })
        again(wire::encode(value, arena));
      else
        again(wire::encode(value));
      return Fate::decoded;
    } catch (const wire::Rejected&) {
      return Fate::rejected;
    }
  }
  static void again(const Wire& sample) {
    try {
      wire::decode(sample);
    } catch (const wire::Rejected& broken) {
      throw std::logic_error(std::string("what was decoded is rejected when it is sent on: ") + broken.what());
    }
  }

  std::vector<std::uint8_t> bytes_of(const Wire& sample) const {
    dds_ostream_t out;
    dds_ostream_init(&out, 0, kXcdr1);
    dds_stream_write_sample(&out, &sample, &sertype);
    std::vector<std::uint8_t> bytes{number};
    bytes.insert(bytes.end(), out.m_buffer, out.m_buffer + out.m_index);
    dds_ostream_fini(&out);
    return bytes;
  }

  std::uint8_t number;
  const dds_topic_descriptor_t& descriptor;
  ddsi_sertype_default sertype{};
};

const Type<consort_wire_Assignment> kAssignment(0, consort_wire_Assignment_desc);
const Type<consort_wire_PlantAssignment> kPlantAssignment(1, consort_wire_PlantAssignment_desc);
const Type<consort_wire_Grant> kGrant(2, consort_wire_Grant_desc);
const Type<consort_wire_Command> kCommand(3, consort_wire_Command_desc);
const Type<consort_wire_Information> kInformation(4, consort_wire_Information_desc);
const Type<consort_wire_Measurement> kMeasurement(5, consort_wire_Measurement_desc);
const Type<consort_wire_Actuation> kActuation(6, consort_wire_Actuation_desc);
const Type<consort_wire_Layout> kLayout(7, consort_wire_Layout_desc);
const Type<consort_wire_Presence> kPresence(8, consort_wire_Presence_desc);
const Type<consort_wire_Telemetry> kTelemetry(9, consort_wire_Telemetry_desc);
const Type<consort_wire_Standing> kStanding(10, consort_wire_Standing_desc);

}  // namespace

Fate take_wire_bytes(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return Fate::malformed;
  const auto rest = bytes.subspan(1);
  switch (bytes[0] % 11) {
    case 0:
      return kAssignment.take(rest);
    case 1:
      return kPlantAssignment.take(rest);
    case 2:
      return kGrant.take(rest);
    case 3:
      return kCommand.take(rest);
    case 4:
      return kInformation.take(rest);
    case 5:
      return kMeasurement.take(rest);
    case 6:
      return kActuation.take(rest);
    case 7:
      return kLayout.take(rest);
    case 8:
      return kPresence.take(rest);
    case 9:
      return kTelemetry.take(rest);
    default:
      return kStanding.take(rest);
  }
}

std::vector<std::vector<std::uint8_t>> wire_seeds() {
  using namespace wire;
  Arena arena;
  const std::vector<double> values{1.0, -2.5, 1e300};
  return {kAssignment.bytes_of(encode(some_assignment(), arena)),
          kPlantAssignment.bytes_of(encode(some_plant_assignment(), arena)),
          kGrant.bytes_of(encode(some_grant(), arena)),
          kCommand.bytes_of(encode(Command{4, Order::departed, {AgentId{2}, AgentId{7}}}, arena)),
          kInformation.bytes_of(encode(Information{1, AgentId{2}, 3, values})),
          kMeasurement.bytes_of(encode(Measurement{1, 3, values})),
          kActuation.bytes_of(encode(Actuation{1, 2, 3, values})),
          kLayout.bytes_of(encode(some_layouts(), arena)),
          kPresence.bytes_of(encode(some_presence(), arena)),
          kTelemetry.bytes_of(encode(some_telemetry(), arena)),
          kStanding.bytes_of(encode(some_standing(), arena))};
}

}  // namespace consort::fuzz
