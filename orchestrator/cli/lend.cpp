#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "orchestrator/cli/doctor.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/lending.hpp"

#include <unistd.h>
#include <nlohmann/json.hpp>

namespace consort {
namespace {

class LendVerb : public Verb {
 public:
  explicit LendVerb(CLI::App& parent) : Verb(*parent.add_subcommand("lend", "")) {
    document(
        app_,
        "lend this host to a run elsewhere\n"
        "The far end of a connection of `consort run --hosts`, which starts it over ssh: it starts agents as it is told on standard input, "
        "passes on what they write and how they end, and ends them all when standard input closes or is silent for 5 s. Nobody needs to "
        "start it by hand.",
        {{"ssh node1 consort lend </dev/null", "Does ssh find this program there? It prints its build, and ends."}},
        {{"0", "the run has ended"}, {"3", "the run has been silent, or said what makes no sense"}});
  }

  Exit execute() override {
    Lending lending(program_folder(), ::dup(STDIN_FILENO), ::dup(STDOUT_FILENO),
                    [](const std::string& interface) { return to_json(examine_host(interface)); });
    if (const std::string why = lending.serve(); !why.empty()) throw RunError(why);
    return Exit::ok;
  }
};

}  // namespace

std::unique_ptr<Verb> make_lend_verb(CLI::App& parent) { return std::make_unique<LendVerb>(parent); }

}  // namespace consort
