#include "metrology/correction/nc_reader.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <set>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kAxes = 5;
constexpr std::size_t kZ = 2;
constexpr double kMmPerInch = 25.4;
constexpr std::size_t kMostCodes = 16;  // of a block; each is compared with each

// G words that change no coordinate: exact stop, planes and cycles of other machining off, feed units, return planes, how an arc's
// centre is written.
const std::set<std::string> kHarmlessG = {"8",  "9",  "17", "40", "49", "50", "60", "61",   "64",  "69",
                                          "80", "93", "94", "95", "97", "98", "99", "90.1", "91.1"};
// Stops, spindle, tool, coolant, clamps, outputs and the program's end. Not M96 to M99 and M128: jumps, calls, tool centre point.
const std::set<int> kHarmlessM = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 19, 30, 48, 49, 62, 63, 64, 65};

struct ReadWord {
  char letter = 0;
  std::string number;  // as it stands, without blanks
  double value = 0;
};

struct ReadLine {
  std::vector<ReadWord> words;
  std::vector<std::string> markers;
};

using Codes = std::vector<std::string>;
bool Holds(const Codes& codes, const char* code) { return std::find(codes.begin(), codes.end(), code) != codes.end(); }

std::string Shown(const std::string& text) {
  std::string shown = text.substr(0, 60);
  for (char& c : shown)
    if (c < 0x20 || c > 0x7e) c = '?';
  return shown;
}

// "01" -> "1", "43.40" stays: a code, not a quantity.
std::string CodeOf(const std::string& number) {
  const std::size_t first = number.find_first_not_of('0');
  if (first == std::string::npos) return "0";
  return number[first] == '.' ? "0" + number.substr(first) : number.substr(first);
}

class Reader {
 public:
  Reader(const std::array<char, 2>& rotary, const NcFrame& frame)
      : axes_{'X', 'Y', 'Z', rotary[0], rotary[1]}, frame_(frame) {}

  absl::Status Read(const std::string& program) {
    for (std::size_t begin = 0, end = 0; begin < program.size(); begin = end + 1) {
      end = std::min(program.find('\n', begin), program.size());
      std::string line = program.substr(begin, end - begin);
      ++line_;
      if (line_ == 1 && line.rfind("\xef\xbb\xbf", 0) == 0) line.erase(0, 3);
      text_ = line.substr(0, line.find_last_not_of('\r') + 1);
      ReadLine read;
      if (absl::Status status = Split(line, &read); !status.ok()) return status;
      if (absl::Status status = Mark(read.markers); !status.ok()) return status;
      if (read.words.empty()) continue;
      if (ended_) return Wrong("nothing after the program's end");
      if (absl::Status status = Carry(read.words); !status.ok()) return status;
      target_.clear();
    }
    if (!target_.empty()) return Wrong("a block after the marker of " + target_);
    return absl::OkStatus();
  }

  std::vector<NcMove> moves;

 private:
  absl::Status Wrong(const std::string& wanted) const {
    return Refuse("nc_template", "line " + std::to_string(line_) + ": \"" + Shown(text_) + "\"", wanted);
  }

  // Comments apart from words. A word is one letter and a plain number.
  absl::Status Split(const std::string& line, ReadLine* out) const {
    std::size_t i = 0;
    const auto at_letter = [&](std::size_t at) {
      return at < line.size() && std::isalpha(static_cast<unsigned char>(line[at])) != 0;
    };
    while (i < line.size()) {
      const char c = line[i];
      if (c == ' ' || c == '\t' || (c == '\r' && i + 1 == line.size())) {
        ++i;
      } else if (c == '%') {
        if (line.find_first_not_of(" \t\r", i + 1) != std::string::npos || !out->words.empty())
          return Wrong("% alone on its line");
        ++i;
      } else if (c == ';') {
        AddMarker(line.substr(i + 1), &out->markers);
        return absl::OkStatus();
      } else if (c == '(') {
        const std::size_t close = line.find(')', i);
        if (close == std::string::npos) return Wrong("a ) that ends the comment");
        AddMarker(line.substr(i + 1, close - i - 1), &out->markers);
        i = close + 1;
      } else if (at_letter(i)) {
        if (at_letter(i + 1)) return Wrong("words of one letter and a number; no names, calls or statements");
        ReadWord word;
        word.letter = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        for (++i; i < line.size() && !at_letter(i) && std::string("(;%").find(line[i]) == std::string::npos; ++i)
          if (line[i] != ' ' && line[i] != '\t' && (line[i] != '\r' || i + 1 < line.size())) word.number += line[i];
        if (!ToNumber(word.number, &word.value))
          return Wrong(std::string("a plain number after ") + word.letter + "; no variables and no expressions");
        out->words.push_back(word);
      } else {
        return Wrong(c == '/' ? "no block that may be skipped" : "words of one letter and a number");
      }
    }
    return absl::OkStatus();
  }

