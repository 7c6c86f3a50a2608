// The least of a lattice's quadratic part under limits of the displacement along directions at places: a convex quadratic programme,
// solved in its multipliers, which are pushes at the few places that hold the rest (docs/methods/reconstruction.md, programme).
//
// All limits of one kind may give way together by a slack that is dear, so that there is always a solution: where there is none without
// slack, the pushes grow until they prove it. The same limits give the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <functional>
#include <limits>
#include <vector>

#include "metrology/reconstruction/lattice_system.h"

namespace sixpoint::metrology {

enum class LimitKind : std::uint8_t { kStock, kTolerance, kFixed, kDatum };
inline constexpr std::size_t kLimitKinds = 4;

// least_mm <= direction . u(at) <= most_mm.
struct DisplacementLimit {
  LatticeWeights at;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double least_mm = -std::numeric_limits<double>::infinity(), most_mm = std::numeric_limits<double>::infinity();
  LimitKind least_kind = LimitKind::kTolerance, most_kind = LimitKind::kTolerance;
};

// What a limit pushes with where it holds.
struct LimitPush {
  std::size_t limit = 0;
  bool most = false;  // its upper side
  double force = 0;
};

struct SlackRule {
  // Limits whose kinds have the same group give way together.
  std::array<std::size_t, kLimitKinds> group = {0, 0, 0, 0};
  // Of each group: its slack a unit of all its pushes, as a part of how far a unit push moves the place that gives most.
  std::array<double, kLimitKinds> compliance = {1e-8, 1e-8, 1e-8, 1e-8};
  double enough_mm = std::numeric_limits<double>::infinity();  // of slack: beyond it nobody wants to know more
};

struct LimitedLattice {
  ControlDisplacements controls_mm;
  std::vector<LimitPush> pushes;                            // those above 0, by limit and side
  std::array<double, kLimitKinds> slack_mm = {0, 0, 0, 0};  // of each group
  bool settled = false;                                     // no limit is missed by more than kMissed_mm and its slack
  int round_count = 0;
};

inline constexpr double kMissed_mm = 1e-5;

// held: limits thought to hold, as of a problem alike; only their limit and side are read. CANCELLED: keep_going said so.
absl::StatusOr<LimitedLattice> SolveLimited(const LatticeSystem& system, const std::vector<DisplacementLimit>& limits,
                                            const SlackRule& rule, const std::vector<LimitPush>& held, int threads,
                                            const std::function<bool()>& keep_going);

// By how much each side of a limit is missed, at most 0 where it is kept.
struct LimitMiss {
  double least_mm, most_mm;
};
std::vector<LimitMiss> MissesOf(const ControlLattice& lattice, const ControlDisplacements& controls_mm,
                                const std::vector<DisplacementLimit>& limits, int threads);
// Of the limits of one kind; 0 where all are kept.
double WorstMiss_mm(const std::vector<DisplacementLimit>& limits, const std::vector<LimitMiss>& misses, LimitKind kind);

// What the pushes prove: for any controls of which none moves more than `reach_mm`, some limit is missed by at least this, forces
// weighing. Above 0: there are no such controls that keep all limits (Farkas; the imbalance of the pushes is charged at its worst).
// given_mm: what each limit's sides are widened by before.
double ProvenMiss_mm(const ControlLattice& lattice, const std::vector<DisplacementLimit>& limits,
                     const std::vector<LimitPush>& pushes, double reach_mm);

}  // namespace sixpoint::metrology
