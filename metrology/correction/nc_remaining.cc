#include "metrology/correction/nc_remaining.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>

#include "metrology/correction/nc_program.h"

namespace sixpoint::metrology {
namespace {

absl::Status NotDivisible(int line, const std::string& why) {
  return absl::FailedPreconditionError("nc_program: line " + std::to_string(line) + ": " + why);
}

// Cuts, steps or is marked: belongs to a hole.
bool Works(const NcMove& move) { return !move.target.empty() || move.by_steps || move.switches_on; }

// What a line does beside moving, that something later may need: it cannot go. Outputs (M62 to M65) are a hole's own.
std::optional<std::string> Needed(const NcLine& line) {
  static const std::set<std::string> kMoves = {"0",  "1",  "4",  "20", "21", "53", "54", "55", "56",
                                               "57", "58", "59", "70", "71", "90", "91", "500"};
  for (const NcWord& word : line.words) {
    if (word.address == "G") {
      const std::size_t first = std::min(word.value.find_first_not_of('0'), word.value.size() - 1);
      if (word.value.empty() || kMoves.count(word.value.substr(first)) == 0) return "G" + word.value;
    }
    if (word.address == "M" && word.value != "62" && word.value != "63" && word.value != "64" && word.value != "65")
      return "M" + word.value;
    if (word.address == "S" || word.address == "T" || word.address == "H" || word.address == "O")
      return word.address + word.value;
  }
  return std::nullopt;
}

std::string GroupOf(const std::string& hole) { return hole.substr(0, hole.find('/')); }

// Which of the five the line has a word for.
std::array<bool, 5> SaidIn(const NcLine& line, const std::array<std::string, 5>& axis_words) {
  std::array<bool, 5> said{};
  for (const NcWord& word : line.words) {
    if (word.address == "A3" || word.address == "B3" || word.address == "C3") return {true, true, true, true, true};
    for (std::size_t i = 0; i < said.size(); ++i) said[i] = said[i] || word.address == axis_words[i];
  }
  return said;
}

// The line with its marker naming another hole.
std::string Remarked(const NcLine& line, const std::string& hole) {
  std::string upper = line.text;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::string text = line.text;
  return text.replace(text.find(line.marker, upper.find("SIXPOINT")), line.marker.size(), hole);
}

class Divider {
 public:
  Divider(const std::vector<NcLine>& lines, const std::vector<NcMove>& moves, const std::set<std::string>& cut,
          const std::array<std::string, 5>& axis_words, const std::map<std::string, NcTarget>& targets)
      : lines_(lines),
        cut_(cut),
        axis_words_(axis_words),
        targets_(targets),
        keep_(lines.size(), true),
        next_kept_(lines.size()) {
    std::string next;
    for (std::size_t i = lines.size(); i-- > 0; next_kept_[i] = next)
      if (!lines[i].marker.empty() && cut.count(lines[i].marker) == 0) next = lines[i].marker;
    for (const NcMove& move : moves) moves_[move.line].push_back(&move);
  }

  absl::Status Divide() {
    for (std::size_t first = 0; first < lines_.size();) {
      const std::string& hole = lines_[first].marker;
      std::size_t past = first + 1;
      while (past < lines_.size() && (lines_[past].marker.empty() || OneWork(lines_[past].marker, hole))) ++past;
      if (!hole.empty() && cut_.count(hole) > 0) {
        if (absl::Status status = Drop(first, past); !status.ok()) return status;
      } else {
        for (std::size_t i = first; i < past; ++i) StandAfter(i);
      }
      first = past;
    }
    return absl::OkStatus();
  }

  const std::vector<bool>& keep() const { return keep_; }
  // By line, from 0: the hole of the same group that a turn is for now.
  const std::map<std::size_t, std::string>& remarked() const { return remarked_; }

 private:
  const std::vector<const NcMove*>& MovesAt(std::size_t line) {
    static const std::vector<const NcMove*> kNone;
    const auto found = moves_.find(static_cast<int>(line) + 1);
    return found == moves_.end() ? kNone : found->second;
  }

  // The same hole, or poses of the same path: what one of them switches on, a later one may switch off.
  bool OneWork(const std::string& one, const std::string& other) const {
    if (one == other) return true;
    const auto first = targets_.find(one), second = targets_.find(other);
    return first != targets_.end() && second != targets_.end() && first->second.number != 0 &&
           second->second.number != 0 && first->second.path == second->second.path;
  }

