#include "metrology/measuring_plan/scan_program.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <vector>

#include "metrology/correction/nc_reader.h"
#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kWritten = 1e-4;  // the last decimal, mm and deg
constexpr std::size_t kZ = 2;

// Which joint a word moves: X, Y, Z, the rotary one on the bed and the one that it carries.
struct Words {
  std::array<char, 5> letters{};
  std::array<int, 5> joints{};
  std::array<char, 2> Rotary() const { return {letters[3], letters[4]}; }
};

// As its words have it, mm and deg.
using Spot = std::array<double, 5>;

absl::StatusOr<Words> WordsOf(const JointChain& chain) {
  Words words;
  std::size_t at = 0;
  for (const char* letter : {"X", "Y", "Z"}) {
    const std::optional<int> joint = chain.Find(letter);
    if (!joint || chain.motion(*joint).kind != JointKind::kLinear)
      return Refuse("kinematics", std::string("no linear joint ") + letter, "X, Y and Z, for the program's words");
    words.letters[at] = letter[0];
    words.joints[at++] = *joint;
  }
  for (const int joint : chain.PartSideRotary()) {
    const std::string& axis = chain.joints()[static_cast<std::size_t>(joint)].axis;
    if (at == words.letters.size() || axis.size() != 1)
      return Refuse("kinematics.part_side", axis, "two rotary joints, each called by one letter");
    words.letters[at] = axis[0];
    words.joints[at++] = joint;
  }
  if (at < words.letters.size()) return Refuse("kinematics.part_side", "fewer rotary joints", "two");
  return words;
}

absl::Status CheckOptions(const ScanProgramOptions& options) {
  Refusals refusals;
  if (!(options.feed_mm_per_min > 0 && options.feed_mm_per_min <= 1e5))
    refusals.Add(Refuse("feed_mm_per_min", options.feed_mm_per_min, "more than 0, at most 100000"));
  if (options.output < 0 || options.output > 63) refusals.Add(Refuse("output", options.output, "0 to 63"));
  return refusals.status();
}

Spot SpotOf(const Words& words, const Eigen::VectorXd& positions) {
  Spot spot{};
  for (std::size_t i = 0; i < spot.size(); ++i) spot[i] = positions(words.joints[i]) * (i < 3 ? 1 : kDegPerRad);
  return spot;
}

std::string Word(char letter, double value) {
  char text[48];
  std::snprintf(text, sizeof text, "%c%.4f", letter, std::abs(value) < kWritten / 2 ? 0.0 : value);
  return text;
}

// Names come from outside: nothing that would end a comment.
std::string InComment(std::string text, const std::string& further = "") {
  for (char& c : text)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && ("_-." + further).find(c) == std::string::npos) c = '?';
  return text;
}

// Words of the axes [from, to).
std::string Axes(const Words& words, const Spot& spot, std::size_t from, std::size_t to) {
  std::string text;
  for (std::size_t i = from; i < to; ++i) text += " " + Word(words.letters[i], spot[i]);
  return text;
}

// The places that a program has to go to, one after the other, and how.
struct Step {
  Spot to{};
  bool feed = false;
};
std::vector<Step> StepsOf(const MeasuringPlan& plan, const Words& words) {
  std::vector<Step> steps;
  for (const PlannedPortion& portion : plan.portions) {
    const Spot above = SpotOf(words, portion.enter);
    // Turned where the sweep before was left: high enough, wherever that is.
    Spot turned = steps.empty() ? above : steps.back().to;
    turned[3] = above[3];
    turned[4] = above[4];
    steps.push_back({turned, false});
    steps.push_back({above, false});
    steps.push_back({SpotOf(words, portion.start), false});
    steps.push_back({SpotOf(words, portion.end), true});
    steps.push_back({SpotOf(words, portion.leave), false});
  }
  return steps;
}

}  // namespace

