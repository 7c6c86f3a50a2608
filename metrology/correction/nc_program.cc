#include "metrology/correction/nc_program.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kLeastDecimals = 4, kMostDecimals = 9;

bool IsLetter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

absl::Status RefuseLine(int line, std::string_view found, const std::string& wanted) {
  std::string text(found.substr(0, 60));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = '?';
  return Refuse("nc_template", "line " + std::to_string(line) + ": \"" + text + "\"", wanted);
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// The text after the word SIXPOINT (any case) of a comment that is a marker.
std::optional<std::string_view> MarkerOf(std::string_view comment) {
  constexpr std::string_view kWord = "SIXPOINT";
  comment = Trimmed(comment);
  if (comment.size() < kWord.size()) return std::nullopt;
  for (std::size_t i = 0; i < kWord.size(); ++i)
    if (absl::ascii_toupper(comment[i]) != kWord[i]) return std::nullopt;
  return Trimmed(comment.substr(kWord.size()));
}

// One word of a block: its address and what follows it up to the next letter, comment or end.
struct Word {
  std::string address;             // as NcWord's
  std::size_t begin = 0, end = 0;  // of the value, blanks trimmed, within the line
};

struct Block {
  std::vector<Word> words;
  std::vector<std::string_view> markers;
};

// Words that have no value, and are not taken for letters.
constexpr std::array<std::string_view, 4> kWordsWithoutValue = {"TRAORI", "TRAFOOF", "ORIWKS", "ORIVECT"};

std::optional<std::string_view> NameAt(std::string_view line, std::size_t at) {
  std::size_t end = at;
  while (end < line.size() && IsLetter(line[end])) ++end;
  for (const std::string_view name : kWordsWithoutValue)
    if (name.size() == end - at && std::equal(name.begin(), name.end(), line.begin() + static_cast<std::ptrdiff_t>(at),
                                              [](char one, char other) { return one == absl::ascii_toupper(other); }))
      return name;
  return std::nullopt;
}

// "A3" of "A3=0.5"; "A" of all else that begins so.
std::string AddressAt(std::string_view line, std::size_t at) {
  std::size_t end = at + 1;
  while (end < line.size() && absl::ascii_isdigit(line[end])) ++end;
  const bool has_number = end > at + 1 && end < line.size() && line[end] == '=';
  std::string address(line.substr(at, has_number ? end - at : 1));
  address[0] = absl::ascii_toupper(address[0]);
  return address;
}

// Splits a line; comments stand in brackets or after a semicolon. An open bracket reaches to the end of the line.
Block Split(std::string_view line) {
  Block block;
  std::size_t i = 0;
  while (i < line.size()) {
    const char c = line[i];
    if (c == '(' || c == ';') {
      const std::size_t close = c == '(' ? line.find(')', i) : std::string_view::npos;
      const std::size_t end = std::min(close, line.size());
      if (const auto marker = MarkerOf(line.substr(i + 1, end - i - 1))) block.markers.push_back(*marker);
      i = close == std::string_view::npos ? line.size() : close + 1;
    } else if (const auto name = NameAt(line, i)) {
      i += name->size();
      block.words.push_back({std::string(*name), i, i});
    } else if (IsLetter(c)) {
      std::string address = AddressAt(line, i);
      std::size_t begin = i + address.size() + (address.size() > 1 ? 1 : 0), end = begin;
      while (end < line.size() && !IsLetter(line[end]) && line[end] != '(' && line[end] != ';') ++end;
      i = end;
      while (begin < end && IsBlank(line[begin])) ++begin;
      while (end > begin && IsBlank(line[end - 1])) --end;
      block.words.push_back({std::move(address), begin, end});
    } else {
      ++i;
    }
  }
  return block;
}

// Decimals of a plain number [+-]digits[.digits]; none when it is not one.
std::optional<int> DecimalsOf(std::string_view value) {
  std::size_t i = 0;
  if (i < value.size() && (value[i] == '+' || value[i] == '-')) ++i;
  int digits = 0, decimals = 0;
  while (i < value.size() && absl::ascii_isdigit(value[i])) ++i, ++digits;
  if (i < value.size() && value[i] == '.') {
    ++i;
    while (i < value.size() && absl::ascii_isdigit(value[i])) ++i, ++digits, ++decimals;
  }
  if (digits == 0 || i != value.size()) return std::nullopt;
  return decimals;
}

std::string Formatted(double value, int decimals, bool plus) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", std::clamp(decimals, kLeastDecimals, kMostDecimals), value);
  std::string text = buffer;
  // Rounded to nothing: no sign.
  if (text.front() == '-' && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);
  if (plus && text.front() != '-') text.insert(text.begin(), '+');
  return text;
}

