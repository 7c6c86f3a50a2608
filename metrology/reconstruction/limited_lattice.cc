#include "metrology/reconstruction/limited_lattice.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "metrology/linear_algebra/complementary.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kLimitChunk = 2048;
constexpr std::size_t kNewEachRound = 64;
constexpr std::size_t kMostWorking = 1500;  // before those that push no more are let go
constexpr int kRounds = 120;
// Of all rounds together, in cubes of how many limits are minded: some half a minute. What wants more than that has limits that contradict each other
// all over, and says so by its slack long before.
constexpr double kMostWork = 5e10;
constexpr double kFirm =
    1e-12;  // each limit's own compliance, as SlackRule's: keeps the matrix definite where limits coincide

// One side of a limit: direction . u >= least, whatever side it is.
struct Side {
  std::size_t limit;
  bool most;
};

// The limits that are minded so far, and how pushes at them move each other.
class WorkingSet {
 public:
  WorkingSet(const LatticeSystem& system, const std::vector<DisplacementLimit>& limits, const SlackRule& rule)
      : system_(system), limits_(limits), rule_(rule) {}

  std::size_t size() const { return sides_.size(); }

  void Take(const std::vector<Side>& sides) {
    std::vector<LatticeWeights> places;
    for (const Side& side : sides) places.push_back(limits_[side.limit].at);
    const MatrixXd reaches = system_.Reaches(places);
    const auto old = static_cast<Index>(sides_.size()), added = static_cast<Index>(sides.size());
    if (reaches_.cols() < old + added) reaches_.conservativeResize(system_.size(), 2 * (old + added));
    reaches_.middleCols(old, added) = reaches;
    sides_.insert(sides_.end(), sides.begin(), sides.end());
    positive_.resize(sides_.size(), true);
    const MatrixXd moves = reaches_.leftCols(old + added).transpose() * reaches;
    moves_.conservativeResize(old + added, old + added);
    right_.conservativeResize(old + added);
    for (Index j = 0; j < added; ++j) {
      const std::size_t new_one = sides_.size() - static_cast<std::size_t>(added - j);
      for (Index i = 0; i < old + added; ++i)
        moves_(i, old + j) = moves_(old + j, i) = moves(i, j) * Along(static_cast<std::size_t>(i), new_one);
      right_[old + j] = Least(sides_[new_one]) - Signed(sides_[new_one]).dot(Free(sides_[new_one]));
    }
  }

  absl::Status Solve() {
    MatrixXd q = moves_;
    greatest_ = moves_.diagonal().maxCoeff();
    q.diagonal().array() += kFirm * greatest_;
    for (Index i = 0; i < q.rows(); ++i)
      for (Index j = 0; j < q.cols(); ++j) {
        const std::size_t group = GroupOf(static_cast<std::size_t>(i));
        if (group == GroupOf(static_cast<std::size_t>(j))) q(i, j) += greatest_ * rule_.compliance[group];
      }
    absl::StatusOr<VectorXd> solved = SolveComplementary(q, right_, &positive_);
    if (!solved.ok()) return solved.status();
    forces_ = *std::move(solved);
    return absl::OkStatus();
  }

  ControlDisplacements Moved() const {
    MatrixXd right = MatrixXd::Zero(system_.size(), 3);
    for (std::size_t i = 0; i < sides_.size(); ++i)
      if (forces_[static_cast<Index>(i)] > 0)
        system_.AddPush(limits_[sides_[i].limit].at, forces_[static_cast<Index>(i)] * Signed(sides_[i]), &right);
    return system_.Moved(std::move(right));
  }

  std::array<double, kLimitKinds> Slack() const {
    std::array<double, kLimitKinds> slack_mm = {0, 0, 0, 0};
    for (std::size_t i = 0; i < sides_.size(); ++i)
      slack_mm[GroupOf(i)] += greatest_ * rule_.compliance[GroupOf(i)] * forces_[static_cast<Index>(i)];
    return slack_mm;
  }

