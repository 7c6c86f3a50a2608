// Reconstructions: the shape that a blank contains, or the proof that there is none.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/plant_registry.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

struct ReconstructionMethodRow {
  double patch_mm = 0, farthest_mm = 0, coarsest_spacing_mm = 0, finest_spacing_mm = 0, blend_mm = 0,
         coverage_factor = 0;
};

struct ReconstructionRegionRow {
  ShapeRegionRow applied;
  double area_mm2 = 0, seen_part = 0;
  int patch_count = 0;
  std::optional<double> least_allowance_um, least_spare_um;  // of a machined one that was seen
  double greatest_band_use = 0;
  std::optional<double> worst_fixed_um, worst_datum_um;  // of such a kind
};

struct ReconstructionHoldRow {
  int region_index = 0;
  std::string limit_kind;  // STOCK, TOLERANCE, FIXED, DATUM
  bool upper = false;
  double limit_mm = 0, share = 0;
  std::array<double, 3> place_in_part_mm{}, normal_in_part{};
  std::optional<int> patch;  // of BlankPatchesRow
};

struct ShapeProofRow {
  struct Relaxation {
    double at_least_um = 0, at_most_um = 0;
  };
  bool of_any_shape = false;
  double lacking_um = 0, control_reach_mm = 0;
  std::optional<Relaxation> tolerance, stock;
};

// Three numbers of a point or a direction, else one. stock_um is NaN where no surface near it looks alike.
struct BlankPatchesRow {
  std::vector<double> points_in_part_mm, normals_in_part, expanded_uncertainties_um, stock_um;
  std::vector<std::int64_t> regions;
};

struct ReconstructionRow {
  std::string reconstruction_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;  // of the registration
  bool of_part_limits = false;
  ReconstructionMethodRow applied;
  std::string outcome, remark;                          // remark: empty of RECONSTRUCTED alone
  std::optional<double> worst_step_um, worst_kink_deg;  // of RECONSTRUCTED
  std::int64_t taken_count = 0, far_off_count = 0, shapeless_count = 0;
  int patch_count = 0;
  double spacing_mm = 0;
  std::int64_t control_count = 0;
  int level_count = 0, pass_count = 0;
  std::optional<ShapeProofRow> proof;          // of INFEASIBLE
  std::string patches_sha256, lattice_sha256;  // lower-case hexadecimal; lattice: empty: no shape
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;  // set when it is recorded
  std::vector<std::string> scan_ids;
  std::vector<ReconstructionRegionRow> regions;
  std::vector<ReconstructionHoldRow> holds;
  // Written only; they are read by themselves (ReconstructionStore).
  BlankPatchesRow patches;
  std::string lattice;
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

struct ReconstructionFilter : ResultFilter {
  std::string outcome;  // empty: any
};

// Beside the reconstructions what is too large to come with each of them. Thread-safe.
class ReconstructionStore : public ResultStore<ReconstructionRow, ReconstructionFilter> {
 public:
  // None: no such reconstruction.
  virtual absl::StatusOr<std::optional<BlankPatchesRow>> Patches(const std::string& reconstruction_id,
                                                                 Deadline deadline) const = 0;
  // Checked against the digest; as GetBlob.
  virtual absl::StatusOr<std::string> Lattice(const std::string& lattice_sha256, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<ReconstructionStore> ReconstructionsIn(Database* database);

// The same in a transaction of the caller's: journal entry, reconstruction and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertReconstruction(Transaction& transaction, const ReconstructionRow& reconstruction,
                                              const RecordEntry& entry);

}  // namespace sixpoint::storage
