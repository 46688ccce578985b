#pragma once
/// The links part of the experiment file: what links do, exceptions by edge, `set_link` events, cuts and heals.

#include "core/experiment.hpp"
#include "orchestrator/script/link_reader.hpp"
#include "orchestrator/script/yaml.hpp"

#include <vector>

namespace consort::script {

/// `links: ...` into `experiment.links`. Times become rounds of `experiment.dt`.
void read_links(Mistakes&, const YAML::Node&, Experiment& experiment);

/// The `set_link` events of a file. They build on each other, so they take effect once all are read.
class LinkChanges {
 public:
  void read(Mistakes&, const YAML::Node&, const std::string& what, Round round, const Experiment& experiment);
  void apply(LinkModel& links) const;

 private:
  struct Entry {
    Round round = 0;
    std::vector<Edge> edges;  // empty: all links
    LinkPatch patch;
  };
  std::vector<Entry> entries_;
};

/// What follows `cut:` or `heal:`: edges, `{groups: [[1, 2], [3, 4]]}` (all edges between groups) or, to heal, `all`.
LinkEvent read_link_event(Mistakes&, const YAML::Node&, const std::string& what, Round round, bool heal, std::size_t agents);

/// The keys of a link, every one written out.
void put_link(YAML::Node& out, const LinkSpec& link);

}  // namespace consort::script
