// What a reconstruction asks of the displacement, about a deformation that is known already: distances to the deformed surface as they are, and
// how they follow. Used by ReconstructShape alone.
#pragma once

#include <optional>
#include <vector>

#include "metrology/reconstruction/place_grid.h"
#include "metrology/reconstruction/reconstruct_shape.h"
#include "metrology/reconstruction/surface_foot.h"

namespace sixpoint::metrology {

// By how much limits of each kind are missed by the deformation looked at, and where most; 0 where they are kept.
struct ShapeMisses {
  std::array<double, kLimitKinds> missed_mm = {0, 0, 0, 0};
  std::array<std::size_t, kLimitKinds> region = {0, 0, 0, 0};
  std::size_t lost_count = 0;  // machined patches of the blank whose foot is gone
  double Most() const { return *std::max_element(missed_mm.begin(), missed_mm.end()); }
};

// Of pulls a square millimetre, as parts of a fixed patch's: of fixed ones beside machined ones, and of machined ones towards the blank.
struct PullWeights {
  double beside = 1, machined = 0;
};

// The worst of the transition to what is not cut, and where the shape kinks most.
struct ShapeTransition {
  double step_mm = 0, kink_rad = 0;
  std::size_t kink_region = 0;
};

// A place of the design as it is displaced: how far it is off the design, and along which direction it goes off.
struct DisplacedPlace {
  Eigen::Vector3d direction, displacement_mm;
  double off_mm = 0;
};

// What was measured beside a deformation, when each was looked at last.
struct ShapeLook {
  std::vector<DisplacedPlace> bands, patch_bands;  // of the design's places; of the feet of machined patches
  std::vector<std::optional<SurfaceFoot>> feet;
  // Of each machined patch: stock, and how much of what is asked is asked so near to fixed surface.
  std::vector<double> wanted_mm, cut_part;
  std::vector<std::size_t> region_of_patch;  // as many as there are: unknown yet
};

enum class LookFor {
  kAll,     // whatever has moved
  kFeet,    // of patches alone
  kMissed,  // what may be missed now, by how much there was to spare and how far it has moved
};

class ShapeProblem {
 public:
  ShapeProblem(const DesignPlaces& design, const std::vector<BlankPatch>& blank,
               const std::vector<ShapeRegion>& regions, std::vector<std::uint8_t> region_of,
               const ReconstructionOptions& options);

  // The least lattice about the surface and its reach, covered where it is near the surface.
  ControlLattice LatticeOf(double spacing_mm) const;
  std::vector<std::uint8_t> CoveredOf(const ControlLattice& lattice) const;

  // What the displacement of fixed patches and datums is to be: about what was looked at, whatever lies along a patch's wall is left to it.
  std::vector<LatticePull> Pulls(const FreeFormDeformation& still, const PullWeights& weights) const;
  // Measures beside the deformation what is asked for; null: all, beside the design itself.
  void LookAt(const FreeFormDeformation* deformation, LookFor look_for = LookFor::kAll);
  // What was seen, to be taken up again where no patch has come or gone since.
  const ShapeLook& look() const { return look_; }
  void TakeUp(ShapeLook look) { look_ = std::move(look); }
  // Limits of the displacement in the lattice, to first order about what was looked at, narrowed by a margin; without one, what noise may explain
  // widens those of fixed walls. In the same order always: of each place its band, then of each patch what its stock or its following asks, then
  // its band.
  std::vector<DisplacementLimit> Limits(const FreeFormDeformation& still, double margin_mm) const;
  HoldingPlace PlaceOf(std::size_t limit, bool most, const std::vector<DisplacementLimit>& limits) const;

  // Fixed patches become means of those about them, as they stand off the deformation that was looked at: noise is followed by no lattice.
  void EvenFixed();
  // Guesses where the blank's machined surface stands between its patches: the design's waves, carried as the patches about them were. blank_as: the
  // deformation that was looked at, which makes the design the blank.
  void GuessBetween(const FreeFormDeformation& blank_as);
  // Of those guesses the ones that lack stock beside this deformation become patches whose stock is asked like that of the others, though they prove
  // nothing; how many.
  std::size_t TakeLacking(const FreeFormDeformation& deformation);