// What the words of one target become, by their addresses.
using Values = std::map<std::string, double>;

Values ValuesOf(const NcTarget& target, const std::array<std::string, 5>& words,
                const std::array<double, 5>& offset = {}) {
  return {{words[0], target.x_mm - offset[0]},
          {words[1], target.y_mm - offset[1]},
          {words[2], target.z_mm - offset[2]},
          {words[3], target.a_deg - offset[3]},
          {words[4], target.b_deg - offset[4]}};
}

// Where the transformation is on: the point and the direction on the part that it brings to the target.
Values PartValuesOf(const NcTarget& target, const std::array<std::string, 5>& words,
                    const std::array<double, 5>& offset, const RotaryAxes& transformation) {
  const Eigen::Isometry3d part_from_machine =
      transformation.MachineFromZero(target.a_deg * kRadPerDeg, target.b_deg * kRadPerDeg).inverse();
  const Eigen::Vector3d point_mm = part_from_machine * Eigen::Vector3d(target.x_mm, target.y_mm, target.z_mm);
  const Eigen::Vector3d direction = part_from_machine.linear().col(2);
  return {{words[0], point_mm.x() - offset[0]},
          {words[1], point_mm.y() - offset[1]},
          {words[2], point_mm.z() - offset[2]},
          {"A3", direction.x()},
          {"B3", direction.y()},
          {"C3", direction.z()}};
}

// Modal states that change what a coordinate means.
struct Modes {
  bool increments = false, inches = false, in_machine = false, transformed = false;
  std::array<double, 5> work_offset{};
  const NcFrame& frame;
  explicit Modes(const NcFrame& stated) : frame(stated) {}
  std::array<double, 5> Offset() const { return in_machine ? std::array<double, 5>() : work_offset; }

  void Read(std::string_view line, const std::vector<Word>& words) {
    in_machine = false;
    for (const Word& word : words) {
      if (word.address == "TRAORI") transformed = true;
      if (word.address == "TRAFOOF") transformed = false;
      if (word.address != "G") continue;
      const std::string_view code = line.substr(word.begin, word.end - word.begin);
      if (code == "90") increments = false;
      if (code == "91") increments = true;
      if (code == "20" || code == "70") inches = true;
      if (code == "21" || code == "71") inches = false;
      if (code == "53") in_machine = true;
      if (code == "500") work_offset = {};
      const auto stated = frame.work_offsets.find("G" + std::string(code));
      if (stated != frame.work_offsets.end()) work_offset = stated->second;
    }
  }
};

absl::StatusOr<std::string> ReplacedLine(std::string_view line, const std::vector<Word>& words, const Values& values,
                                         int line_number) {
  std::string result;
  std::set<std::string> seen;
  std::size_t copied = 0;
  for (const Word& word : words) {
    const auto wanted = values.find(word.address);
    if (wanted == values.end()) continue;
    if (!seen.insert(word.address).second)
      return RefuseLine(line_number, line, "the word " + word.address + " once in a marked block");
    const std::string_view value = line.substr(word.begin, word.end - word.begin);
    const auto decimals = DecimalsOf(value);
    if (!decimals) {
      return RefuseLine(line_number, word.address + std::string(value),
                        "a plain number such as -12.3456 in a marked block");
    }
    result.append(line.substr(copied, word.begin - copied));
    result += Formatted(wanted->second, *decimals, value.front() == '+');
    copied = word.end;
  }
  if (seen.empty()) {
    std::string wanted;
    for (const std::string first : {"X", "Y", "Z", ""})
      for (const auto& [address, value] : values)
        if (first.empty() ? address != "X" && address != "Y" && address != "Z" : address == first)
          wanted += address + " ";
    return RefuseLine(line_number, line, "at least one of the words " + wanted + "in a marked block");
  }
  result.append(line.substr(copied));
  return result;
}

// What the words of a marker's hole become in those modes; none: it is no hole.
using ValuesOfMarker = std::function<std::optional<Values>(std::string_view marker, const Modes&)>;

