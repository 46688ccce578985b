#include "orchestrator/script/document.hpp"

#include "orchestrator/script/lookalikes.hpp"
#include "orchestrator/script/slips.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <utility>

namespace consort::script {
namespace {

// --- structure --------------------------------------------------------------------------------------------------------------------

struct Refusal {
  YAML::Mark mark;
  std::string text;
};

// Hears a document once, as it is written, and refuses what could not be walked with its aliases in place.
class Surveyor : public YAML::EventHandler {
 public:
  Surveyor(std::string_view text, Mistakes& mistakes) : text_(text), mistakes_(mistakes) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1)
      throw Refusal{mark, "found a second YAML document, or text after the end of the first; allowed: one document, the experiment"};
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { keep(mark, anchor, {1, 0}); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, const std::string& value) override {
    if (tag == "?" && any_lookalike(value)) report_lookalike(text_, mark, mistakes_);
    keep(mark, anchor, {1, 0});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto it = anchored_.find(anchor);
    if (it == anchored_.end())
      throw Refusal{mark, "found an alias within what it stands for; allowed: an alias of something that ended before"};
    aliased_ += it->second.nodes;
    if (aliased_ > kMostAliased)
      throw Refusal{mark, fmt::format("found an alias with which aliases stand for more than {} values; allowed: at most {}, all together",
                                      kMostAliased, kMostAliased)};
    add(mark, it->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Size {
    std::size_t nodes, depth;
  };
  struct Open {
    YAML::Mark mark;
    YAML::anchor_t anchor;
    Size size;
  };

  void open(const YAML::Mark& mark, YAML::anchor_t anchor) {
    open_.push_back({mark, anchor, {1, 1}});
    check_depth(mark, 0);
  }
  void close() {
    const Open closed = open_.back();
    open_.pop_back();
    keep(closed.mark, closed.anchor, closed.size);
  }
  void keep(const YAML::Mark& mark, YAML::anchor_t anchor, const Size& size) {
    if (anchor != YAML::NullAnchor) anchored_[anchor] = size;
    if (size.depth == 0 && ++written_ > kMostNodes)
      throw Refusal{mark, fmt::format("found more than {} values; allowed: fewer; numbers of many agents may stand in a file of their own",
                                      kMostNodes)};
    add(mark, size);
  }
  void add(const YAML::Mark& mark, const Size& size) {
    check_depth(mark, size.depth);
    if (open_.empty()) return;
    open_.back().size.nodes += size.nodes;
    open_.back().size.depth = std::max(open_.back().size.depth, size.depth + 1);
  }
  void check_depth(const YAML::Mark& mark, std::size_t below) const {
    if (open_.size() + below > kDeepest)
      throw Refusal{mark, fmt::format("found lists and mappings more than {} deep; allowed: at most {}", kDeepest, kDeepest)};
  }

  std::string_view text_;
  Mistakes& mistakes_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Size> anchored_;
  std::size_t documents_ = 0, written_ = 0, aliased_ = 0;
};

// --- merge keys -------------------------------------------------------------------------------------------------------------------

bool is_merge_key(const YAML::Node& key) { return key.IsScalar() && key.Tag() != "!" && key.Scalar() == "<<"; }

// The entries of `from` whose keys `into` does not have.
void merge_into(YAML::Node into, const YAML::Node& from) {
  std::set<std::string> own;
  for (const auto& entry : into)
    if (entry.first.IsScalar()) own.insert(entry.first.Scalar());
  for (const auto& entry : from)
    if (!entry.first.IsScalar() || !own.contains(entry.first.Scalar())) into.force_insert(entry.first, entry.second);
}

// Replaces the `<<` keys of `node`, and of all that is in it, by the entries of the mappings they name; of several, the first wins.
void merge(YAML::Node node, Mistakes& mistakes) {
  if (node.IsSequence())
    for (const auto& entry : node) merge(entry, mistakes);
  if (!node.IsMap()) return;
  std::vector<std::pair<YAML::Node, YAML::Node>> merged;
  for (const auto& entry : node) {
    merge(entry.second, mistakes);
    if (is_merge_key(entry.first)) merged.emplace_back(entry.first, entry.second);
  }
  for (const auto& [key, value] : merged) {
    const YAML::Node sources = value.IsSequence() ? value : YAML::Node(std::vector<YAML::Node>{value});
    node.remove(key);
    for (const auto& source : sources) {
      if (source.IsMap())
        merge_into(node, source);
      else
        mistakes.add(source.Mark().is_null() ? key.Mark() : source.Mark(),
                     fmt::format("<<: found {}; allowed: an alias of a mapping, or a list of them", describe(source)));
    }
  }
}

}  // namespace

std::string plain_text(const std::string& bytes) {
  std::string text;
  for (std::size_t at = bytes.starts_with("\xef\xbb\xbf") ? 3 : 0; at < bytes.size(); ++at) {
    if (bytes[at] != '\r')
      text += bytes[at];
    else if (at + 1 == bytes.size() || bytes[at + 1] != '\n')
      text += '\n';
  }
  return text;
}

YAML::Node read_document(const std::string& text, Mistakes& mistakes) {
  if (report_bytes(text, mistakes)) return {};
  mistakes.are_in(text);
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    Surveyor surveyor(text, mistakes);
    while (parser.HandleNextDocument(surveyor)) {
    }
    YAML::Node document = YAML::Load(text);
    if (document.IsNull())
      mistakes.add(YAML::Mark(), "found an empty file; allowed: an experiment, a mapping with at least experiment, agents and topology");
    if (mistakes.none()) check_keys(document, mistakes);
    merge(document, mistakes);
    return document;
  } catch (const Refusal& refusal) {
    mistakes.add(refusal.mark, refusal.text);
  } catch (const YAML::ParserException& error) {
    if (mistakes.none()) explain(text, error, mistakes);  // else the slip is known already
  } catch (const YAML::Exception& error) {
    mistakes.add(error.mark, "found text that is not YAML: " + error.msg + "; allowed: YAML 1.2");
  }
  return {};
}

}  // namespace consort::script