  std::vector<LimitPush> Pushes() const {
    std::vector<LimitPush> pushes;
    for (std::size_t i = 0; i < sides_.size(); ++i)
      if (forces_[static_cast<Index>(i)] > 0)
        pushes.push_back({sides_[i].limit, sides_[i].most, forces_[static_cast<Index>(i)]});
    std::sort(pushes.begin(), pushes.end(), [](const LimitPush& one, const LimitPush& other) {
      return std::tie(one.limit, one.most) < std::tie(other.limit, other.most);
    });
    return pushes;
  }

  bool Has(std::size_t limit, bool most) const {
    return std::any_of(sides_.begin(), sides_.end(),
                       [&](const Side& side) { return side.limit == limit && side.most == most; });
  }

  // Lets go those that do not push.
  void Thin() {
    std::vector<Side> pushing;
    for (std::size_t i = 0; i < sides_.size(); ++i)
      if (forces_[static_cast<Index>(i)] > 0) pushing.push_back(sides_[i]);
    sides_.clear();
    positive_.clear();
    moves_.resize(0, 0);
    right_.resize(0);
    Take(pushing);
  }

 private:
  Vector3d Signed(const Side& side) const { return (side.most ? -1.0 : 1.0) * limits_[side.limit].direction; }
  double Least(const Side& side) const {
    return side.most ? -limits_[side.limit].most_mm : limits_[side.limit].least_mm;
  }
  double Along(std::size_t i, std::size_t j) const { return Signed(sides_[i]).dot(Signed(sides_[j])); }
  std::size_t GroupOf(std::size_t i) const {
    const DisplacementLimit& limit = limits_[sides_[i].limit];
    return rule_.group[static_cast<std::size_t>(sides_[i].most ? limit.most_kind : limit.least_kind)];
  }
  Vector3d Free(const Side& side) const {
    if (free_mm_.cols() == 0) free_mm_ = system_.Moved(MatrixXd::Zero(system_.size(), 3));
    return DisplacementOf(system_.lattice(), free_mm_, limits_[side.limit].at);
  }

  const LatticeSystem& system_;
  const std::vector<DisplacementLimit>& limits_;
  const SlackRule& rule_;
  std::vector<Side> sides_;
  std::vector<bool> positive_;
  mutable ControlDisplacements free_mm_;
  MatrixXd reaches_, moves_;
  VectorXd right_, forces_;
  double greatest_ = 0;  // how far a unit push moves its own place, at most
};

// The worst misses, no two of one cell, kind and side, so that what is added says different things.
std::vector<Side> Worst(const std::vector<DisplacementLimit>& limits, const std::vector<LimitMiss>& misses,
                        const SlackRule& rule, const std::array<double, kLimitKinds>& slack_mm,
                        const WorkingSet& working) {
  struct Candidate {
    double miss_mm;
    Side side;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double least = misses[i].least_mm - slack_mm[rule.group[static_cast<std::size_t>(limits[i].least_kind)]];
    const double most = misses[i].most_mm - slack_mm[rule.group[static_cast<std::size_t>(limits[i].most_kind)]];
    if (least > kMissed_mm) candidates.push_back({least, {i, false}});
    if (most > kMissed_mm) candidates.push_back({most, {i, true}});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& one, const Candidate& other) { return one.miss_mm > other.miss_mm; });
  std::set<std::tuple<std::array<int, 3>, LimitKind, bool>> taken;
  std::vector<Side> worst;
  for (const Candidate& candidate : candidates) {
    const DisplacementLimit& limit = limits[candidate.side.limit];
    const LimitKind kind = candidate.side.most ? limit.most_kind : limit.least_kind;
    if (!taken.insert({limit.at.cell, kind, candidate.side.most}).second) continue;
    if (working.Has(candidate.side.limit, candidate.side.most)) continue;
    worst.push_back(candidate.side);
    if (worst.size() == kNewEachRound) break;
  }
  return worst;
}

}  // namespace