  void StandAfter(std::size_t line) {
    for (const NcWord& word : lines_[line].words)
      if (word.address == "M" && (word.value == "6" || word.value == "06")) height_mm_.reset();  // another tool's tip
    for (const NcMove* move : MovesAt(line)) height_mm_ = move->to[kNcZ];
  }

  // A hole's blocks, from its marker to where it is last worked at, with the waits and outputs that follow at once. Of what comes
  // then, retracts stay that lead higher than the tool stands without the hole.
  absl::Status Drop(std::size_t first, std::size_t past) {
    std::size_t worked = first;
    for (std::size_t i = first; i < past; ++i) {
      const auto& moves = MovesAt(i);
      if (!lines_[i].marker.empty() ||
          std::any_of(moves.begin(), moves.end(), [](const NcMove* m) { return Works(*m); }))
        worked = i + 1;
    }
    while (worked < past && MovesAt(worked).empty() && !Needed(lines_[worked]).has_value() &&
           !lines_[worked].words.empty())
      ++worked;
    if (absl::Status status = CheckOutputs(first, worked); !status.ok()) return status;
    const std::string heir = HeirOf(past, lines_[first].marker);
    for (std::size_t i = first; i < worked; ++i) {
      if (!heir.empty() && TurnsOnly(i)) {
        remarked_[i] = heir;
        continue;
      }
      if (const auto needed = Needed(lines_[i]))
        return NotDivisible(static_cast<int>(i) + 1, *needed + " among the blocks of " + lines_[first].marker +
                                                         ", want it where no hole is cut");
      keep_[i] = lines_[i].words.empty() && lines_[i].marker.empty();
    }
    for (std::size_t i = worked; i < past; ++i) {
      const auto& moves = MovesAt(i);
      const bool only_z = moves.size() == 1 && OnlyZ(*moves[0]) && moves[0]->from[kNcZ] != moves[0]->to[kNcZ] &&
                          moves[0]->to[kNcZ].has_value();
      if (only_z && !height_mm_.has_value())
        return NotDivisible(static_cast<int>(i) + 1,
                            "a retract from where nobody knows, want Z raised before " + lines_[first].marker);
      if (only_z && *moves[0]->to[kNcZ] <= *height_mm_) {
        if (const auto needed = Needed(lines_[i]))
          return NotDivisible(static_cast<int>(i) + 1, *needed + " in a retract");
        keep_[i] = false;
      } else {
        StandAfter(i);
      }
    }
    return absl::OkStatus();
  }

  // What a hole switches on it switches off again, the transformation too: nothing else is left as it would not have been.
  absl::Status CheckOutputs(std::size_t first, std::size_t worked) const {
    std::set<std::string> on;
    bool transformed = false;
    for (std::size_t i = first; i < worked; ++i) {
      std::string output, code;
      for (const NcWord& word : lines_[i].words) {
        if (word.address == "TRAFOOF" && !transformed)
          return NotDivisible(static_cast<int>(i) + 1, "TRAFOOF for a TRAORI of another block");
        if (word.address == "TRAORI" || word.address == "TRAFOOF") transformed = word.address == "TRAORI";
        if (word.address == "P") output = word.value;
        if (word.address == "M") code = word.value;
      }
      const bool off = code == "63" || code == "65";
      if (code == "62" || code == "64") on.insert(output);
      if (off && on.erase(output) == 0)
        return NotDivisible(static_cast<int>(i) + 1, "switches off what another block switched on");
    }
    if (transformed) return NotDivisible(static_cast<int>(first) + 1, "TRAORI stays on after " + lines_[first].marker);
    return on.empty() ? absl::OkStatus()
                      : NotDivisible(static_cast<int>(first) + 1, "an output stays on after " + lines_[first].marker);
  }

  // The next hole that stays, if it is of the same group: the turn for the group is for it now.
  std::string HeirOf(std::size_t from, const std::string& hole) const {
    if (from >= lines_.size()) return "";
    const std::string& next = next_kept_[from];
    return GroupOf(next) == GroupOf(hole) ? next : "";
  }

  // A marked block that has the rotary axes alone, as many templates turn once for a group.
  bool TurnsOnly(std::size_t line) const {
    if (lines_[line].marker.empty()) return false;
    const std::array<bool, 5> said = SaidIn(lines_[line], axis_words_);
    return !said[0] && !said[1] && !said[kNcZ] && (said[3] || said[4]);
  }

