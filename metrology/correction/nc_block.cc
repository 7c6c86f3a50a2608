#include "metrology/correction/nc_block.h"

#include <absl/strings/ascii.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>
#include <utility>

namespace sixpoint::metrology {
namespace {

using Wrong = std::function<absl::Status(const std::string&)>;

const std::set<std::string> kNames = {"TRAORI", "TRAFOOF", "ORIWKS", "ORIVECT"};

bool ToNumber(const std::string& text, double* value) {
  const std::string digits = text.rfind('+', 0) == 0 ? text.substr(1) : text;
  if (digits.empty() || digits.find_first_not_of("-.0123456789") != std::string::npos) return false;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), *value, std::chars_format::fixed);
  return read.ec == std::errc() && read.ptr == digits.data() + digits.size();
}

void AddMarker(const std::string& comment, std::vector<std::string>* markers) {
  constexpr char kBlank[] = " \t\r";
  const std::size_t begin = comment.find_first_not_of(kBlank);
  if (begin == std::string::npos) return;
  const std::size_t end = std::min(comment.find_first_of(kBlank, begin), comment.size());
  std::string word = comment.substr(begin, end - begin);
  for (char& c : word) c = absl::ascii_toupper(c);
  if (word != "SIXPOINT") return;
  const std::size_t name = std::min(comment.find_first_not_of(kBlank, end), comment.size());
  const std::size_t last = comment.find_last_not_of(kBlank);
  markers->push_back(name > last ? std::string() : comment.substr(name, last - name + 1));
}

class Line {
 public:
  Line(const std::string& text, bool knows_names, const Wrong& wrong)
      : text_(text), knows_names_(knows_names), wrong_(wrong) {}

  absl::Status Read() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (IsBlank(at_)) {
        ++at_;
      } else if (c == '%') {
        if (text_.find_first_not_of(" \t\r", at_ + 1) != std::string::npos || !block.words.empty())
          return wrong_("% alone on its line");
        ++at_;
      } else if (c == ';') {
        AddMarker(text_.substr(at_ + 1), &block.markers);
        return absl::OkStatus();
      } else if (c == '(') {
        const std::size_t close = text_.find(')', at_);
        if (close == std::string::npos) return wrong_("a ) that ends the comment");
        AddMarker(text_.substr(at_ + 1, close - at_ - 1), &block.markers);
        at_ = close + 1;
      } else if (IsLetter(at_)) {
        if (absl::Status status = IsLetter(at_ + 1) ? ReadName() : ReadWord(); !status.ok()) return status;
      } else {
        return wrong_(c == '/' ? "no block that may be skipped" : "words of one letter and a number");
      }
    }
    return absl::OkStatus();
  }

  NcReadBlock block;

 private:
  bool IsLetter(std::size_t at) const {
    return at < text_.size() && std::isalpha(static_cast<unsigned char>(text_[at])) != 0;
  }
  bool IsBlank(std::size_t at) const {
    return text_[at] == ' ' || text_[at] == '\t' || (text_[at] == '\r' && at + 1 == text_.size());
  }

  absl::Status ReadName() {
    std::string name;
    for (; IsLetter(at_); ++at_) name += absl::ascii_toupper(text_[at_]);
    if (!knows_names_ || kNames.count(name) == 0)
      return wrong_("words of one letter and a number; no names, calls or statements");
    // TRAORI(2) is another transformation.
    if (at_ < text_.size() && text_[at_] == '(') {
      if (name != "TRAORI" || text_.compare(at_, 3, "(1)") != 0) return wrong_(name + " alone, or TRAORI(1)");
      at_ += 3;
    }
    if (at_ < text_.size() && !IsBlank(at_) && text_[at_] != ';') return wrong_("a blank after " + name);
    block.names.push_back(std::move(name));
    return absl::OkStatus();
  }

  absl::Status ReadWord() {
    NcReadWord word;
    word.address = absl::ascii_toupper(text_[at_++]);
    std::size_t past = at_;
    while (past < text_.size() && absl::ascii_isdigit(text_[past])) ++past;
    if (past > at_ && past < text_.size() && text_[past] == '=') {
      word.address += text_.substr(at_, past - at_);
      at_ = past + 1;
    }
    for (; at_ < text_.size() && !IsLetter(at_) && std::string("(;%").find(text_[at_]) == std::string::npos; ++at_)
      if (!IsBlank(at_)) word.number += text_[at_];
    if (!ToNumber(word.number, &word.value))
      return wrong_("a plain number after " + word.address + "; no variables and no expressions");
    block.words.push_back(std::move(word));
    return absl::OkStatus();
  }

  const std::string& text_;
  const bool knows_names_;
  const Wrong& wrong_;
  std::size_t at_ = 0;
};

}  // namespace

absl::StatusOr<NcReadBlock> ReadNcBlock(const std::string& line, bool knows_names, const Wrong& wrong) {
  Line read(line, knows_names, wrong);
  if (absl::Status status = read.Read(); !status.ok()) return status;
  return std::move(read.block);
}

}  // namespace sixpoint::metrology
