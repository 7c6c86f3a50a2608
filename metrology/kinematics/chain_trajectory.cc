#include "metrology/kinematics/chain_trajectory.h"

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/beyond_reach.h"
#include "metrology/kinematics/trajectory_spots.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

using Eigen::VectorXd;
constexpr double kMostTurns = 16;  // about nominal, where a trajectory may begin

std::vector<double> WholeTurns(double angle_rad, double least_rad, double most_rad) {
  constexpr double kSlack_rad = 1e-12;
  std::vector<double> angles;
  for (double k = std::ceil((least_rad - kSlack_rad - angle_rad) / kTurn_rad);
       angle_rad + k * kTurn_rad <= most_rad + kSlack_rad; ++k)
    angles.push_back(angle_rad + k * kTurn_rad);
  return angles;
}

double Apart(const TurnAngles& one, const TurnAngles& other) {
  return std::hypot(other.first_rad - one.first_rad, other.second_rad - one.second_rad);
}

// Where a trajectory may begin: without limits every whole turn is as good as the nearest.
std::vector<double> FirstTurns(double angle_rad, double near_rad, double minimum_rad, double maximum_rad) {
  if (std::isinf(minimum_rad) && std::isinf(maximum_rad))
    return {angle_rad + kTurn_rad * std::round((near_rad - angle_rad) / kTurn_rad)};
  return WholeTurns(angle_rad, std::fmax(minimum_rad, near_rad - kMostTurns * kTurn_rad),
                    std::fmin(maximum_rad, near_rad + kMostTurns * kTurn_rad));
}

std::vector<TurnAngles> Pairs(const std::vector<double>& firsts, const std::vector<double>& seconds) {
  std::vector<TurnAngles> pairs;
  for (const double first : firsts)
    for (const double second : seconds) pairs.push_back({first, second});
  return pairs;
}

// One way to stand at a spot, and the best way there.
struct State {
  size_t branch = 0;  // of the spot
  TurnAngles angles;  // the branch's, whole turns on
  double travel_rad = 0;
  int before = -1;  // in the layer before
};
// The states of a spot that is not free.
struct Layer {
  size_t spot = 0;
  std::vector<State> states;
};

struct Jump {
  size_t spot = 0;
  int joint = 0;
  double from = 0, to = 0, allowed = 0;
  double excess = std::numeric_limits<double>::infinity();  // how many times as long as allowed
};

class Search {
 public:
  Search(const ChainSolver& solver, const std::vector<ToolTarget>& targets, const VectorXd& nominal,
         const Continuity& continuity, const std::function<bool()>& keep_going)
      : solver_(solver), targets_(targets), nominal_(nominal), continuity_(continuity), keep_going_(keep_going) {}

  absl::StatusOr<std::vector<ChainSolution>> Run();

 private:
  // Asked for each state: limits of many turns have thousands at each target.
  absl::Status Go() const {
    return keep_going_ && !keep_going_() ? absl::CancelledError("trajectory: the caller went away") : absl::OkStatus();
  }
  absl::Status Begin(size_t spot);
  absl::Status GoOn(size_t spot);
  void Step(const Layer& from, int state, size_t branch, Layer* to, std::map<std::array<long, 3>, size_t>* known);
  // At a free spot, with the free joint at that angle.
  absl::StatusOr<VectorXd> Stand(size_t spot, double free_rad, double near_second_rad) const;
  // The same along free spots, from `first` on or back from it, and from where the joints stand beside it; or why not.
  enum class Way { kOn, kBack };
  absl::StatusOr<std::vector<VectorXd>> Lead(size_t first, Way way, VectorXd from, const std::vector<double>& free_rad);
  // At every spot, along the best way to that state of the last layer.
  absl::StatusOr<std::vector<VectorXd>> Follow(size_t state);
  absl::StatusOr<std::vector<VectorXd>> FollowBest();
  absl::StatusOr<std::vector<VectorXd>> StayNominal();
  std::vector<double> Evenly(size_t before, size_t after, double from_rad, double to_rad) const;
  absl::Status Note(const std::optional<Jump>& jump);
  std::optional<Jump> JumpOf(const VectorXd& from, const VectorXd& to, size_t spot) const;
  absl::Status JumpRefusal(const Jump& jump) const;

  VectorXd At(size_t spot, const State& state) const {
    VectorXd reached = spots_[spot].branches[state.branch].reached;
    reached(solver_.first_joint()) = state.angles.first_rad;
    reached(solver_.second_joint()) = state.angles.second_rad;
    return reached;
  }
  double First(const VectorXd& reached) const { return reached(solver_.first_joint()); }
  double Second(const VectorXd& reached) const { return reached(solver_.second_joint()); }

