#include "cli/plant_run/dataset_error_sources.h"

#include <algorithm>
#include <sstream>

#include "cli/calibration_documents.h"
#include "cli/reference_documents.h"

namespace sixpoint::cli {
namespace {

// Of a data set that says nothing of its axes: a figure that is not nothing, and does nothing. 2 nm at 100 mm.
constexpr double kPerfectDeg = 1e-6;

// What tables leave of an axis that is good for 0.005 deg.
constexpr double kByControlDeg = 1e-3;

void StateAxes(double standard_uncertainty_deg, Dataset* dataset) {
  for (plant::v1::Joint& joint : *dataset->machine.mutable_kinematics()->mutable_part_side())
    joint.set_positioning_standard_uncertainty_deg(standard_uncertainty_deg);
}

void RefuseOthers(const Field& block, const std::vector<std::string>& known) {
  std::string wanted;
  for (const std::string& key : known) wanted += (wanted.empty() ? "one of " : ", ") + key;
  for (const auto& [key, value] : block.Members(0, 100))
    if (std::find(known.begin(), known.end(), key) == known.end()) value.Refuse(wanted);
}

std::vector<std::string> PrefixesOf(const Field& series) {
  std::vector<std::string> prefixes;
  std::stringstream text(series.Text());
  for (std::string prefix; std::getline(text, prefix, ',');)
    if (!prefix.empty()) prefixes.push_back(prefix);
  if (prefixes.empty()) series.Refuse("beginnings of scan ids, between commas");
  return prefixes;
}

bool BeginsWith(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

// The arm does not move within a series. Scans of the arm's own study are one each: it is swung between them.
void ReadSeries(const Field& block, Dataset* dataset) {
  const Field swings = block.At("arm_swings_between");
  swings.Choice({"series"});
  const int arm_scans =
      static_cast<int>(std::count_if(dataset->scans.begin(), dataset->scans.end(), [](const DatasetScan& scan) {
        return scan.header.kind() == ingest::v1::SCAN_KIND_ARM;
      }));
  if (arm_scans < kFewestArmScans)
    swings.Refuse(std::to_string(kFewestArmScans) +
                  " scans of kind arm or more, which say how far it swings; there are " + std::to_string(arm_scans));
  dataset->study_arm = true;
  const Field series = block.At("series");
  if (!series.present()) return;
  for (const auto& [name, prefixes] : series.Members(1, 100))
    for (const std::string& prefix : PrefixesOf(prefixes))
      for (DatasetScan& scan : dataset->scans)
        if (BeginsWith(scan.header.scan_id(), prefix)) scan.header.set_arm_series(name);
  dataset->has_series = true;
  // One swing each, that the calibration is made over.
  for (DatasetScan& scan : dataset->scans)
    if (scan.header.kind() == ingest::v1::SCAN_KIND_ARM) scan.header.set_arm_series(scan.header.scan_id());
  for (const DatasetScan& scan : dataset->scans)
    if (scan.header.kind() != ingest::v1::SCAN_KIND_ARM && scan.header.arm_series().empty())
      series.Refuse("a series for every scan but those of kind arm; " + scan.header.scan_id() + " is in none");
}

void ReadAxes(const Field& root, const Field& block, Dataset* dataset) {
  plant::v1::ErrorSources& machine = *dataset->machine.mutable_error_sources();
  if (const auto approach = block.Find("approach"))
    machine.set_approach(approach->Choice({"upwards", "downwards"}) == "upwards" ? plant::v1::APPROACH_UPWARDS
                                                                                 : plant::v1::APPROACH_DOWNWARDS);
  const auto tables = block.Find("axis_tables");
  if (!tables) return StateAxes(kPerfectDeg, dataset);
  if (tables->Choice({"apply", "in_control"}) != "apply") return StateAxes(kByControlDeg, dataset);
  const Field runs = root.At("axis_runs");
  for (const plant::v1::Joint& joint : dataset->machine.kinematics().part_side())
    dataset->axis_runs.emplace_back(joint.axis(), ReadAxisRun(runs.At(joint.axis())));
  const bool upwards = machine.approach() == plant::v1::APPROACH_UPWARDS;
  if (machine.approach() == plant::v1::APPROACH_UNSPECIFIED) return;
  for (calibration::v1::SpherePose& pose : dataset->sphere_poses) {
    pose.set_a_travel(upwards ? calibration::v1::TRAVEL_FORWARD : calibration::v1::TRAVEL_BACKWARD);
    pose.set_b_travel(pose.a_travel());
  }
}

void ReadPin(const Field& pin, plant::v1::Part* part) {
  RefuseOthers(pin, {"clearance_standard_uncertainty_um", "tilt_standard_uncertainty_deg"});
  plant::v1::PinStanding standing;
  standing.set_clearance_standard_uncertainty_um(pin.At("clearance_standard_uncertainty_um").Number(0, 1000));
  standing.set_tilt_standard_uncertainty_deg(pin.At("tilt_standard_uncertainty_deg").Number(0, 10));
  for (plant::v1::HoleGroup& group : *part->mutable_hole_groups()) *group.mutable_pin_standing() = standing;
}

}  // namespace

void ReadErrorSources(const Field& root, Dataset* dataset) {
  const auto block = root.Find("error_sources");
  if (!block) return StateAxes(kPerfectDeg, dataset);
  RefuseOthers(*block,
               {"axis_tables", "approach", "touch_common_standard_uncertainty_um", "arm_swings_between", "series",
                "sensor_field_standard_uncertainty_um", "sensor_speckle", "pin", "temperature_standard_uncertainty_k",
                "temperature_half_range_k", "scale_expansion", "encoder_latency_standard_uncertainty_um"});
  ReadAxes(root, *block, dataset);
  plant::v1::ErrorSources& machine = *dataset->machine.mutable_error_sources();
  if (const auto touch = block->Find("touch_common_standard_uncertainty_um"))
    machine.set_touch_offset_um(touch->Positive(1000));
  if (const auto field = block->Find("sensor_field_standard_uncertainty_um"))
    machine.set_scanner_field_um(field->Positive(1000));
  if (const auto k = block->Find("temperature_standard_uncertainty_k")) machine.set_temperature_k(k->Positive(10));
  if (const auto k = block->Find("temperature_half_range_k")) machine.set_temperature_half_range_k(k->Positive(30));
  if (const auto scale = block->Find("scale_expansion"))
    ReadThermalExpansion(*scale, machine.mutable_scale_expansion());
  if (const auto um = block->Find("encoder_latency_standard_uncertainty_um"))
    machine.set_encoder_latency_um(um->Positive(1000));
  if (block->Find("arm_swings_between") || block->Find("series")) ReadSeries(*block, dataset);
  // What neighbours share shows in the scatter of patches, from which the noise of a pose comes: stated, it is only looked at.
  if (const auto speckle = block->Find("sensor_speckle")) {
    RefuseOthers(*speckle, {"standard_uncertainty_um", "columns"});
    speckle->At("standard_uncertainty_um").Positive(1000);
    speckle->At("columns").Whole(1, 100000);
  }
  if (const auto pin = block->Find("pin")) ReadPin(*pin, &dataset->part);
}

}  // namespace sixpoint::cli
