// The shape that a blank contains: a design deformed within its own profile tolerance, so that its machined regions lie inside the measured
// blank with the stock that is wanted, its fixed ones follow the blank and its datums stand; or the proof that there is none
// (docs/methods/reconstruction.md; after Zhao, Lin and Fu 2021).
//
// Frame: part. Units: mm, rad. Plain data in and out. The same input gives the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metrology/reconstruction/blank_patch.h"
#include "metrology/reconstruction/design_places.h"
#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/reconstruction/limited_lattice.h"
#include "metrology/reconstruction/shape_regions.h"

namespace sixpoint::metrology {

struct ReconstructionOptions {
  int threads = 2;
  double coverage_factor =
      2;  // of a patch's standard uncertainty: the guard that its stock is wanted beyond the allowance
  double fixed_within_mm = 0.005;  // of the measured surface, where a region is fixed, beyond its guard
  double step_mm = 0.002;          // the same within three patches of a machined region
  double kink_rad = 0.00174533;    // of the shape beside the fixed surface there
  double datum_within_mm = 0.001;
  // Beside a fixed region, which is the blank's own surface, no stock can be left: over this width the allowance rises from none. It wants some
  // cells of the lattice.
  double blend_mm = 6;
  double coarsest_spacing_mm = 8, finest_spacing_mm = 2;  // of the lattice's cells; halved until all is kept
  double reach_mm = 3;                                    // of the lattice beyond the surface
  double patch_mm = 1;           // width of the blank's patches: so far about each of them was seen
  double least_seen_part = 0.9;  // of each machined or fixed region
  double greatest_stock_mm = 5;  // a patch farther from the design is of something else
  double threshold_mm = 2e-4;    // by which a limit may be missed
  double margin_mm = 1e-3;       // by which limits are narrowed, for what lies between places
  double stiffness_mm2 = 1e-3;   // of the lattice, beside a pull of 1 on each mm2 of fixed surface
  double decay_mm = 20;          // over which a displacement dies out where nothing asks for it
  int most_passes = 14;          // at one lattice
  std::function<bool()> keep_going = {};
};

// A place where a limit holds the shape, or contradicts others.
struct HoldingPlace {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();  // on the design
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // outward
  std::size_t region = 0;
  LimitKind kind = LimitKind::kStock;
  bool most = false;                 // its upper side: stock always
  double limit_mm = 0;               // of the displacement along the normal
  std::optional<std::size_t> patch;  // of the blank's, where it is one's
  double share = 0;                  // of all pushes, 0 to 1
};

// What of one kind would have to give way, everywhere by as much, were it the only one.
struct LeastRelaxation {
  double at_least_mm = 0;  // proven: with less there is no shape
  double at_most_mm = 0;   // found: with so much there is one on the finest lattice
};

struct ShapeProof {
  // Contradicting limits stand at one place each: no shape of any kind would do. Else: none on the finest lattice.
  bool of_any_shape = false;
  double lacking_mm = 0;        // by this the pushes' limits are missed, shares weighing, whatever the controls do
  double control_reach_mm = 0;  // as long as none moves farther
  std::vector<HoldingPlace> conflicts;              // by falling share
  std::optional<LeastRelaxation> tolerance, stock;  // unset: it alone would not cure
};

struct RegionFinding {
  double area_mm2 = 0;
  double seen_part = 0;
  std::size_t patch_count = 0;  // of the blank's
  // Machined: least distance of a patch of the blank outside the shape, and the same beyond what is wanted of it with its guard.
  std::optional<double> least_allowance_mm, least_spare_mm;
  double greatest_band_use = 0;          // of a place's displacement: part of the limit towards which it goes; 1 on it
  std::optional<double> worst_fixed_mm;  // fixed: greatest distance of the blank from the shape
  double worst_datum_mm = 0;             // datum: greatest displacement
};

enum class ShapeOutcome : std::uint8_t {
  kReconstructed,
  kInfeasible,     // cannot be made from this blank: proof
  kNotDetermined,  // too little was seen, or rounding and margins decide
};

struct Reconstruction {
  ShapeOutcome outcome = ShapeOutcome::kNotDetermined;
  std::string remark;  // of kReconstructed: that what was guessed between the patches could not be kept
  std::optional<FreeFormDeformation> deformation;  // of kReconstructed alone
  std::vector<RegionFinding> regions;  // as they were given; of the shape that was found, or the one that misses least
  std::vector<HoldingPlace> holding;   // of kReconstructed, by falling share
  std::optional<ShapeProof> proof;     // of kInfeasible
  double worst_step_mm = 0, worst_kink_rad = 0;  // of the fixed surface beside the shape, about machined regions
  double spacing_mm = 0;                         // of the last lattice
  int level_count = 0, pass_count = 0;
  std::size_t control_count = 0;  // that act
};

// INVALID_ARGUMENT, by name: what CheckRegions and AssignRegions refuse, "blank" (no patch, not finite, no unit normal), options out of range,
// "options.finest_spacing_mm" where the finest lattice cannot follow the fixed surface: which region, and what remained. CANCELLED.
absl::StatusOr<Reconstruction> ReconstructShape(const DesignPlaces& design, const std::vector<BlankPatch>& blank,
                                                const std::vector<ShapeRegion>& regions,
                                                const ReconstructionOptions& options);

}  // namespace sixpoint::metrology
