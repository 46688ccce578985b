#include "orchestrator/script/skeleton.hpp"

#include "orchestrator/script/lookalikes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace consort::script {
namespace {

bool is_word(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.'; }
bool is_blank(char c) { return c == ' ' || c == '\t'; }

class SkeletonReader {
 public:
  explicit SkeletonReader(std::string_view text) : text_(text) {}

  Skeleton read() {
    begin_line();
    for (; at_ < text_.size() && !out_.unbalanced; ++at_) {
      if (text_[at_] == '\n')
        end_line();
      else
        out_.lines.back().text += take(text_[at_]);
    }
    if (!out_.unbalanced) refuse_open(true);
    return std::move(out_);
  }

 private:
  struct Open {
    char sign;
    YAML::Mark mark;
  };

  void begin_line() {
    out_.lines.push_back({"", quote_ || !brackets_.empty()});
    line_begin_ = at_ + (out_.lines.size() > 1 ? 1 : 0);
    comment_ = false;
    fresh_ = true;
    const std::string_view line = rest_of_line();
    const std::size_t indent = line.find_first_not_of(' ');
    if (literal_ && indent < *literal_ + 1) literal_.reset();  // npos: a blank line, which ends nothing
  }

  void end_line() {
    const std::size_t next = at_ + 1;
    const std::string_view following = text_.substr(next, text_.find('\n', next) - std::min(next, text_.size()));
    if (begins_with_key(following)) refuse_open(false);
    if (!out_.unbalanced) begin_line();
  }

  // A quote within which a line like `key: value` comes, and a bracket before such a line without a comma, were to be closed.
  void refuse_open(bool at_end) {
    if (quote_) {
      out_.unbalanced = {quote_->mark, fmt::format("found a quotation mark ({0}) that is not closed; allowed: a {0} at the end of the text",
                                                   quote_->sign)};
    } else if (!brackets_.empty() && (at_end || (last_ != ',' && last_ != '[' && last_ != '{'))) {
      const Open& open = brackets_.back();
      out_.unbalanced = {open.mark, fmt::format("found '{}' that is not closed; allowed: a '{}' for it", open.sign, closing(open.sign))};
    }
  }

  [[nodiscard]] std::string_view rest_of_line() const {
    return line_begin_ < text_.size() ? text_.substr(line_begin_, text_.find('\n', line_begin_) - line_begin_) : std::string_view();
  }
  [[nodiscard]] YAML::Mark here() const { return mark_at(out_.lines.size() - 1, at_ - line_begin_); }
  static char closing(char opening) { return opening == '[' ? ']' : '}'; }

  // What stands for `c` in the skeleton.
  char take(char c) {
    if (comment_ || literal_) return ' ';
    if (quote_) return in_quotes(c);
    if (c == '#' && (at_ == line_begin_ || is_blank(text_[at_ - 1]))) {
      comment_ = true;
      return ' ';
    }
    if (is_blank(c)) {
      named_ = false;
      return c;
    }
    structure(c);
    last_ = c;
    return c;
  }

  char in_quotes(char c) {
    const bool escape = quote_->sign == '"' ? c == '\\' : c == '\'' && text_.substr(at_ + 1).starts_with('\'');
    if (skip_)
      skip_ = false;
    else if (escape)
      skip_ = true;
    else if (c == quote_->sign) {
      quote_.reset();
      last_ = c;
      return c;
    }
    return 'q';
  }

  // Keeps account of what is open, and of whether a new value may begin here.
  void structure(char c) {
    const bool flow = !brackets_.empty();
    const bool next_blank = at_ + 1 == text_.size() || is_blank(text_[at_ + 1]) || text_[at_ + 1] == '\n';
    const bool was_fresh = fresh_;
    fresh_ = (c == ':' && (next_blank || flow)) || (was_fresh && (c == '-' || c == '?') && next_blank) || (flow && c == ',');
    if (named_ || (was_fresh && (c == '&' || c == '!'))) {  // an anchor or a tag: the value comes behind it
      named_ = fresh_ = true;
      return;
    }
    if (was_fresh && (c == '"' || c == '\'')) quote_ = {c, here()};
    if ((was_fresh || flow) && (c == '[' || c == '{')) open(c, was_fresh);
    if (c == ']' || c == '}') close(c, was_fresh);
    if (was_fresh && !flow && (c == '|' || c == '>')) begin_literal();
  }

  void open(char c, bool was_fresh) {
    if (!was_fresh) {
      out_.unbalanced = {here(), fmt::format("found '{}' within a text within brackets; allowed: such a text in quotes", c)};
      return;
    }
    brackets_.push_back({c, here()});
    fresh_ = true;
  }

  void close(char c, bool was_fresh) {
    if (brackets_.empty()) {
      if (was_fresh || last_ == ']' || last_ == '}' || last_ == '"' || last_ == '\'')
        out_.unbalanced = {here(), fmt::format("found '{0}' that closes nothing; allowed: no '{0}' here, or what it closes before it", c)};
    } else if (const Open& open = brackets_.back(); closing(open.sign) != c) {
      out_.unbalanced = {here(), fmt::format("found '{}' where the '{}' of line {}, column {} is open; allowed: a '{}' first", c, open.sign,
                                             open.mark.line + 1, open.mark.column + 1, closing(open.sign))};
    } else {
      brackets_.pop_back();
    }
  }

  void begin_literal() {
    const std::string_view line = rest_of_line(), rest = line.substr(at_ + 1 - line_begin_);
    if (rest.substr(0, rest.find('#')).find_first_not_of("+-0123456789 \t") != std::string_view::npos) return;
    literal_ = line.find_first_not_of(' ');
    comment_ = true;  // the rest of this line
  }

  std::string_view text_;
  Skeleton out_;
  std::size_t at_ = 0, line_begin_ = 0;
  std::vector<Open> brackets_;
  std::optional<Open> quote_;
  std::optional<std::size_t> literal_;  // indentation of the line that began a literal block
  bool comment_ = false, skip_ = false, fresh_ = true, named_ = false;
  char last_ = ' ';  // that was not blank
};

}  // namespace

Skeleton skeleton_of(std::string_view text) { return SkeletonReader(text).read(); }

bool begins_with_key(std::string_view line) {
  std::size_t at = line.find_first_not_of(" -");
  const std::size_t begin = at;
  while (at < line.size() && (is_word(line[at]) || line[at] == '-')) ++at;
  return at < line.size() && at > begin && line[at] == ':' && (at + 1 == line.size() || is_blank(line[at + 1]));
}

}  // namespace consort::script
