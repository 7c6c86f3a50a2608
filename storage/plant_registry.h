// What the plant owns: machines, artefacts, parts and their surfaces, blades. Machines, artefacts and parts have revisions
// that never change; a description equal to the newest revision's (by content_sha256) is that revision.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"
#include "storage/references.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

// Vectors of 3 unless said otherwise.
struct JointRow {
  std::string side;  // part, tool
  std::string axis;
  std::string kind;  // linear, rotary
  std::vector<double> direction;
  std::optional<std::vector<double>> point_mm;
  double sign = 1;
  double minimum = 0, maximum = 0;
  std::optional<double> positioning_standard_uncertainty_deg = std::nullopt;
};

struct MachineRow {
  std::string machine_id;
  int revision = 0;  // set by InsertMachine, as `recorded`
  std::string content_sha256;
  std::vector<JointRow> joints;  // part side first
  std::string sensor_model;
  double sensor_noise_um = 0;
  int sensor_column_count = 0;
  double sensor_mid_range_mm = 0, sensor_range_mm = 0, sensor_line_angle_deg = 0;
  std::string sensor_serial_number, sensor_kind;  // LINE, SNAPSHOT; empty: not stated
  std::vector<double> nominal_centre_mm;
  double safety_translation_mm = 0, safety_rotation_deg = 0;
  double safety_uncertainty_share = 0, safety_registration_age_h = 0, safety_keep_out_mm = 0;
  std::string approach;  // UPWARDS, DOWNWARDS; empty: not the same way, or not known
  std::optional<double> touch_offset_um, scanner_field_um, tool_offset_um, linear_scale_um_per_m, squareness_um_per_m;
  std::optional<double> temperature_k, temperature_half_range_k, encoder_latency_um, interim_check_limit_um;
  std::optional<ExpansionRow> scale_expansion;
  std::string touch_probe_serial_number;  // empty: no touch probe is stated
  std::optional<CertificateRow> touch_probe_certificate;
  Recorded recorded;
};

struct PlateFeatureRow {
  std::string kind;  // cone, slot
  std::string feature;
  double x_mm = 0, y_mm = 0;
};

struct ArtefactRow {
  std::string artefact_id;
  int revision = 0;  // set by InsertArtefact, as `recorded`
  std::string content_sha256;
  double side_mm = 0;
  double cone_half_angle_deg = 0, cone_top_radius_mm = 0, cone_bottom_radius_mm = 0;
  double slot_width_mm = 0, slot_depth_mm = 0;
  std::string serial_number;  // empty: not stated
  std::optional<CertificateRow> certificate;
  std::optional<double> centre_standard_uncertainty_um;
  std::optional<double> flatness_standard_uncertainty_um;
  std::vector<PlateFeatureRow> features;
  Recorded recorded;
};

struct TessellationRow {
  std::string cad_sha256;  // a stored blob
  std::string method;      // format and parameters
  std::string surface_sha256;
  std::int64_t triangle_count = 0;
  double chordal_error_um = 0;
  bool closed = false;
  std::vector<double> minimum_mm, maximum_mm;
  // None: not counted.
  struct Gaps {
    std::int64_t degenerate_triangle_count = 0;
    std::int64_t open_rim_count = 0;
    double open_rim_length_mm = 0;
  };
  std::optional<Gaps> gaps = std::nullopt;
  // Of edges from their faces: before they were put onto them, and after. None: STL, or not looked at.
  struct EdgeGaps {
    double healed_um = 0, gap_um = 0;
    std::vector<double> gap_at_mm = {};  // of the greatest; empty: there is none
  };
  std::optional<EdgeGaps> edge_gaps = std::nullopt;
};

struct HoleRow {
  std::string hole;
  std::vector<double> start_in_part_mm, normal_in_part;
};

struct HoleGroupRow {
  std::string group;
  double diameter_mm = 0, depth_mm = 0;
  double a_nominal_deg = 0, b_nominal_deg = 0;
  std::vector<double> axis_in_part;
  double position_tolerance_mm = 0, inclination_tolerance_deg = 0;
  std::string position_zone;  // DIAMETER, RADIUS
  struct GaugePin {
    double diameter_mm = 0, diameter_standard_uncertainty_um = 0, greatest_play_mm = 0;
    std::optional<double> least_depth_mm = std::nullopt;
    std::optional<CertificateRow> certificate = std::nullopt;
  };
  std::optional<GaugePin> gauge_pin = std::nullopt;
  struct PinStanding {
    double clearance_standard_uncertainty_um = 0, tilt_standard_uncertainty_deg = 0;
  };
  std::optional<PinStanding> pin_standing = std::nullopt;
  std::vector<HoleRow> holes;
};

struct DatumPointRow {
  std::string datum;
  std::vector<double> point_in_part_mm, normal_in_part;
};

