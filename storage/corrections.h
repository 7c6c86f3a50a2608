// Corrections with their hole groups and holes.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/control_tables.h"
#include "storage/correction_tool_paths.h"
#include "storage/database.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

struct CorrectionHoleRow {
  std::string hole_name;
  std::array<double, 3> start_mm{};
  std::array<double, 3> nominal_start_mm{};
  double expanded_uncertainty_um = 0;
  std::vector<double> budget_um = {};      // by CorrectionRow::budget_sources; empty: made before it was kept
  std::optional<Instant> reported_cut_at;  // read only
};

struct CorrectionGroupRow {
  std::string group_name;
  double a_deg = 0, b_deg = 0;
  double a_nominal_deg = 0, b_nominal_deg = 0;
  double a_ideal_deg = 0, b_ideal_deg = 0;
  double a_standard_uncertainty_deg = 0, b_standard_uncertainty_deg = 0;
  std::optional<std::array<double, 2>> reached_deg;  // a, b; where axis tables were applied
  std::optional<double> tilt_deg;                    // none: made before it was kept
  std::vector<CorrectionHoleRow> holes;
  std::optional<CorrectionToolPathRow>
      path;  // of a group that is one: its hole stands at the first pose. Left out of lists
};

// What the written program was proven to do.
struct ProgramProofRow {
  std::string reader_version;
  int pose_count = 0;
  double greatest_difference_um = 0;
  double greatest_tilt_deg = 0;
};
// What the gate asked, and what it found where it is worst.
struct CorrectionCheckRow {
  std::string kind;             // START_SHIFT, ...: correction.v1.ReleaseCheckKind
  std::string subject;          // empty: the whole correction
  std::optional<double> value;  // none: it could not be told
  double limit = 0;
  bool passed = false;
  int failed_count = 0;
};
// What a person decided about it.
struct CorrectionDecisionRow {
  std::string reason, requested_by;
  Instant recorded_at;
};

struct CorrectionRow {
  std::string correction_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string
      nc_template;  // as it was sent; empty: none. Kept as a blob, not read back (correction_events.h: TemplateOf)
  std::string nc_program;  // empty: none, or held. Kept as a blob; read by FindCorrection, left out of lists
  std::string nc_held;     // the program while a person's release is awaited, and after it; kept and read as nc_program
  std::string release;     // AUTOMATIC, AWAITING_PERSON
  std::vector<std::string> release_reasons;
  double envelope_translation_mm = 0;
  double envelope_rotation_deg = 0;
  Instant valid_until;
  std::string requested_by;
  std::string software_version;
  std::string computed_on;                        // processor and C library; empty: made before it was kept
  Recorded recorded;                              // set by InsertCorrection
  std::vector<std::string> axes{"A", "B"};        // the machine's letters of a and b
  std::vector<std::string> characterisation_ids;  // read only: whose tables the registration's angles were taken with
  std::optional<ProgramProofRow> proof;           // none without a template
  std::vector<WorkOffsetRow> work_offsets;
  std::vector<ToolLengthRow> tool_lengths;
  std::optional<double> registration_age_h;  // how long the registration, or a person's release, holds
  std::string clamping;                      // the registration's; empty: not stated
  std::string machining_model_id;            // empty: none was named
  int machining_model_revision = 0;
  std::string reconstruction_id;            // empty: its paths go as their templates
  std::string machining_pass_id;            // by what it left they are commanded; empty: by the shape alone
  std::string repair_id;                    // along whose laps the tool goes; empty: along the model's holes and paths
  std::vector<std::string> budget_sources;  // empty: made before they were kept
  std::vector<CorrectionCheckRow> checks;
  std::vector<CorrectionGroupRow> groups;

  // What it is now; as made, until it is read. DRAFT, RELEASED, REFUSED, SUPERSEDED, EXPIRED, WITHDRAWN, CUT.
  std::string state;
  Instant usable_until;         // read only, as are those below
  std::string superseded_by;    // an id; empty: by none
  std::string template_sha256;  // of nc_template; empty: there is none
  std::string program_sha256;   // of nc_program or nc_held; empty: there is none
  std::optional<CorrectionDecisionRow> released, refused;

  const std::string& program() const { return nc_program.empty() ? nc_held : nc_program; }
};

struct CorrectionFilter : ResultFilter {
  std::string release;  // empty: any
  std::string state;    // now; empty: any
};

using CorrectionStore = ResultStore<CorrectionRow, CorrectionFilter>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<CorrectionStore> CorrectionsIn(Database* database);

// The same in a transaction of the caller's.
// Blobs, journal entry, correction, checks, groups and holes. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertCorrection(Transaction& transaction, const CorrectionRow& correction,
                                          const RecordEntry& entry);

absl::StatusOr<std::optional<CorrectionRow>> FindCorrection(Transaction& transaction, const std::string& correction_id);

// Newest first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<CorrectionRow>> ListCorrections(Transaction& transaction, const CorrectionFilter& filter,
                                                           std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
