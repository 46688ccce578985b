#pragma once
/// Why a domain cannot be opened, in words for a person. DDS's return code says nothing, its log says it to whoever knows its inside.

#include <dds/dds.hpp>

#include <string>

namespace consort::wire {

/// A configuration of the user's (CYCLONEDDS_URI) that does not work is a ConfigError which names it, all else (a port that is taken, say)
/// a RunError about `what`. `remedy` is for taken ports. Takes the reasons of this process's DdsLog.
[[noreturn]] void raise_no_domain(const dds::core::Exception& failure, const std::string& what, const std::string& remedy);

/// What `reason` objects to in a configuration; empty if it is about something else.
std::string objection_in(const std::string& reason);
/// Which ports `reason` says are taken; empty if it is about something else.
std::string taken_ports_in(const std::string& reason);

}  // namespace consort::wire