  const std::vector<NcLine>& lines_;
  const std::set<std::string>& cut_;
  const std::array<std::string, 5>& axis_words_;
  const std::map<std::string, NcTarget>& targets_;
  std::map<std::size_t, std::string> remarked_;
  std::map<int, std::vector<const NcMove*>> moves_;  // by line, from 1
  std::vector<bool> keep_;
  std::vector<std::string> next_kept_;  // from each line on, the hole that stays and comes first; empty: none
  std::optional<double> height_mm_;     // of the tool after the lines that stay
};

bool SameWay(const NcMove& move, const NcMove& old, const std::array<bool, 5>& said) {
  for (std::size_t i = 0; i < said.size(); ++i) {
    if (!said[i]) continue;
    if (!move.by_steps && move.to[i] != old.to[i]) return false;
    if (!move.by_steps) continue;
    if (!move.to[i] || !old.to[i] || std::abs((*move.to[i] - *move.from[i]) - (*old.to[i] - *old.from[i])) > 1e-9)
      return false;
  }
  return move.feed == old.feed && move.motion_said == old.motion_said && move.by_steps == old.by_steps &&
         move.switches_on == old.switches_on && (!move.feed || move.rate == old.rate);
}

// What stays does what it did: whatever a line says, it says in the same modes. (Axes that it does not say stand where the proof finds
// them.) line_before: of each line that stays, from 0.
absl::Status CheckSame(const std::vector<NcMove>& before, const std::vector<NcMove>& after,
                       const std::vector<std::size_t>& line_before, const std::vector<NcLine>& lines,
                       const std::array<std::string, 5>& axis_words) {
  std::map<std::size_t, std::vector<const NcMove*>> by_line;
  for (const NcMove& move : before) by_line[static_cast<std::size_t>(move.line - 1)].push_back(&move);
  std::map<std::size_t, std::size_t> seen;
  for (const NcMove& move : after) {
    const std::size_t line = line_before[static_cast<std::size_t>(move.line - 1)];
    const auto& same = by_line[line];
    const std::size_t index = seen[line]++;
    if (index >= same.size() || !SameWay(move, *same[index], SaidIn(lines[line], axis_words)))
      return NotDivisible(static_cast<int>(line) + 1,
                          "would move another way without the blocks before it, want each hole to say its own G0, G1, "
                          "G90 and F");
  }
  return absl::OkStatus();
}

// A path whose first poses were cut is a groove that nobody drew: it is begun anew, or it is done.
absl::Status CheckWhole(const std::set<std::string>& cut, const std::map<std::string, NcTarget>& targets) {
  NcPaths poses_cut;
  for (const auto& [name, target] : targets)
    if (target.number != 0) poses_cut[target.path] += static_cast<int>(cut.count(name));
  for (const auto& [path, count] : PathsOf(targets))
    if (poses_cut[path] != 0 && poses_cut[path] != count)
      return absl::FailedPreconditionError("path " + path + ": " + std::to_string(poses_cut[path]) + " of " +
                                           std::to_string(count) + " poses cut, want all or none");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<NcRemaining> LeaveOut(const std::string& program, const std::set<std::string>& cut,
                                     const std::array<char, 2>& rotary, const NcFrame& frame,
                                     const std::map<std::string, NcTarget>& targets) {
  if (absl::Status status = CheckWhole(cut, targets); !status.ok()) return status;
  const absl::StatusOr<std::vector<NcMove>> before = ReadNcProgram(program, rotary, frame);
  if (!before.ok()) return before.status();
  const std::vector<NcLine> lines = LinesOf(program);
  const std::array<std::string, 5> axis_words = frame.WordsOf(rotary);
  Divider divider(lines, *before, cut, axis_words, targets);
  if (absl::Status status = divider.Divide(); !status.ok()) return status;
  NcRemaining remaining;
  std::vector<std::size_t> line_before;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!divider.keep()[i]) continue;
    const auto remarked = divider.remarked().find(i);
    remaining.program += remarked == divider.remarked().end() ? lines[i].text : Remarked(lines[i], remarked->second);
    line_before.push_back(i);
  }
  absl::StatusOr<std::vector<NcMove>> after = ReadNcProgram(remaining.program, rotary, frame);
  if (!after.ok()) return after.status();
  if (absl::Status status = CheckSame(*before, *after, line_before, lines, axis_words); !status.ok()) return status;
  remaining.moves = *std::move(after);
  return remaining;
}

}  // namespace sixpoint::metrology