  const ChainSolver& solver_;
  const std::vector<ToolTarget>& targets_;
  const VectorXd& nominal_;
  const Continuity& continuity_;
  const std::function<bool()>& keep_going_;
  std::vector<Spot> spots_;
  std::vector<Layer> layers_;
  Jump least_jump_;       // into the newest layer
  absl::Status refusal_;  // other than a jump, likewise
};

std::optional<Jump> Search::JumpOf(const VectorXd& from, const VectorXd& to, size_t spot) const {
  constexpr double kRounding = 1e-9;
  std::optional<Jump> worst;
  for (int i = 0; i < from.size(); ++i) {
    const bool rotary = solver_.chain().motion(i).kind == JointKind::kRotary;
    const double allowed = rotary ? spots_[spot].rotary_step_rad : spots_[spot].linear_step_mm;
    const double step = std::abs(to(i) - from(i));
    if (step <= allowed + kRounding) continue;
    const double excess = step / (allowed + kRounding);
    if (!worst || excess > worst->excess) worst = Jump{spot, i, from(i), to(i), allowed, excess};
  }
  return worst;
}

absl::Status Search::Note(const std::optional<Jump>& jump) {
  if (!jump) return absl::OkStatus();
  if (jump->excess < least_jump_.excess) least_jump_ = *jump;
  return JumpRefusal(*jump);
}

absl::Status Search::JumpRefusal(const Jump& jump) const {
  const JointChain& chain = solver_.chain();
  const bool rotary = chain.motion(jump.joint).kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1;
  const std::string name = rotary ? " deg" : " mm";
  return BeyondReach(
      {{"targets[" + std::to_string(jump.spot) + "]." + chain.joints()[static_cast<size_t>(jump.joint)].axis,
        "a step of " + Rounded(std::abs(jump.to - jump.from) * unit) + name + " from " + Rounded(jump.from * unit) +
            " to " + Rounded(jump.to * unit),
        "at most " + Rounded(jump.allowed * unit) + name + " from one target to the next"}});
}

// By the allowed steps: whatever keeps to their sum keeps to each.
std::vector<double> Search::Evenly(size_t before, size_t after, double from_rad, double to_rad) const {
  double sum = 0, so_far = 0;
  for (size_t i = before + 1; i <= after; ++i) sum += spots_[i].rotary_step_rad;
  std::vector<double> angles;
  for (size_t i = before + 1; i < after; ++i) {
    so_far += spots_[i].rotary_step_rad;
    angles.push_back(sum > 0 ? from_rad + so_far / sum * (to_rad - from_rad) : from_rad);
  }
  return angles;
}

absl::StatusOr<VectorXd> Search::Stand(size_t spot, double free_rad, double near_second_rad) const {
  const TurnLimits& limits = solver_.limits();
  const TurnAngles angles =
      WithHeld(solver_.turns(), solver_.axis_in_tool(), spots_[spot].axis_in_zero, WhichTurn::kFirst, free_rad);
  const auto second =
      WithinLimits(angles.second_rad, near_second_rad, limits.second_minimum_rad, limits.second_maximum_rad);
  if (!second) {
    TurnChoices found;
    found.branches.angles[0] = angles;
    found.branches.count = 1;
    return AtTarget(spot, solver_.Refusal(targets_[spot], found, continuity_.allowed_tilt_rad));
  }
  auto reached = solver_.Place(targets_[spot].tip_in_zero_mm, {free_rad, *second}, nominal_);
  if (!reached.ok()) return AtTarget(spot, reached.status());
  return reached;
}

absl::StatusOr<std::vector<VectorXd>> Search::Lead(size_t first, Way way, VectorXd from,
                                                   const std::vector<double>& free_rad) {
  std::vector<VectorXd> led;
  for (const double held_rad : free_rad) {
    const size_t spot = way == Way::kOn ? first + led.size() : first - led.size();
    auto reached = Stand(spot, held_rad, Second(from));
    if (!reached.ok()) return reached.status();
    if (absl::Status jump = Note(JumpOf(from, *reached, way == Way::kOn ? spot : spot + 1)); !jump.ok()) return jump;
    from = *reached;
    led.push_back(*std::move(reached));
  }
  return led;
}