absl::StatusOr<std::string> Replaced(const std::string& nc_template, const ValuesOfMarker& values_of,
                                     const NcFrame& frame) {
  std::string program;
  program.reserve(nc_template.size() + 4096);
  Modes modes(frame);
  std::optional<std::pair<std::string, int>> pending;  // marker waiting for its block, and the marker's line
  int marked = 0, line_number = 0;
  for (std::size_t begin = 0; begin < nc_template.size();) {
    const std::size_t newline = nc_template.find('\n', begin);
    const std::size_t end = newline == std::string::npos ? nc_template.size() : newline;
    const std::string_view line(nc_template.data() + begin, end - begin);
    ++line_number;
    const Block block = Split(line);
    modes.Read(line, block.words);
    for (const std::string_view marker : block.markers) {
      if (pending) return RefuseLine(line_number, line, "one marker for a block");
      if (!values_of(marker, modes).has_value())
        return RefuseLine(line_number, line, "a marker (SIXPOINT group/hole) of a corrected hole");
      pending.emplace(std::string(marker), line_number);
    }
    if (pending && !block.words.empty()) {
      if (modes.transformed && !frame.transformation.has_value())
        return RefuseLine(line_number, line, "no TRAORI: the control's transformation is not stated");
      if (modes.increments) return RefuseLine(line_number, line, "absolute coordinates (G90) in a marked block");
      if (modes.inches) return RefuseLine(line_number, line, "millimetres (G21 or G71) in a marked block");
      const std::optional<Values> values = values_of(pending->first, modes);
      auto replaced = ReplacedLine(line, block.words, values.value_or(Values()), line_number);
      if (!replaced.ok()) return replaced.status();
      program += *replaced;
      pending.reset();
      ++marked;
    } else {
      program += line;
    }
    if (newline != std::string::npos) program += '\n';
    begin = newline == std::string::npos ? nc_template.size() : newline + 1;
  }
  if (pending) return RefuseLine(pending->second, "SIXPOINT " + pending->first, "a block after the marker");
  if (marked == 0) return Refuse("nc_template", "no marked block", "at least one (SIXPOINT group/hole)");
  return program;
}

}  // namespace

absl::StatusOr<std::string> ReplaceCoordinates(const std::string& nc_template,
                                               const std::map<std::string, NcTarget>& targets,
                                               const RotaryLetters& rotary, const NcFrame& frame) {
  const std::array<std::string, 5> words = frame.WordsOf(rotary);
  for (const auto& [name, target] : targets)
    for (const auto& [address, value] : ValuesOf(target, words))
      if (!(std::abs(value) < 1e6))
        return Refuse("targets[" + name + "]." + address, value, "a finite coordinate below 1e6");
  return Replaced(
      nc_template,
      [&](std::string_view marker, const Modes& modes) -> std::optional<Values> {
        const auto target = targets.find(std::string(marker));
        if (target == targets.end()) return std::nullopt;
        return modes.transformed && frame.transformation.has_value()
                   ? PartValuesOf(target->second, words, modes.Offset(), *frame.transformation)
                   : ValuesOf(target->second, words, modes.Offset());
      },
      frame);
}

absl::Status CheckTemplate(const std::string& nc_template, const std::set<std::string>& holes, const NcFrame& frame) {
  std::set<std::string> missing = holes;
  Values any;
  for (const char* const word : {"X", "Y", "Z", "A", "B", "C", "A3", "B3", "C3"}) any[word] = 0;
  if (!frame.axis_words[0].empty()) {
    any = {{"A3", 0}, {"B3", 0}, {"C3", 0}};
    for (const std::string& word : frame.axis_words) any[word] = 0;
  }
  const auto any_word = [&](std::string_view marker, const Modes&) -> std::optional<Values> {
    if (holes.count(std::string(marker)) == 0) return std::nullopt;
    missing.erase(std::string(marker));
    return any;
  };
  const absl::StatusOr<std::string> replaced = Replaced(nc_template, any_word, frame);
  if (!replaced.ok()) return replaced.status();
  if (missing.empty()) return absl::OkStatus();
  return Refuse("nc_template", "no block marked (SIXPOINT " + *missing.begin() + ")", "one at least of each hole");
}

std::vector<NcLine> LinesOf(const std::string& program) {
  std::vector<NcLine> lines;
  for (std::size_t begin = 0, end = 0; begin < program.size(); begin = end) {
    const std::size_t newline = program.find('\n', begin);
    end = newline == std::string::npos ? program.size() : newline + 1;
    NcLine& line = lines.emplace_back();
    line.text = program.substr(begin, end - begin);
    const std::string_view text(program.data() + begin, (newline == std::string::npos ? end : newline) - begin);
    const Block block = Split(text);
    if (!block.markers.empty()) line.marker = std::string(block.markers.front());
    for (const Word& word : block.words)
      line.words.push_back({word.address, std::string(text.substr(word.begin, word.end - word.begin))});
  }
  return lines;
}

}  // namespace sixpoint::metrology