  static bool ToNumber(const std::string& text, double* value) {
    const std::string digits = text.rfind('+', 0) == 0 ? text.substr(1) : text;
    if (digits.empty() || digits.find_first_not_of("-.0123456789") != std::string::npos) return false;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), *value, std::chars_format::fixed);
    return read.ec == std::errc() && read.ptr == digits.data() + digits.size();
  }

  static void AddMarker(const std::string& comment, std::vector<std::string>* markers) {
    constexpr char kBlank[] = " \t\r";
    const std::size_t begin = comment.find_first_not_of(kBlank);
    if (begin == std::string::npos) return;
    const std::size_t end = std::min(comment.find_first_of(kBlank, begin), comment.size());
    std::string word = comment.substr(begin, end - begin);
    for (char& c : word) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    if (word != "SIXPOINT") return;
    const std::size_t name = std::min(comment.find_first_not_of(kBlank, end), comment.size());
    const std::size_t last = comment.find_last_not_of(kBlank);
    markers->push_back(name > last ? std::string() : comment.substr(name, last - name + 1));
  }

  absl::Status Mark(const std::vector<std::string>& markers) {
    for (const std::string& marker : markers) {
      if (!target_.empty() && target_ != marker) return Wrong("one marker for a block");
      if (marker.empty()) return Wrong("a marker (SIXPOINT group/hole)");
      target_ = marker;
    }
    return absl::OkStatus();
  }

  int AxisOf(char letter) const {
    for (int i = 0; i < kAxes; ++i)
      if (axes_[static_cast<std::size_t>(i)] == letter) return i;
    return -1;
  }

  // One block.
  absl::Status Carry(const std::vector<ReadWord>& words) {
    NcPosition said;
    Codes codes;
    std::string letters;
    bool switches = false, switches_on = false, changes_tool = false;
    std::optional<double> tool, length;
    std::string centre;  // a word of an arc's
    double path_mm = 0;  // of a G64
    for (const ReadWord& word : words) {
      if (word.letter == 'G') {
        if (codes.size() == kMostCodes) return Wrong("at most 16 G words in a block");
        codes.push_back(CodeOf(word.number));
        continue;
      }
      if (word.letter == 'M') {
        const int code = word.value >= 0 && word.value < 1000 ? static_cast<int>(word.value) : -1;
        if (code != word.value || kHarmlessM.count(code) == 0)
          return Wrong("no " + Named(word) + ", which is not understood");
        ended_ = ended_ || code == 2 || code == 30;
        switches = switches || (code >= 62 && code <= 65);
        switches_on = switches_on || code == 62 || code == 64;
        changes_tool = changes_tool || code == 6;
        continue;
      }
      if (letters.find(word.letter) != std::string::npos)
        return Wrong(std::string("the word ") + word.letter + " once");
      letters += word.letter;
      if (const int axis = AxisOf(word.letter); axis >= 0)
        said[static_cast<std::size_t>(axis)] = word.value;
      else if (word.letter == 'H')
        length = word.value;
      else if (std::string("IJKR").find(word.letter) != std::string::npos)
        centre = Named(word);
      else if (std::string("NFSTOPQ").find(word.letter) == std::string::npos)
        return Wrong("no " + Named(word) + ", which is not understood");
      if (word.letter == 'T') tool = word.value;
      if (word.letter == 'F') rate_ = word.value;
      if (word.letter == 'P') path_mm = kMmPerInch * std::abs(word.value);  // in whichever unit, not less
    }
    if (absl::Status status = TakeTool(tool, changes_tool); !status.ok()) return status;
    if (absl::Status status = TakeLength(codes, length); !status.ok()) return status;
    const bool dwells = Holds(codes, "4"), blends = Holds(codes, "64");
    if (blends || Holds(codes, "60") || Holds(codes, "61")) path_tolerance_mm_ = blends ? path_mm : 0;
    const bool moves_axes = Says(said);
    if (letters.find('P') != std::string::npos && !dwells && !switches && !blends)
      return Wrong("no P but of a dwell (G4), an output (M62 to M65) or a path tolerance (G64)");
    if (letters.find('Q') != std::string::npos && !blends) return Wrong("no Q but of a path tolerance (G64)");
    if (letters.find('O') != std::string::npos && (words.front().letter != 'O' || words.size() > 1))
      return Wrong("O, the program's number, alone");
    if (dwells && moves_axes)
      return Wrong("a dwell by P alone: G4 X is read as a move by one control, as a time by another");
    if (absl::Status status = Apply(codes, said, moves_axes); !status.ok()) return status;
    const bool on_arc = arc_ && moves_axes && !Holds(codes, "28") && !Holds(codes, "30");
    if (!centre.empty() && !on_arc) return Wrong("no " + centre + " but of an arc (G2, G3)");
    if (centre.empty() && on_arc) return Wrong("an arc's centre or radius");
    // Once its axes stand where the block sends them, whatever the order of its words.
    if (switches_on) {
      NcMove shot{line_, false, false, false, true, "", position_, position_, rate_, path_tolerance_mm_, motion_said_};
      moves.push_back(std::move(shot));
    }
    return absl::OkStatus();
  }

  // By its number, what is stated of it.
  absl::StatusOr<double> LengthOf(char letter, double number) const {
    for (const auto& [stated, length_mm] : frame_.tool_lengths_mm)
      if (stated == number) return length_mm;
    char name[32];
    std::snprintf(name, sizeof name, "%c%g", letter, number);
    return Wrong(std::string(name) + " stated with the tool's length");
  }

  // T chooses, M6 puts it into the spindle: another tool's tip is elsewhere.
  absl::Status TakeTool(const std::optional<double>& tool, bool changes) {
    if (frame_.tool_lengths_mm.empty()) return absl::OkStatus();
    if (tool.has_value()) chosen_tool_ = tool;
    if (!changes) return absl::OkStatus();
    if (!chosen_tool_.has_value()) return Wrong("a T for its M6");
    const absl::StatusOr<double> length_mm = LengthOf('T', *chosen_tool_);
    if (!length_mm.ok()) return length_mm.status();
    spindle_length_mm_ = *length_mm;
    position_[kZ].reset();
    return absl::OkStatus();
  }

  absl::Status TakeLength(const Codes& codes, const std::optional<double>& number) {
    const bool sets = Holds(codes, "43");
    if (sets != number.has_value()) return Wrong(sets ? "G43 with its H" : "no H but with G43");
    if (sets && Holds(codes, "49")) return Wrong("one of G43 and G49");
    if (Holds(codes, "49") && added_length_mm_.has_value()) {
      added_length_mm_.reset();
      position_[kZ].reset();  // some controls move by the length, others with the next Z
    }
    if (!sets) return absl::OkStatus();
    const absl::StatusOr<double> length_mm = LengthOf('H', *number);
    if (!length_mm.ok()) return length_mm.status();
    if (added_length_mm_ != *length_mm) position_[kZ].reset();
    added_length_mm_ = *length_mm;
    // A program that does not say what is in the spindle has the tool that it takes the length of.
    if (!spindle_length_mm_.has_value()) spindle_length_mm_ = *length_mm;
    return absl::OkStatus();
  }

  // What the tip's Z is more than the coordinate that the control is given; none: no tool is known.
  std::optional<double> TipLess(bool in_machine) const {
    if (frame_.tool_lengths_mm.empty()) return 0;
    if (!spindle_length_mm_.has_value()) return std::nullopt;
    return (in_machine ? 0 : added_length_mm_.value_or(0)) - *spindle_length_mm_;
  }

  static std::string Named(const ReadWord& word) { return std::string(1, word.letter) + word.number; }
  static bool Says(const NcPosition& said) {
    for (const auto& value : said)
      if (value.has_value()) return true;
    return false;
  }

  absl::Status Apply(const Codes& codes, const NcPosition& said, bool moves_axes) {
    bool in_machine = false, homes = false;
    for (const std::string& code : codes) {
      if (code == "0" || code == "1" || code == "2" || code == "3") {
        if (Holds(codes, "0") + Holds(codes, "1") + Holds(codes, "2") + Holds(codes, "3") > 1)
          return Wrong("one of G0, G1, G2 and G3");
        feed_ = code != "0";
        motion_said_ = true;
        arc_ = code == "2" || code == "3";
      } else if (code == "90" || code == "91") {
        if (Holds(codes, "90") && Holds(codes, "91")) return Wrong("one of G90 and G91");
        by_steps_ = code == "91";
      } else if (code == "20" || code == "70" || code == "21" || code == "71") {
        inches_ = code == "20" || code == "70";
      } else if (code == "53") {
        in_machine = true;
      } else if (code == "28" || code == "30") {
        homes = true;
      } else if (code == "500") {
        offset_ = {};
      } else if (code == "54" || code == "55" || code == "56" || code == "57" || code == "58" || code == "59") {
        const auto stated = frame_.work_offsets.find("G" + code);
        if (stated == frame_.work_offsets.end()) return Wrong("G" + code + " stated with its offset, zero or not");
        offset_ = stated->second;
      } else if (code != "4" && code != "43" && kHarmlessG.count(code) == 0) {
        return Wrong("no G" + code + ", which is not understood");
      }
    }
    if (homes && (Holds(codes, "2") || Holds(codes, "3"))) return Wrong("no arc (G2, G3) beside G28 and G30");
    if (homes) return Home(said);
    if (in_machine && by_steps_) return Wrong("no steps (G91) in the machine's coordinates (G53)");
    if (!moves_axes) return target_.empty() ? absl::OkStatus() : Wrong("a word of an axis in a marked block");
    NcMove move{line_,     feed_,     arc_,  by_steps_,          false,       target_,
                position_, position_, rate_, path_tolerance_mm_, motion_said_};
    for (std::size_t i = 0; i < kAxes; ++i) {
      if (!said[i].has_value()) continue;
      const double value = *said[i] * (inches_ && i < 3 ? kMmPerInch : 1);
      std::optional<double>& to = move.to[i];
      if (by_steps_) {
        if (to.has_value()) to = *to + value;
        continue;
      }
      to = value + (in_machine ? 0 : offset_[i]);
      if (i != kZ) continue;
      if (const std::optional<double> tip = TipLess(in_machine); tip.has_value())
        to = *to + *tip;
      else
        to.reset();
    }
    position_ = move.to;
    moves.push_back(std::move(move));
    return absl::OkStatus();
  }

  // To where the machine's maker put it: by rapid, over a point that nobody checks.
  absl::Status Home(const NcPosition& said) {
    if (!target_.empty()) return Wrong("no return to the reference (G28, G30) in a marked block");
    for (const std::optional<double>& value : said)
      if (value.has_value() && (!by_steps_ || *value != 0))
        return Wrong("G28 and G30 of all axes, or by no step (G91 G28 Z0): else they go over a point first");
    NcMove move{line_,     false,     false, by_steps_,          false,       "",
                position_, position_, rate_, path_tolerance_mm_, motion_said_};
    for (std::size_t i = 0; i < kAxes; ++i)
      if (said[i].has_value() || !Says(said)) move.to[i].reset();
    position_ = move.to;
    moves.push_back(std::move(move));
    return absl::OkStatus();
  }

  const std::array<char, kAxes> axes_;
  const NcFrame& frame_;
  int line_ = 0;
  std::string text_;
  std::string target_;  // of a marker whose block is still to come, or has come
  bool feed_ = true, motion_said_ = false, arc_ = false, by_steps_ = false, inches_ = false, ended_ = false;
  std::array<double, kAxes> offset_{};
  std::optional<double> chosen_tool_, spindle_length_mm_;  // where lengths are stated: by T, and of what M6 or G43 took
  std::optional<double> added_length_mm_;                  // G43; none: G49
  std::optional<double> rate_;
  double path_tolerance_mm_ = 0;
  NcPosition position_;
};

}  // namespace

bool OnlyZ(const NcMove& move) {
  for (std::size_t i = 0; i < move.to.size(); ++i)
    if (i != kZ && move.from[i] != move.to[i]) return false;
  return true;
}

absl::StatusOr<std::vector<NcMove>> ReadNcProgram(const std::string& program, const std::array<char, 2>& rotary,
                                                  const NcFrame& frame) {
  Reader reader(rotary, frame);
  if (absl::Status status = reader.Read(program); !status.ok()) return status;
  return std::move(reader.moves);
}

}  // namespace sixpoint::metrology