  // Forgets those that were taken.
  void DropGuesses();

  ShapeMisses Misses() const;
  // Patches whose own limits contradict each other, by how much; about what was looked at.
  std::vector<std::pair<double, std::size_t>> Contradictions() const;
  std::vector<RegionFinding> Findings() const;
  // Of the fixed surface beside the shape, about machined regions.
  ShapeTransition Transition() const;
  // Where the transition kinks by more, the shape is asked to be nearer to the fixed surface than it is; whether it kinks anywhere.
  bool NarrowAtKinks(double most_rad);

  std::size_t BandLimit(std::size_t patch) const { return design_.places.size() + 2 * patch + 1; }
  std::size_t PatchLimit(std::size_t patch) const { return design_.places.size() + 2 * patch; }
  bool IsMachined(std::size_t patch) const { return Is(patch, RegionKind::kMachined); }
  double GreatestBand_mm() const;

 private:
  static constexpr std::size_t kChunk = 512;  // places and patches that a thread takes at a time
  // Room, in ways that a place has moved, and stock beyond what is wanted, with which nothing is missed.
  static constexpr double kGoesAlong = 1.5, kPlentyOfStock_mm = 3e-3;

  DisplacedPlace BandOf(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal, std::uint32_t triangle,
                        const Eigen::Vector3d& displacement_mm) const;
  // Whether what was measured there may no more be trusted, a place having moved so far since.
  bool IsBandDue(std::size_t place, double moved_mm, LookFor look_for) const;
  bool IsPatchDue(std::size_t patch, double moved_mm, LookFor look_for) const;
  // Fixed patches with the places of their feet, for what is about one.
  struct FixedFeet {
    PlaceGrid grid;
    std::vector<std::size_t> patch_of;
  };
  FixedFeet FeetOfFixed() const;
  // Slope of what is left about a patch; unset where too few are about it, or a line of them.
  std::optional<double> SlopeAt(std::size_t patch, const FixedFeet& fixed) const;
  void Resize();  // what is kept of each patch, to as many as there are
  void LookAtPatch(std::size_t patch, const FreeFormDeformation* deformation, const SurfaceFoot* near);
  // Of a machined place: how much of what is asked is asked so near to fixed surface, and what stock that is.
  struct Wanted {
    double cut_part, wanted_mm;
  };
  Wanted WantedAt(const SurfaceFoot& foot, const ShapeRegion& region, double standard_uncertainty_mm) const;
  // How far the shape may be off a fixed patch; where what noise may explain is no contradiction, beyond that.
  double Tube_mm(std::size_t patch) const {
    const double tube_mm =
        about_machined_[patch] ? std::min(options_.step_mm, options_.fixed_within_mm) : options_.fixed_within_mm;
    return patch < narrowed_mm_.size() ? std::min(tube_mm, narrowed_mm_[patch]) : tube_mm;
  }
  double DoubtedTube_mm(std::size_t patch) const {
    return Tube_mm(patch) + options_.coverage_factor * blank_[patch].standard_uncertainty_mm;
  }
  bool Is(std::size_t patch, RegionKind kind) const {
    return look_.region_of_patch[patch] < regions_.size() && regions_[look_.region_of_patch[patch]].kind == kind;
  }

  const DesignPlaces& design_;
  std::vector<BlankPatch> blank_;  // first what was measured, then what was guessed between
  const std::size_t measured_count_;
  // Of the blank between its patches, with the place of the design that was carried there.
  struct Guess {
    BlankPatch patch;
    SurfaceFoot near;  // that place, displaced as when it was looked at last
    double spare_mm;   // then, at least
  };
  std::vector<Guess> between_;  // not taken yet
  const std::vector<ShapeRegion>& regions_;
  const std::vector<std::uint8_t> region_of_;
  const ReconstructionOptions& options_;
  PlaceGrid fixed_places_, machined_places_;
  ShapeLook look_;
  // As first looked at, without deformation.
  std::vector<std::optional<SurfaceFoot>> first_feet_;
  std::vector<bool> about_machined_;  // fixed patches
  std::vector<double> narrowed_mm_;   // how far the shape may be off them, where it kinked; empty: nowhere
};

}  // namespace sixpoint::metrology