void Search::Step(const Layer& from, int index, size_t branch, Layer* to,
                  std::map<std::array<long, 3>, size_t>* known) {
  const State& state = from.states[static_cast<size_t>(index)];
  const VectorXd start = At(from.spot, state);
  const TurnLimits& limits = solver_.limits();
  double allowed = 0;
  for (size_t i = from.spot + 1; i <= to->spot; ++i) allowed += spots_[i].rotary_step_rad;
  allowed = std::fmin(allowed, kMostTurns * kTurn_rad);
  const auto near = [&](double angle_rad, double at_rad, double minimum_rad, double maximum_rad) {
    auto angles =
        WholeTurns(angle_rad, std::fmax(minimum_rad, at_rad - allowed), std::fmin(maximum_rad, at_rad + allowed));
    // The jump is then told by the least of them.
    if (angles.empty()) angles.push_back(*WithinLimits(angle_rad, at_rad, minimum_rad, maximum_rad));
    return angles;
  };
  const TurnAngles& base = spots_[to->spot].branches[branch].angles;
  const auto firsts = near(base.first_rad, First(start), limits.first_minimum_rad, limits.first_maximum_rad);
  const auto seconds = near(base.second_rad, Second(start), limits.second_minimum_rad, limits.second_maximum_rad);
  for (const TurnAngles& angles : Pairs(firsts, seconds)) {
    const State next{branch, angles, state.travel_rad + Apart(state.angles, angles), index};
    const auto led = Lead(from.spot + 1, Way::kOn, start, Evenly(from.spot, to->spot, First(start), angles.first_rad));
    if (!led.ok()) {
      refusal_.Update(led.status());
      continue;
    }
    if (!Note(JumpOf(led->empty() ? start : led->back(), At(to->spot, next), to->spot)).ok()) continue;
    const auto turns = [](double angle, double from_rad) { return std::lround((angle - from_rad) / kTurn_rad); };
    const auto [at, is_new] = known->try_emplace(
        {static_cast<long>(branch), turns(angles.first_rad, base.first_rad), turns(angles.second_rad, base.second_rad)},
        to->states.size());
    if (is_new)
      to->states.push_back(next);
    else if (next.travel_rad < to->states[at->second].travel_rad)
      to->states[at->second] = next;
  }
}

absl::Status Search::Begin(size_t spot) {
  const TurnLimits& limits = solver_.limits();
  const TurnAngles near = solver_.ReachedTurns(nominal_);
  Layer layer{spot, {}};
  refusal_ = BeyondReach({{"nominal_commanded", "more than 16 turns from the limits", "nearer"}});
  for (size_t branch = 0; branch < spots_[spot].branches.size(); ++branch) {
    const TurnAngles& base = spots_[spot].branches[branch].angles;
    const auto firsts = FirstTurns(base.first_rad, near.first_rad, limits.first_minimum_rad, limits.first_maximum_rad);
    const auto seconds =
        FirstTurns(base.second_rad, near.second_rad, limits.second_minimum_rad, limits.second_maximum_rad);
    for (const TurnAngles& angles : Pairs(firsts, seconds)) {
      const State state{branch, angles, Apart(near, angles), -1};
      // What is free before stands where it is first determined.
      const std::vector<double> held(spot, angles.first_rad);
      const auto led = Lead(spot - 1, Way::kBack, At(spot, state), held);
      if (led.ok())
        layer.states.push_back(state);
      else
        refusal_ = led.status();
    }
  }
  if (layer.states.empty()) return refusal_;
  layers_.push_back(std::move(layer));
  return absl::OkStatus();
}

