// How parts are machined: operations in their order, electrodes and the template of the program. A model is of one part, and has
// revisions that never change, as what stands in plant_registry.h.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/control_tables.h"
#include "storage/database.h"
#include "storage/record.h"

namespace sixpoint::storage {

struct MachiningToolPathRow {
  std::string path;
  double a_nominal_deg = 0, b_nominal_deg = 0;
  double position_tolerance_mm = 0, inclination_tolerance_deg = 0;
  double mouth_mm = 0;
  std::optional<double> greatest_step_deg;
  std::vector<double> tips_in_part_mm, axes_in_part;  // x, y, z, pose by pose
};

struct MachiningOperationRow {
  std::string operation;
  std::string hole_group;  // empty: it has paths
  double electrode_diameter_mm = 0, electrode_length_mm = 0;
  double electrode_wear_mm = 0;                  // of the length, after each hole
  std::vector<MachiningToolPathRow> paths = {};  // lists leave out their poses
  std::optional<int> tool_number = {};
  std::optional<double> feed_mm_min = {};
};

// metrology/correction/post_processor.h says what each is.
struct PostProcessorRow {
  std::vector<std::string> axis_words;
  int linear_decimals = 0, rotary_decimals = 0, direction_decimals = 0;
  bool explicit_plus = false, directions = false, semicolon_comments = false, leaves_out_repeated = false;
  int first_number = 0, number_step = 0;
  std::string program_start, operation_start, hole, path_start, path_pose, path_end, operation_end, program_end;
};

struct MachiningModelRow {
  std::string machining_model_id;
  int revision = 0;  // set by InsertMachiningModel, as `recorded`
  std::string content_sha256;
  std::string part_id;
  int part_revision = 0;  // whose hole groups the operations were compared with
  std::vector<MachiningOperationRow> operations;
  std::optional<double> w_mm;
  std::string nc_template;         // a blob; left out of lists
  std::string nc_template_sha256;  // read only
  std::vector<WorkOffsetRow> work_offsets;
  std::vector<ToolLengthRow> tool_lengths;
  std::optional<PostProcessorRow> post_processor;  // lists leave it out
  Recorded recorded;
};

// As InsertMachine. ALREADY_EXISTS: the model is another part's; PERMISSION_DENIED (CLEARANCE_MISSING) where entry.reader may not see that
// one.
absl::StatusOr<MachiningModelRow> InsertMachiningModel(Transaction& transaction, MachiningModelRow model,
                                                       RecordEntry entry);
// Revision 0: the newest.
absl::StatusOr<std::optional<MachiningModelRow>> FindMachiningModel(Transaction& transaction, const std::string& id,
                                                                    int revision);
// The same without its template, its post-processor and the poses of its paths.
absl::StatusOr<std::optional<MachiningModelRow>> FindMachiningModelWithoutTemplate(Transaction& transaction,
                                                                                   const std::string& id, int revision);

}  // namespace sixpoint::storage
