#pragma once
/// encode(): core values -> generated structs, borrowing memory from the values and an arena. decode(): generated structs -> core values,
/// throwing Rejected with the name of the field that breaks a bound of consort.idl.

#include "consort.h"
#include "idl/wire.hpp"

#include <memory_resource>
#include <stdexcept>

namespace consort::wire {

/// A received sample breaks a bound; the text names the field.
struct Rejected : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Memory that lives as long as the encoded sample is in use.
using Arena = std::pmr::monotonic_buffer_resource;

consort_wire_Assignment encode(const Assignment&, Arena&);
consort_wire_PlantAssignment encode(const PlantAssignment&, Arena&);
consort_wire_Grant encode(const Grant&, Arena&);
consort_wire_Command encode(const Command&, Arena&);
consort_wire_Layout encode(const Layouts&, Arena&);
consort_wire_Presence encode(const Presence&, Arena&);
consort_wire_Telemetry encode(const Telemetry&, Arena&);
consort_wire_Information encode(const Information&);
consort_wire_Measurement encode(const Measurement&);
consort_wire_Actuation encode(const Actuation&);
consort_wire_Standing encode(const Standing&, Arena&);

Assignment decode(const consort_wire_Assignment&);
PlantAssignment decode(const consort_wire_PlantAssignment&);
Grant decode(const consort_wire_Grant&);
Command decode(const consort_wire_Command&);
Layouts decode(const consort_wire_Layout&);
Presence decode(const consort_wire_Presence&);
Telemetry decode(const consort_wire_Telemetry&);
Information decode(const consort_wire_Information&);  ///< views of the sample's memory
Measurement decode(const consort_wire_Measurement&);
Actuation decode(const consort_wire_Actuation&);
Standing decode(const consort_wire_Standing&);

}  // namespace consort::wire