absl::StatusOr<std::string> WriteScanProgram(const MeasuringPlan& plan, const JointChain& chain,
                                             const ScanProgramOptions& options) {
  if (absl::Status status = CheckOptions(options); !status.ok()) return status;
  const auto words = WordsOf(chain);
  if (!words.ok()) return words.status();
  char feed[32];
  std::snprintf(feed, sizeof feed, " F%.4f", options.feed_mm_per_min);
  const std::string output = " P" + std::to_string(options.output) + "\n";
  std::string program = "%\n(MEASURING PLAN, " + std::to_string(plan.portions.size()) +
                        " SWEEPS)\n(MACHINE COORDINATES: NO WORK OFFSET MAY BE IN FORCE)\nG21 G90 G94 G49\n";
  for (const std::string& remark : options.remarks) program += "(" + InComment(remark, " ,:@/") + ")\n";
  // What a program of five words cannot move.
  for (int i = 0; i < chain.size(); ++i)
    if (std::find(words->joints.begin(), words->joints.end(), i) == words->joints.end())
      program += "(" + InComment(chain.joints()[static_cast<std::size_t>(i)].axis) + " STANDS AT 0)\n";
  std::string linear, rotary;  // where the axes stand, as it was written; what leads nowhere is not
  const auto go = [&](const std::string& to, std::string* at) {
    if (to != *at) program += "G0" + to + "\n";
    *at = to;
  };
  for (std::size_t i = 0; i < plan.portions.size(); ++i) {
    const PlannedPortion& portion = plan.portions[i];
    const Spot above = SpotOf(*words, portion.enter), end = SpotOf(*words, portion.end);
    // Wherever the machine comes from, first up, then round.
    if (i == 0) program += "G0" + Axes(*words, above, kZ, kZ + 1) + "\n";
    program += "(SWEEP " + std::to_string(i + 1) + (portion.region.empty() ? "" : ", " + InComment(portion.region)) +
               ": V0 " + Word('X', portion.v0_mm.x()) + " " + Word('Y', portion.v0_mm.y()) + " " +
               Word('Z', portion.v0_mm.z()) + ", ENCODER 0 TO " + Rounded(portion.length_mm) + ")\n";
    go(Axes(*words, above, 3, 5), &rotary);
    go(Axes(*words, above, 0, 3), &linear);
    go(Axes(*words, SpotOf(*words, portion.start), 0, 3), &linear);
    linear = Axes(*words, end, 0, 3);
    program += "M62" + output + "G1" + linear + feed + "\nM63" + output;
    go(Axes(*words, SpotOf(*words, portion.leave), 0, 3), &linear);
  }
  return program + "M30\n%\n";
}

absl::Status ProveScanProgram(const std::string& program, const MeasuringPlan& plan, const JointChain& chain,
                              const ScanProgramOptions& options) {
  const auto words = WordsOf(chain);
  if (!words.ok()) return words.status();
  const auto moves = ReadNcProgram(program, words->Rotary());
  if (!moves.ok()) return moves.status();
  const std::vector<Step> steps = StepsOf(plan, *words);
  std::size_t next = 0;  // step
  bool on = false, raised = false;
  const auto wrong = [](const NcMove& move, const std::string& wanted) {
    return Refuse("program", "line " + std::to_string(move.line), wanted);
  };
  const auto at = [](const NcPosition& position, const Spot& spot) {
    for (std::size_t i = 0; i < spot.size(); ++i)
      if (!position[i].has_value() || !(std::abs(*position[i] - spot[i]) <= kWritten)) return false;
    return true;
  };
  for (const NcMove& move : *moves) {
    if (move.switches_on) {
      while (next < steps.size() && !steps[next].feed && at(move.to, steps[next].to)) ++next;
      if (on || next == 0 || next >= steps.size() || !steps[next].feed || !at(move.to, steps[next - 1].to))
        return wrong(move, "the output on at the start of a sweep alone");
      on = true;
      continue;
    }
    if (move.arc || move.by_steps || !move.motion_said || move.path_tolerance_mm > 0)
      return wrong(move, "a straight move to a place");
    // The first place is come to from anywhere: up, turned, and only then across.
    if (!raised) {
      if (move.feed || !OnlyZ(move) || steps.empty() || !move.to[kZ] ||
          std::abs(*move.to[kZ] - steps[0].to[kZ]) > kWritten)
        return wrong(move, "up along Z before anything else");
      raised = true;
      continue;
    }
    if (next == 0) {
      if (move.feed || move.from[0] != move.to[0] || move.from[1] != move.to[1] || move.from[kZ] != move.to[kZ] ||
          !move.to[3] || !move.to[4] || std::abs(*move.to[3] - steps[0].to[3]) > kWritten ||
          std::abs(*move.to[4] - steps[0].to[4]) > kWritten)
        return wrong(move, "the rotary axes turned before the first sweep");
      ++next;
      continue;
    }
    // A step that leads nowhere is not written.
    while (next < steps.size() && !steps[next].feed && !at(move.to, steps[next].to) && at(move.from, steps[next].to))
      ++next;
    if (next >= steps.size() || !at(move.to, steps[next].to)) return wrong(move, "the next place of the plan");
    if (move.feed != steps[next].feed || on != steps[next].feed)
      return wrong(move, "sweeps alone by feed, with the output on");
    if (move.feed && !(move.rate && std::abs(*move.rate - options.feed_mm_per_min) <= kWritten))
      return wrong(move, "a sweep at F" + NumberText(options.feed_mm_per_min));
    on = false;
    ++next;
  }
  while (next > 0 && next < steps.size() && steps[next].to == steps[next - 1].to) ++next;
  if (next < steps.size())
    return Refuse("program",
                  "its end after " + std::to_string(next) + " of " + std::to_string(steps.size()) + " places",
                  "the whole plan");
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
