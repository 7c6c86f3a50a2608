// A plant as files: DIR/dataset.json and what it names (docs/cli.md tells its fields).
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::cli {

struct DatasetScan {
  std::string file;  // relative to the data set's folder, and inside it
  std::int64_t point_count = 0;
  ingest::v1::ScanHeader header;  // all but point_count and encoding
};

struct Dataset {
  std::string machine_id, artefact_id, part_id;
  plant::v1::Machine machine;
  plant::v1::Artefact artefact;
  plant::v1::Part part;
  std::string cad_file;  // relative, inside the folder
  calibration::v1::TouchData touch;
  std::vector<calibration::v1::SpherePose> sphere_poses;
  std::vector<DatasetScan> scans;
  // Serials of the blades that the scans show, in the order in which they first come.
  std::vector<std::string> blades;
  // By its error_sources: the runs of axes that are characterised, and whose tables are applied throughout, by letter; and whether the
  // arm's own scans are studied.
  std::vector<std::pair<std::string, calibration::v1::AxisRun>> axis_runs;
  bool study_arm = false;
  bool has_series = false;  // every scan says in which series it was taken

  bool applies_axis_tables() const { return !axis_runs.empty(); }
};

// Of kind arm, to learn how far the arm swings.
inline constexpr int kFewestArmScans = 5;

// INVALID_ARGUMENT names every missing or odd field by its path. Fields that it does not know are left alone, but in error_sources.
absl::StatusOr<Dataset> ParseDataset(const nlohmann::json& document);
absl::StatusOr<Dataset> LoadDataset(const std::string& folder);

}  // namespace sixpoint::cli
