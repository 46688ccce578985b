#include "orchestrator/script/document.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>
#include <utility>

namespace consort::script {
namespace {

// --- characters -------------------------------------------------------------------------------------------------------------------

struct FalseSpace {
  std::string_view bytes, name;
};
constexpr std::array kFalseSpaces{
    FalseSpace{"\u00a0", "a no-break space (U+00A0)"},     FalseSpace{"\u2007", "a figure space (U+2007)"},
    FalseSpace{"\u200b", "a zero-width space (U+200B)"},   FalseSpace{"\u202f", "a narrow no-break space (U+202F)"},
    FalseSpace{"\u3000", "an ideographic space (U+3000)"},
};

YAML::Mark mark_at(std::size_t line, std::size_t column) {
  YAML::Mark mark;
  mark.line = static_cast<int>(line);
  mark.column = static_cast<int>(column);
  return mark;
}

YAML::Mark mark_of(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  const auto lines = static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  return mark_at(lines, at - (lines == 0 ? 0 : before.rfind('\n') + 1));
}

/// The characters that look like the space YAML wants, and are none.
class Spaces {
 public:
  explicit Spaces(std::string_view text) {
    for (; !text.empty(); text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1))
      lines_.push_back(text.substr(0, text.find('\n')));
  }

  static bool any_false(std::string_view text) {
    return std::any_of(kFalseSpaces.begin(), kFalseSpaces.end(),
                       [text](const FalseSpace& space) { return text.find(space.bytes) != std::string_view::npos; });
  }

  /// The first of them from `mark` on, outside comments.
  bool report_from(const YAML::Mark& mark, Mistakes& mistakes) const {
    for (auto line = static_cast<std::size_t>(mark.line), at = static_cast<std::size_t>(mark.column); line < lines_.size(); ++line, at = 0)
      if (report(line, at, mistakes)) return true;
    return false;
  }

  /// YAML could not be read at `line`: because of a tab that indents it or the line before, or of a false space there?
  bool explain(std::size_t line, Mistakes& mistakes) const {
    for (const std::size_t at : {line, line - 1}) {
      if (at >= lines_.size()) continue;
      const std::size_t tab = lines_[at].find('\t');
      if (tab < lines_[at].find_first_not_of(" \t-?")) {
        mistakes.add(mark_at(at, tab), "found a tab in the indentation; allowed: spaces");
        return true;
      }
      if (report(at, 0, mistakes)) return true;
    }
    return false;
  }

 private:
  bool report(std::size_t line, std::size_t from, Mistakes& mistakes) const {
    const std::string_view text = lines_[line];
    for (std::size_t at = from; at < text.size(); ++at) {
      if (text[at] == '#' && (at == 0 || text[at - 1] == ' ' || text[at - 1] == '\t')) return false;
      for (const FalseSpace& space : kFalseSpaces) {
        if (!text.substr(at).starts_with(space.bytes)) continue;
        mistakes.add(mark_at(line, at), fmt::format("found {}; allowed: a plain space", space.name));
        return true;
      }
    }
    return false;
  }

  std::vector<std::string_view> lines_;
};

/// What no experiment file holds: bytes that are not UTF-8, and control characters (of which YAML takes one for the end of the text).
bool report_bytes(std::string_view text, Mistakes& mistakes) {
  if (const auto at = first_byte_not_utf8(text)) {
    mistakes.add(mark_of(text, *at), "found a byte that is not UTF-8; allowed: text in UTF-8");
    return true;
  }
  const auto control = [](char c) { return (c >= 0 && c < ' ' && c != '\t' && c != '\n' && c != '\r') || c == '\x7f'; };
  const auto it = std::find_if(text.begin(), text.end(), control);
  if (it == text.end()) return false;
  mistakes.add(mark_of(text, static_cast<std::size_t>(it - text.begin())),
               fmt::format("found the control character U+{:04X}; allowed: text", static_cast<unsigned>(*it)));
  return true;
}

// --- structure --------------------------------------------------------------------------------------------------------------------

struct Refusal {
  YAML::Mark mark;
  std::string text;
};

/// Hears a document once, as it is written, and refuses what could not be walked with its aliases in place.
class Surveyor : public YAML::EventHandler {
 public:
  explicit Surveyor(const Spaces& spaces, Mistakes& mistakes) : spaces_(spaces), mistakes_(mistakes) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1)
      throw Refusal{mark, "found a second YAML document, or text after the end of the first; allowed: one document, the experiment"};
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { keep(mark, anchor, {1, 0}); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, const std::string& value) override {
    if (tag == "?" && Spaces::any_false(value)) spaces_.report_from(mark, mistakes_);
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

  const Spaces& spaces_;
  Mistakes& mistakes_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Size> anchored_;
  std::size_t documents_ = 0, written_ = 0, aliased_ = 0;
};

// --- merge keys -------------------------------------------------------------------------------------------------------------------

bool is_merge_key(const YAML::Node& key) { return key.IsScalar() && key.Tag() != "!" && key.Scalar() == "<<"; }

/// The entries of `from` whose keys `into` does not have.
void merge_into(YAML::Node into, const YAML::Node& from) {
  std::set<std::string> own;
  for (const auto& entry : into)
    if (entry.first.IsScalar()) own.insert(entry.first.Scalar());
  for (const auto& entry : from)
    if (!entry.first.IsScalar() || !own.contains(entry.first.Scalar())) into.force_insert(entry.first, entry.second);
}

/// Replaces the `<<` keys of `node`, and of all that is in it, by the entries of the mappings they name; of several, the first wins.
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

YAML::Node read_document(const std::string& bytes, Mistakes& mistakes) {
  const std::string text = bytes.starts_with("\xef\xbb\xbf") ? bytes.substr(3) : bytes;  // a byte order mark
  if (report_bytes(text, mistakes)) return {};
  const Spaces spaces(text);
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    Surveyor surveyor(spaces, mistakes);
    while (parser.HandleNextDocument(surveyor)) {
    }
    YAML::Node document = YAML::Load(text);
    if (document.IsNull())
      mistakes.add(YAML::Mark(), "found an empty file; allowed: an experiment, a mapping with at least experiment, agents and topology");
    merge(document, mistakes);
    return document;
  } catch (const Refusal& refusal) {
    mistakes.add(refusal.mark, refusal.text);
  } catch (const YAML::Exception& error) {
    if (!spaces.explain(static_cast<std::size_t>(std::max(0, error.mark.line)), mistakes))
      mistakes.add(error.mark, "found text that is not YAML: " + error.msg + "; allowed: YAML 1.2");
  }
  return {};
}

}  // namespace consort::script