std::vector<LimitMiss> MissesOf(const ControlLattice& lattice, const ControlDisplacements& controls_mm,
                                const std::vector<DisplacementLimit>& limits, int threads) {
  std::vector<LimitMiss> misses(limits.size());
  ForEachChunk(limits.size(), kLimitChunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double along = limits[i].direction.dot(DisplacementOf(lattice, controls_mm, limits[i].at));
      misses[i] = {limits[i].least_mm - along, along - limits[i].most_mm};
    }
  });
  return misses;
}

double WorstMiss_mm(const std::vector<DisplacementLimit>& limits, const std::vector<LimitMiss>& misses,
                    LimitKind kind) {
  double worst_mm = 0;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if (limits[i].least_kind == kind) worst_mm = std::max(worst_mm, misses[i].least_mm);
    if (limits[i].most_kind == kind) worst_mm = std::max(worst_mm, misses[i].most_mm);
  }
  return worst_mm;
}

absl::StatusOr<LimitedLattice> SolveLimited(const LatticeSystem& system, const std::vector<DisplacementLimit>& limits,
                                            const SlackRule& rule, const std::vector<LimitPush>& held, int threads,
                                            const std::function<bool()>& keep_going) {
  WorkingSet working(system, limits, rule);
  std::vector<Side> next;
  for (const LimitPush& push : held)
    if (push.limit < limits.size() &&
        std::isfinite(push.most ? limits[push.limit].most_mm : limits[push.limit].least_mm))
      next.push_back({push.limit, push.most});
  LimitedLattice result;
  result.controls_mm = system.Moved(MatrixXd::Zero(system.size(), 3));
  double work = 0;
  for (; result.round_count < kRounds && work < kMostWork; ++result.round_count) {
    if (keep_going && !keep_going()) return absl::CancelledError("stopped by its caller");
    if (!next.empty()) {
      if (working.size() + next.size() > kMostWorking) working.Thin();
      working.Take(next);
      work += std::pow(static_cast<double>(working.size()), 3);
      if (absl::Status solved = working.Solve(); !solved.ok()) return solved;
      result.controls_mm = working.Moved();
      result.slack_mm = working.Slack();
      if (*std::max_element(result.slack_mm.begin(), result.slack_mm.end()) > rule.enough_mm) break;
    }
    const std::vector<LimitMiss> misses = MissesOf(system.lattice(), result.controls_mm, limits, threads);
    next = Worst(limits, misses, rule, result.slack_mm, working);
    if (next.empty()) {
      result.settled = true;
      break;
    }
  }
  if (working.size() > 0) result.pushes = working.Pushes();
  return result;
}

double ProvenMiss_mm(const ControlLattice& lattice, const std::vector<DisplacementLimit>& limits,
                     const std::vector<LimitPush>& pushes, double reach_mm) {
  double all = 0, lacking = 0;
  for (const LimitPush& push : pushes) all += push.force;
  if (!(all > 0)) return 0;
  std::map<std::size_t, Vector3d> balance;
  for (const LimitPush& push : pushes) {
    if (!(push.force > 0)) continue;
    const DisplacementLimit& limit = limits[push.limit];
    const double share = push.force / all, sign = push.most ? -1 : 1;
    lacking += share * (push.most ? -limit.most_mm : limit.least_mm);
    for (int local = 0; local < 64; ++local) {
      const int x = local / 16, y = local / 4 % 4, z = local % 4;
      const std::size_t control =
          lattice.ControlIndex(limit.at.cell[0] + x, limit.at.cell[1] + y, limit.at.cell[2] + z);
      balance.try_emplace(control, Vector3d::Zero()).first->second +=
          share * sign * limit.at.Weight(x, y, z) * limit.direction;
    }
  }
  for (const auto& [control, push] : balance) lacking -= push.norm() * reach_mm;
  return lacking;
}

}  // namespace sixpoint::metrology
