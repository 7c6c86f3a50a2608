// That no shape keeps all limits, and what would have to give way. Used by ReconstructShape alone.
#pragma once

#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {

// About the design itself. Of places whose own limits contradict; unset: none do.
std::optional<ShapeProof> ProveAtPlaces(const ShapeProblem& problem, const FreeFormDeformation& still);

// By the pushes of a programme without a solution on this lattice, whose limits may go on behind these; unset: they prove nothing.
std::optional<ShapeProof> ProveOnLattice(const ShapeProblem& problem, const FreeFormDeformation& still,
                                         const std::vector<DisplacementLimit>& limits, std::vector<LimitPush> pushes);

// By how much fixed surface and datums are missed where nothing else is asked, and where most: above 0, the lattice is too coarse for them. At least:
// beyond enough_mm nothing more is found out.
struct Coarseness {
  double missed_mm = 0;
  HoldingPlace place;
};
absl::StatusOr<Coarseness> CoarsenessOf(const ShapeProblem& problem, const LatticeSystem& system,
                                        std::vector<DisplacementLimit> limits, double enough_mm,
                                        const ReconstructionOptions& options);

// The uniform slack of tolerance alone, and of stock alone, that would cure it, the others kept; left unset where none does.
absl::Status FindCures(const ShapeProblem& problem, const LatticeSystem& system,
                       const std::vector<DisplacementLimit>& limits, const ReconstructionOptions& options,
                       ShapeProof* proof);

}  // namespace sixpoint::metrology