absl::Status Search::GoOn(size_t spot) {
  const Layer& from = layers_.back();
  Layer to{spot, {}};
  std::map<std::array<long, 3>, size_t> known;
  least_jump_ = {};
  refusal_ = absl::OkStatus();
  for (size_t state = 0; state < from.states.size(); ++state) {
    if (absl::Status status = Go(); !status.ok()) return status;
    for (size_t branch = 0; branch < spots_[spot].branches.size(); ++branch)
      Step(from, static_cast<int>(state), branch, &to, &known);
  }
  if (to.states.empty()) return std::isfinite(least_jump_.excess) ? JumpRefusal(least_jump_) : refusal_;
  layers_.push_back(std::move(to));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<VectorXd>> Search::Follow(size_t last_state) {
  std::vector<VectorXd> reached(spots_.size());
  int state = static_cast<int>(last_state);
  for (size_t layer = layers_.size(); layer-- > 0;) {
    const State& here = layers_[layer].states[static_cast<size_t>(state)];
    reached[layers_[layer].spot] = At(layers_[layer].spot, here);
    state = here.before;
  }
  const size_t first = layers_.front().spot, last = layers_.back().spot;
  if (first > 0) {
    const auto led = Lead(first - 1, Way::kBack, reached[first], std::vector<double>(first, First(reached[first])));
    if (!led.ok()) return led.status();
    std::copy(led->rbegin(), led->rend(), reached.begin());
  }
  for (size_t layer = 0; layer < layers_.size(); ++layer) {
    const size_t from = layers_[layer].spot;
    const auto angles =
        layer + 1 < layers_.size()
            ? Evenly(from, layers_[layer + 1].spot, First(reached[from]), First(reached[layers_[layer + 1].spot]))
            : std::vector<double>(spots_.size() - 1 - last, First(reached[last]));
    const auto led = Lead(from + 1, Way::kOn, reached[from], angles);
    if (!led.ok()) return led.status();
    std::copy(led->begin(), led->end(), reached.begin() + static_cast<std::ptrdiff_t>(from) + 1);
  }
  return reached;
}

absl::StatusOr<std::vector<VectorXd>> Search::FollowBest() {
  const std::vector<State>& states = layers_.back().states;
  std::vector<size_t> order(states.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t one, size_t other) { return states[one].travel_rad < states[other].travel_rad; });
  // Another than the best, where what is free at the end cannot be led from that.
  absl::Status refusal;
  for (const size_t state : order) {
    if (absl::Status status = Go(); !status.ok()) return status;
    auto reached = Follow(state);
    if (reached.ok()) return reached;
    refusal.Update(reached.status());
  }
  return refusal;
}

absl::StatusOr<std::vector<VectorXd>> Search::StayNominal() {
  const TurnAngles near = solver_.ReachedTurns(nominal_);
  const TurnLimits& limits = solver_.limits();
  const double held_rad = std::fmin(std::fmax(near.first_rad, limits.first_minimum_rad), limits.first_maximum_rad);
  auto start = Stand(0, held_rad, near.second_rad);
  if (!start.ok()) return start.status();
  auto led = Lead(1, Way::kOn, *start, std::vector<double>(spots_.size() - 1, held_rad));
  if (led.ok()) led->insert(led->begin(), *std::move(start));
  return led;
}

absl::StatusOr<std::vector<ChainSolution>> Search::Run() {
  if (absl::Status status = Go(); !status.ok()) return status;
  auto spots = SpotsOf(solver_, targets_, nominal_, continuity_);
  if (!spots.ok()) return spots.status();
  spots_ = *std::move(spots);
  for (size_t i = 0; i < spots_.size(); ++i) {
    if (spots_[i].free) continue;
    if (absl::Status status = layers_.empty() ? Begin(i) : GoOn(i); !status.ok()) return status;
  }
  const auto reached = layers_.empty() ? StayNominal() : FollowBest();
  if (!reached.ok()) return reached.status();
  std::vector<ChainSolution> solutions;
  for (size_t i = 0; i < spots_.size(); ++i) {
    const VectorXd& at = reached->at(i);
    ChainSolution& solution = solutions.emplace_back();
    solution.commanded = solver_.Commanded(at);
    solution.reached = at;
    solution.tilt_rad = spots_[i].tilt_rad;
    if (!spots_[i].free) continue;
    solution.loose_joint = solver_.first_joint();
    solution.tilt_rad =
        TiltOf(solver_.turns(), solver_.axis_in_tool(), spots_[i].axis_in_zero, {First(at), Second(at)});
  }
  return solutions;
}

absl::Status CheckBound(const std::string& field, const StepBound& bound) {
  Refusals refusals;
  for (const auto& [name, value] :
       {std::pair("always", bound.always), {"per_mm", bound.per_mm}, {"per_rad", bound.per_rad}})
    if (!(value >= 0 && std::isfinite(value))) refusals.Add(Refuse(field + "." + name, value, "0 or more"));
  return refusals.status();
}

}  // namespace

absl::StatusOr<std::vector<ChainSolution>> SolveTrajectory(const ChainSolver& solver,
                                                           const std::vector<ToolTarget>& targets,
                                                           const VectorXd& nominal_commanded,
                                                           const Continuity& continuity,
                                                           const std::function<bool()>& keep_going) {
  if (targets.empty()) return Refuse("targets", "none", "one at least");
  Refusals refusals;
  refusals.Add(CheckBound("continuity.rotary_rad", continuity.rotary_rad));
  refusals.Add(CheckBound("continuity.linear_mm", continuity.linear_mm));
  if (!refusals.status().ok()) return refusals.status();
  return Search(solver, targets, nominal_commanded, continuity, keep_going).Run();
}

}  // namespace sixpoint::metrology
