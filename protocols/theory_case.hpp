#pragma once
/// What the theory of every protocol starts from: one protocol of one experiment, what is known of its graphs, and what many protocols ask.

#include "core/network/survey.hpp"
#include "protocols/registry.hpp"
#include "protocols/theory.hpp"

#include <complex>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// Operations that decompositions of an n x n matrix take, roughly.
constexpr double spectrum_cost(double n) { return 25.0 * n * n * n; }
constexpr double symmetric_spectrum_cost(double n) { return 5.0 * n * n * n; }
/// How often largest_stable_step() asks for the spectral radius of a loop, at most.
constexpr double kStepQuestions = 100.0;

/// Laplacian spectra, each computed once.
class Spectra {
 public:
  using Spectrum = std::vector<std::complex<double>>;
  explicit Spectra(Effort& effort) : effort_(effort) {}
  /// Eigenvalues of L, ascending by real part; null if they cost more than is left. The graph must outlive this.
  const Spectrum* of(const Graph& graph);
  /// Of all graphs of the run, without the eigenvalue nearest to zero of each; nothing if they cost more than is left.
  std::optional<Spectrum> without_zero(const Survey& survey);

 private:
  Effort& effort_;
  std::map<const Graph*, Spectrum> known_;
};

struct TheoryCase {
  const Experiment& experiment;
  const ProtocolChoice& choice;  ///< the first of a sweep's values
  const ProtocolEntry& entry;
  const Survey& survey;
  Spectra& spectra;
  Effort& effort;

  // With the defaults that the protocol's documents state.
  [[nodiscard]] Values parameters() const { return with_defaults(choice.parameters, entry.parameters); }  ///< common to all agents
  [[nodiscard]] Values parameters(AgentId agent) const;
  [[nodiscard]] Values initial(AgentId agent) const;
};

/// Gathers what is found about one protocol: every condition begins with its name.
class Findings {
 public:
  Findings(std::string protocol, std::vector<Finding>& out) : protocol_(std::move(protocol)), out_(out) {}
  void add(Rating verdict, std::string_view condition, std::string evidence, std::string consequence);
  void add(Finding finding) { out_.push_back(std::move(finding)); }  ///< whose condition begins with the name already
  /// A condition that either holds or fails.
  void judge(bool holds, std::string_view condition, std::string evidence, std::string if_so, std::string if_not);
  /// The mathematics refuses the numbers of the experiment, and says `why`.
  void give_up(std::string why) { add(Rating::left_out, "what follows from its numbers", std::move(why), "not examined further"); }
  /// A condition that would have taken too long.
  void leave_out(std::string_view condition, std::string why);
  [[nodiscard]] const std::string& protocol() const { return protocol_; }

 private:
  std::string protocol_;
  std::vector<Finding>& out_;
};

/// Evidence for a property of every round's graph.
std::string evidence_of(const Survey& survey, const std::optional<Survey::Failure>& failure);

/// Does some link, at some time, in some case of a sweep, have the property?
bool any_link(const TheoryCase& of, const std::function<bool(const LinkSpec&)>& property);
/// Which values do links without loss, delay and noise lead to? " with ideal links" where these are not.
std::string limits_of_prediction(const TheoryCase& of);

// What many protocols ask. `if_so` is what follows where it holds.
/// The union of the graphs over bounded windows has a spanning tree.
bool ask_spanning_windows(const TheoryCase& of, Findings& out, const std::string& if_so);
/// A spanning tree in every round.
bool ask_spanning_tree(const TheoryCase& of, Findings& out, const std::string& if_so);
/// Strongly connected in every round.
bool ask_strongly_connected(const TheoryCase& of, Findings& out, const std::string& if_so, const std::string& if_not);
/// No link loses messages.
bool ask_no_loss(const TheoryCase& of, Findings& out, const std::string& if_not);
/// Nothing disturbs plant, measurements or messages.
bool ask_no_noise(const TheoryCase& of, Findings& out, const std::string& if_not);

/// "dt is short enough for `what`": whether the spectral radius of a loop sampled with step dt is below 1 and, if that can be afforded, up
/// to which step it is.
struct SampledLoop {
  std::function<double(Seconds)> radius;
  Seconds shortest;   ///< short against all the loop does
  double cost;        ///< of asking for the radius once
  std::string where;  ///< which loop, for the evidence; may be empty
};
/// What to do about it where it is not follows `if_not`.
void ask_short_step(const TheoryCase& of, Findings& out, const std::string& what, const SampledLoop& loop, const std::string& if_so,
                    const std::string& if_not);

/// What to do about a loop that a step of dt does not make stable; `longest`: a shorter step than this does, none if it is not above zero;
/// nothing: not known.
std::string step_remedy(Seconds dt, std::optional<Seconds> longest);

/// The smallest h > 0 for which `radius(h)`, the spectral radius of a loop sampled with step h, reaches 1, to six digits; 0 if the loop is
/// unstable however short the step, infinity if no step up to 1e6 `shortest` makes it so. `shortest` is short against all it does.
Seconds largest_stable_step(const std::function<double(Seconds)>& radius, Seconds shortest);

}  // namespace consort
