#pragma once
/// The keys of one link, as `links`, its overrides and `set_link` events have them.

#include "core/network/link.hpp"
#include "orchestrator/script/yaml.hpp"

#include <functional>
#include <string>
#include <vector>

namespace consort::script {

/// What the keys of a link change; keys that are not there change nothing.
using LinkPatch = std::vector<std::function<void(LinkSpec&)>>;
/// `what` names the section in messages. Times become rounds of `dt`.
LinkPatch read_link(Mistakes&, Seconds dt, const Section& section, const std::string& what);
void change_by(const LinkPatch& patch, LinkSpec& link);

}  // namespace consort::script