// Where a part of its own is clamped in a fixture of several.
struct StationRow {
  std::string station;
  std::vector<double> zero_from_part_nominal_rotation;  // 9, row-major
  std::vector<double> zero_from_part_nominal_translation_mm;
  double capture_mm = 0;  // how far any of it may stand from there
};

// What becomes of a part of the surface where the shape follows the blank.
struct ShapeRegionRow {
  std::string region;
  std::vector<double> minimum_in_part_mm, maximum_in_part_mm, facing_in_part;  // empty: not bounded so
  std::optional<double> facing_within_deg;
  std::string kind;                          // MACHINED, FIXED, DATUM
  std::optional<double> allowance_mm;        // of a machined one alone
  std::optional<double> lower_mm, upper_mm;  // of all but datums
};

struct PartRow {
  std::string part_id;
  int revision = 0;  // set by InsertPart, as `recorded`
  std::string content_sha256;
  std::string customer_id;  // empty: as the revision before says, or nobody's
  std::string cad_format;   // step, iges, stl
  double cad_unit_mm = 0;
  std::string solid;                                    // of the CAD file, by name or number; empty: its only one
  std::vector<double> zero_from_part_nominal_rotation;  // 9, row-major
  std::vector<double> zero_from_part_nominal_translation_mm;
  std::vector<HoleGroupRow> hole_groups;
  std::vector<DatumPointRow> datum_points;
  std::vector<StationRow> stations;
  std::vector<ShapeRegionRow> shape_regions;
  std::optional<ExpansionRow> thermal_expansion;
  TessellationRow tessellation;
  Recorded recorded;
};

struct BladeRow {
  std::string blade_serial;
  std::string part_id;
  Recorded recorded;
  std::string work_order = {}, operation = {};  // assigned last; empty: none
};

// `entry`'s name and kind are filled in here, with the revision. Until the transaction ends, others that insert the same
// id wait. Call it last before the commit (the journal's lock).
absl::StatusOr<MachineRow> InsertMachine(Transaction& transaction, MachineRow machine, RecordEntry entry);
absl::StatusOr<ArtefactRow> InsertArtefact(Transaction& transaction, ArtefactRow artefact, RecordEntry entry);
// The tessellation has to be stored. PERMISSION_DENIED (CLEARANCE_MISSING) where entry.reader may not see the part, or its customer's.
absl::StatusOr<PartRow> InsertPart(Transaction& transaction, PartRow part, RecordEntry entry);
// A blade that is there with the same part is returned as it is; ALREADY_EXISTS with another part; PERMISSION_DENIED
// (CLEARANCE_MISSING) where entry.reader may not see that one.
absl::StatusOr<BladeRow> InsertBlade(Transaction& transaction, BladeRow blade, RecordEntry entry);

// Revision 0: the newest.
absl::StatusOr<std::optional<MachineRow>> FindMachine(Transaction& transaction, const std::string& id, int revision);
absl::StatusOr<std::optional<ArtefactRow>> FindArtefact(Transaction& transaction, const std::string& id, int revision);
absl::StatusOr<std::optional<PartRow>> FindPart(Transaction& transaction, const std::string& id, int revision);
absl::StatusOr<std::optional<BladeRow>> FindBlade(Transaction& transaction, const std::string& serial);

// In order of id, from after `after` (empty: from the first): those whose newest revision was recorded within the span.
enum class Registered { kMachines, kArtefacts, kParts, kMachiningModels };
struct RegisteredFilter {
  TimeSpan recorded;
  Reader reader;             // parts that he may not see are not listed, nor are their machining models
  std::string part_id = {};  // of machining models and drawings; empty: all
  bool full = false;         // with what a list leaves out else: of drawings their characteristics and what these name
};
absl::StatusOr<std::vector<std::string>> ListRegistered(Transaction& transaction, Registered what,
                                                        const RegisteredFilter& filter, const std::string& after,
                                                        int limit);
// The collection of its names: machines, artefacts, parts, machining_models.
std::string CollectionOf(Registered what);
struct BladeFilter {
  std::string part_id;  // empty: all
  TimeSpan recorded;
  Reader reader;                // what he may not see is not listed
  std::string work_order = {};  // assigned last; empty: all
  std::string serial_prefix = {}, machine_id = {};
  std::string verdict = {}, state = {};  // of the newest inspection, of the newest correction
};
struct BladePage {
  std::vector<BladeRow> blades;
  std::string looked_upto;  // further ones may follow this serial number, whatever was found; empty: there are none
};
// By serial number, from after `after` (empty: from the first).
absl::StatusOr<BladePage> ListBlades(Transaction& transaction, const BladeFilter& filter, const std::string& after,
                                     int limit);

// Blobs of the CAD and of the surface have to be stored. Twice the same is once.
absl::Status InsertTessellation(Transaction& transaction, const TessellationRow& tessellation,
                                const std::string& software_version);
absl::StatusOr<std::optional<TessellationRow>> FindTessellation(Transaction& transaction, const std::string& cad_sha256,
                                                                const std::string& method);

}  // namespace sixpoint::storage
