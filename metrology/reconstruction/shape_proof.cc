#include "metrology/reconstruction/shape_proof.h"

#include <algorithm>
#include <limits>

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kMostPlaces = 10;  // of a proof at places: the worst alone would do
constexpr double kReachOfBand = 5;       // controls that move farther leave every band
constexpr double kProven_mm = 1e-6;      // beyond rounding
constexpr double kKept_mm = 2e-3;        // what the limits that must stand may give, so that those that may are found

double ControlReach(const ShapeProblem& problem) { return std::max(1.0, kReachOfBand * problem.GreatestBand_mm()); }

ShapeProof ProofOf(const ShapeProblem& problem, const std::vector<DisplacementLimit>& limits,
                   const std::vector<LimitPush>& pushes) {
  ShapeProof proof;
  double all = 0;
  for (const LimitPush& push : pushes) all += push.force;
  for (const LimitPush& push : pushes) {
    HoldingPlace place = problem.PlaceOf(push.limit, push.most, limits);
    place.share = push.force / all;
    proof.conflicts.push_back(place);
  }
  std::stable_sort(proof.conflicts.begin(), proof.conflicts.end(),
                   [](const HoldingPlace& one, const HoldingPlace& other) { return one.share > other.share; });
  return proof;
}

// What the worst place lacks by itself, of one kind.
double KnownLack_mm(const ShapeProblem& problem, LimitKind kind) {
  for (const auto& [lacking_mm, patch] : problem.Contradictions())
    if (kind == LimitKind::kTolerance || problem.IsMachined(patch)) return lacking_mm;
  return 0;
}

// Of one kind; known_mm: that at least is known to be lacking.
absl::StatusOr<std::optional<LeastRelaxation>> Relax(const LatticeSystem& system,
                                                     const std::vector<DisplacementLimit>& limits, LimitKind kind,
                                                     double known_mm, double control_reach_mm,
                                                     const ReconstructionOptions& options) {
  SlackRule rule;
  rule.group.fill(1);
  rule.group[static_cast<std::size_t>(kind)] = 0;
  rule.compliance = {1e-5, 1e-9, 0, 0};
  const auto solved = SolveLimited(system, limits, rule, {}, options.threads, options.keep_going);
  if (!solved.ok()) return solved.status();
  const auto misses = MissesOf(system.lattice(), solved->controls_mm, limits, options.threads);
  LeastRelaxation relaxation;
  relaxation.at_most_mm = WorstMiss_mm(limits, misses, kind);
  double others_mm = 0;
  for (std::size_t other = 0; other < kLimitKinds; ++other)
    if (static_cast<LimitKind>(other) != kind)
      others_mm = std::max(others_mm, WorstMiss_mm(limits, misses, static_cast<LimitKind>(other)));
  if (!solved->settled || others_mm > kKept_mm) return std::nullopt;
  double all = 0, may_give = 0;
  for (const LimitPush& push : solved->pushes) {
    all += push.force;
    if ((push.most ? limits[push.limit].most_kind : limits[push.limit].least_kind) == kind) may_give += push.force;
  }
  const double missed_mm = ProvenMiss_mm(system.lattice(), limits, solved->pushes, control_reach_mm);
  relaxation.at_least_mm = known_mm;
  if (may_give > 0) relaxation.at_least_mm = std::max(known_mm, missed_mm * all / may_give);
  relaxation.at_most_mm = std::max(relaxation.at_most_mm, relaxation.at_least_mm);
  return relaxation;
}

}  // namespace

std::optional<ShapeProof> ProveAtPlaces(const ShapeProblem& problem, const FreeFormDeformation& still) {
  auto contradictions = problem.Contradictions();
  if (contradictions.empty()) return std::nullopt;
  contradictions.resize(std::min(contradictions.size(), kMostPlaces));
  const std::vector<DisplacementLimit> limits = problem.Limits(still, 0);
  std::vector<LimitPush> pushes;
  for (const auto& [lacking_mm, patch] : contradictions) {
    const std::size_t own = problem.PatchLimit(patch), band = problem.BandLimit(patch);
    // Whichever two sides of the place exclude each other.
    const bool below = limits[own].most_mm < limits[band].least_mm;
    pushes.push_back({own, below, 1});
    pushes.push_back({band, !below, 1});
  }
  // Each pair proves by itself; the worst says most.
  const double lacking_mm = ProvenMiss_mm(still.lattice(), limits, {pushes[0], pushes[1]}, ControlReach(problem));
  if (!(lacking_mm > kProven_mm)) return std::nullopt;
  ShapeProof proof = ProofOf(problem, limits, pushes);
  proof.of_any_shape = true;
  proof.lacking_mm = lacking_mm;
  proof.control_reach_mm = ControlReach(problem);
  return proof;
}

std::optional<ShapeProof> ProveOnLattice(const ShapeProblem& problem, const FreeFormDeformation& still,
                                         const std::vector<DisplacementLimit>& limits, std::vector<LimitPush> pushes) {
  // Those of guesses, which stand behind the limits, prove nothing.
  pushes.erase(
      std::remove_if(pushes.begin(), pushes.end(), [&](const LimitPush& push) { return push.limit >= limits.size(); }),
      pushes.end());
  const double lacking_mm = ProvenMiss_mm(still.lattice(), limits, pushes, ControlReach(problem));
  if (!(lacking_mm > kProven_mm)) return std::nullopt;
  ShapeProof proof = ProofOf(problem, limits, pushes);
  proof.lacking_mm = lacking_mm;
  proof.control_reach_mm = ControlReach(problem);
  return proof;
}

absl::StatusOr<Coarseness> CoarsenessOf(const ShapeProblem& problem, const LatticeSystem& system,
                                        std::vector<DisplacementLimit> limits, double enough_mm,
                                        const ReconstructionOptions& options) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto is_asked = [](LimitKind kind) { return kind == LimitKind::kFixed || kind == LimitKind::kDatum; };
  for (DisplacementLimit& limit : limits) {
    if (!is_asked(limit.least_kind)) limit.least_mm = -infinity;
    if (!is_asked(limit.most_kind)) limit.most_mm = infinity;
  }
  SlackRule rule;
  rule.enough_mm = enough_mm;
  const auto solved = SolveLimited(system, limits, rule, {}, options.threads, options.keep_going);
  if (!solved.ok()) return solved.status();
  Coarseness found;
  found.missed_mm = solved->slack_mm[0];
  double most = 0;
  for (const LimitPush& push : solved->pushes) {
    if (!(push.force > most)) continue;
    most = push.force;
    found.place = problem.PlaceOf(push.limit, push.most, limits);
  }
  return found;
}

absl::Status FindCures(const ShapeProblem& problem, const LatticeSystem& system,
                       const std::vector<DisplacementLimit>& limits, const ReconstructionOptions& options,
                       ShapeProof* proof) {
  for (const LimitKind kind : {LimitKind::kTolerance, LimitKind::kStock}) {
    auto relaxed = Relax(system, limits, kind, KnownLack_mm(problem, kind), proof->control_reach_mm, options);
    if (!relaxed.ok()) return relaxed.status();
    (kind == LimitKind::kTolerance ? proof->tolerance : proof->stock) = *std::move(relaxed);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
