#include "metrology/correction/nc_reader.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "metrology/correction/nc_block.h"
#include "metrology/correction/nc_transformation.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

const std::string kDirectionAddresses = "A3 B3 C3 ";  // where the tool points, while the transformation is on
constexpr double kMmPerInch = 25.4;
constexpr std::size_t kMostCodes = 16;  // of a block; each is compared with each

// G words that change no coordinate: exact stop, planes and cycles of other machining off, feed units, return planes, how an arc's
// centre is written.
const std::set<std::string> kHarmlessG = {"8",  "9",  "17", "40", "49", "50", "60", "61",   "64",  "69",
                                          "80", "93", "94", "95", "97", "98", "99", "90.1", "91.1"};
// Stops, spindle, tool, coolant, clamps, outputs and the program's end. Not M96 to M99 and M128: jumps, calls, tool centre point.
const std::set<int> kHarmlessM = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 19, 30, 48, 49, 62, 63, 64, 65};

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
  Reader(const std::array<char, 2>& rotary, const NcFrame& frame) : axes_(frame.WordsOf(rotary)), frame_(frame) {}

  absl::Status Read(const std::string& program) {
    for (std::size_t begin = 0, end = 0; begin < program.size(); begin = end + 1) {
      end = std::min(program.find('\n', begin), program.size());
      std::string line = program.substr(begin, end - begin);
      ++line_;
      if (line_ == 1 && line.rfind("\xef\xbb\xbf", 0) == 0) line.erase(0, 3);
      text_ = line.substr(0, line.find_last_not_of('\r') + 1);
      const auto block = ReadNcBlock(line, frame_.transformation.has_value(),
                                     [this](const std::string& wanted) { return Wrong(wanted); });
      if (!block.ok()) return block.status();
      if (absl::Status status = Mark(block->markers); !status.ok()) return status;
      if (block->words.empty() && block->names.empty()) continue;
      if (ended_) return Wrong("nothing after the program's end");
      if (absl::Status status = block->names.empty() ? Carry(block->words) : Name(*block); !status.ok()) return status;
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

  absl::Status Mark(const std::vector<std::string>& markers) {
    for (const std::string& marker : markers) {
      if (!target_.empty() && target_ != marker) return Wrong("one marker for a block");
      if (marker.empty()) return Wrong("a marker (SIXPOINT group/hole)");
      target_ = marker;
    }
    return absl::OkStatus();
  }

  int AxisOf(const std::string& address) const {
    const auto found = std::find(axes_.begin(), axes_.end(), address);
    return found == axes_.end() ? -1 : static_cast<int>(found - axes_.begin());
  }

  // A block of names: the control's transformation on or off, and what its directions are of.
  absl::Status Name(const NcReadBlock& block) {
    for (const NcReadWord& word : block.words)
      if (word.address != "N") return Wrong("no " + Named(word) + " beside " + block.names.front());
    if (!target_.empty()) return Wrong("a word of an axis in a marked block");
    for (const std::string& name : block.names) {
      if (name == "TRAORI" && (offset_[3] != 0 || offset_[4] != 0 || TipLess(false) != 0.0))
        return Wrong("no offset of a rotary axis, and the tool's length in force (G43), while TRAORI is on");
      if (name == "TRAORI") transformed_ = true;
      if (name == "TRAFOOF") transformed_ = false;
      if (name == "ORIWKS") on_part_said_ = true;
    }
    return absl::OkStatus();
  }

  // One block.
  absl::Status Carry(const std::vector<NcReadWord>& words) {
    NcPosition said;
    std::array<std::optional<double>, 3> direction;
    Codes codes;
    std::set<std::string> addresses;
    bool switches = false, switches_on = false, changes_tool = false;
    std::optional<double> tool, length;
    std::string centre;  // a word of an arc's
    double path_mm = 0;  // of a G64
    for (const NcReadWord& word : words) {
      if (word.address == "G") {
        if (codes.size() == kMostCodes) return Wrong("at most 16 G words in a block");
        codes.push_back(CodeOf(word.number));
        continue;
      }
      if (word.address == "M") {
        const int code = word.value >= 0 && word.value < 1000 ? static_cast<int>(word.value) : -1;
        if (code != word.value || kHarmlessM.count(code) == 0)
          return Wrong("no " + Named(word) + ", which is not understood");
        ended_ = ended_ || code == 2 || code == 30;
        switches = switches || (code >= 62 && code <= 65);
        switches_on = switches_on || code == 62 || code == 64;
        changes_tool = changes_tool || code == 6;
        continue;
      }
      if (!addresses.insert(word.address).second) return Wrong("the word " + word.address + " once");
      const std::size_t component = kDirectionAddresses.find(word.address + " ");
      if (const int axis = AxisOf(word.address); axis >= 0)
        said[static_cast<std::size_t>(axis)] = word.value;
      else if (transformed_ && component != std::string::npos)
        direction[component / 3] = word.value;
      else if (word.address == "H")
        length = word.value;
      else if (word.address.size() == 1 && std::string("IJKR").find(word.address) != std::string::npos)
        centre = Named(word);
      else if (word.address.size() > 1 || std::string("NFSTOPQ").find(word.address) == std::string::npos)
        return Wrong("no " + Named(word) + ", which is not understood");
      if (word.address == "T") tool = word.value;
      if (word.address == "F") rate_ = word.value;
      if (word.address == "P") path_mm = kMmPerInch * std::abs(word.value);  // in whichever unit, not less
    }
    if (absl::Status status = TakeTool(tool, changes_tool); !status.ok()) return status;
    if (absl::Status status = TakeLength(codes, length); !status.ok()) return status;
    const bool dwells = Holds(codes, "4"), blends = Holds(codes, "64");
    if (blends || Holds(codes, "60") || Holds(codes, "61")) path_tolerance_mm_ = blends ? path_mm : 0;
    const bool moves_axes = Says(said);
    if (addresses.count("P") > 0 && !dwells && !switches && !blends)
      return Wrong("no P but of a dwell (G4), an output (M62 to M65) or a path tolerance (G64)");
    if (addresses.count("Q") > 0 && !blends) return Wrong("no Q but of a path tolerance (G64)");
    if (addresses.count("O") > 0 && (words.front().address != "O" || words.size() > 1))
      return Wrong("O, the program's number, alone");
    if (dwells && moves_axes)
      return Wrong("a dwell by P alone: G4 X is read as a move by one control, as a time by another");
    if (transformed_) {
      if (absl::Status status = CheckTransformed(codes, said, direction); !status.ok()) return status;
    }
    if (absl::Status status = Apply(codes, said, moves_axes); !status.ok()) return status;
    if (transformed_ && moves_axes) {
      if (absl::Status status = Transform(direction); !status.ok()) return status;
    }
    const bool on_arc = arc_ && moves_axes && !Holds(codes, "28") && !Holds(codes, "30");
    if (!centre.empty() && !on_arc) return Wrong("no " + centre + " but of an arc (G2, G3)");
    if (centre.empty() && on_arc) return Wrong("an arc's centre or radius");
    // Once its axes stand where the block sends them, whatever the order of its words.
    if (switches_on) {
      NcMove shot{line_, false,       false, false, true, "", position_, position_, rate_, path_tolerance_mm_,
                  false, motion_said_};
      moves.push_back(std::move(shot));
    }
    return absl::OkStatus();
  }

  // While the transformation is on, the tool goes by feeds from pose to pose, each said whole; all else a control takes in its own way.
  absl::Status CheckTransformed(const Codes& codes, const NcPosition& said,
                                const std::array<std::optional<double>, 3>& direction) const {
    for (const char* const code :
         {"0", "2", "3", "20", "28", "30", "43", "49", "53", "54", "55", "56", "57", "58", "59", "70", "91", "500"})
      if (Holds(codes, code)) return Wrong("no G" + std::string(code) + " while TRAORI is on");
    if (said[3].has_value() || said[4].has_value()) return Wrong("A3, B3 and C3, no rotary axis, while TRAORI is on");
    const bool directed = direction[0].has_value() || direction[1].has_value() || direction[2].has_value();
    if (!directed && !Says(said)) return absl::OkStatus();
    if (!(said[0] && said[1] && said[2] && direction[0] && direction[1] && direction[2]))
      return Wrong("X, Y, Z, A3, B3 and C3 in one block while TRAORI is on");
    if (!on_part_said_) return Wrong("ORIWKS before a direction");
    if (target_.empty() || by_steps_ || inches_) return Wrong("a marked block, G90 and millimetres while TRAORI is on");
    for (const std::optional<double>& axis : position_)
      if (!axis.has_value()) return Wrong("all axes known before a direction");
    return absl::OkStatus();
  }

  // What the last move said of the part becomes what the axes do.
  absl::Status Transform(const std::array<std::optional<double>, 3>& direction) {
    NcMove& move = moves.back();
    const auto axes = AxesOfDirection(*frame_.transformation, {*move.to[0], *move.to[1], *move.to[kNcZ]},
                                      {*direction[0], *direction[1], *direction[2]}, {*move.from[3], *move.from[4]},
                                      [this](const std::string& wanted) { return Wrong(wanted); });
    if (!axes.ok()) return axes.status();
    std::copy(axes->begin(), axes->end(), move.to.begin());
    move.by_direction = true;
    position_ = move.to;
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
    position_[kNcZ].reset();
    return absl::OkStatus();
  }

  absl::Status TakeLength(const Codes& codes, const std::optional<double>& number) {
    const bool sets = Holds(codes, "43");
    if (sets != number.has_value()) return Wrong(sets ? "G43 with its H" : "no H but with G43");
    if (sets && Holds(codes, "49")) return Wrong("one of G43 and G49");
    if (Holds(codes, "49") && added_length_mm_.has_value()) {
      added_length_mm_.reset();
      position_[kNcZ].reset();  // some controls move by the length, others with the next Z
    }
    if (!sets) return absl::OkStatus();
    const absl::StatusOr<double> length_mm = LengthOf('H', *number);
    if (!length_mm.ok()) return length_mm.status();
    if (added_length_mm_ != *length_mm) position_[kNcZ].reset();
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

  static std::string Named(const NcReadWord& word) {
    return word.address + (word.address.size() > 1 ? "=" : "") + word.number;
  }
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
    NcMove move{line_,     feed_,     arc_,  by_steps_,          false, target_,
                position_, position_, rate_, path_tolerance_mm_, false, motion_said_};
    for (std::size_t i = 0; i < kNcAxisCount; ++i) {
      if (!said[i].has_value()) continue;
      const double value = *said[i] * (inches_ && i < 3 ? kMmPerInch : 1);
      std::optional<double>& to = move.to[i];
      if (by_steps_) {
        if (to.has_value()) to = *to + value;
        continue;
      }
      to = value + (in_machine ? 0 : offset_[i]);
      if (i != kNcZ) continue;
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
    NcMove move{line_,     false,     false, by_steps_,          false, "",
                position_, position_, rate_, path_tolerance_mm_, false, motion_said_};
    for (std::size_t i = 0; i < kNcAxisCount; ++i)
      if (said[i].has_value() || !Says(said)) move.to[i].reset();
    position_ = move.to;
    moves.push_back(std::move(move));
    return absl::OkStatus();
  }

  const std::array<std::string, kNcAxisCount> axes_;
  const NcFrame& frame_;
  int line_ = 0;
  std::string text_;
  std::string target_;                               // of a marker whose block is still to come, or has come
  bool transformed_ = false, on_part_said_ = false;  // TRAORI, ORIWKS
  bool feed_ = true, motion_said_ = false, arc_ = false, by_steps_ = false, inches_ = false, ended_ = false;
  std::array<double, kNcAxisCount> offset_{};
  std::optional<double> chosen_tool_, spindle_length_mm_;  // where lengths are stated: by T, and of what M6 or G43 took
  std::optional<double> added_length_mm_;                  // G43; none: G49
  std::optional<double> rate_;
  double path_tolerance_mm_ = 0;
  NcPosition position_;
};

}  // namespace

bool OnlyZ(const NcMove& move) {
  for (std::size_t i = 0; i < move.to.size(); ++i)
    if (i != kNcZ && move.from[i] != move.to[i]) return false;
  return true;
}

absl::StatusOr<std::vector<NcMove>> ReadNcProgram(const std::string& program, const std::array<char, 2>& rotary,
                                                  const NcFrame& frame) {
  Reader reader(rotary, frame);
  if (absl::Status status = reader.Read(program); !status.ok()) return status;
  return std::move(reader.moves);
}

}  // namespace sixpoint::metrology
