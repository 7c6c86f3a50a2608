#include "cli/plant_run/dataset.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>

#include "cli/calibration_documents.h"
#include "cli/cloud_files.h"
#include "cli/document.h"
#include "cli/plant_documents.h"
#include "cli/plant_run/dataset_error_sources.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kGreatestScanCount = 10000;

// "p_table(A,B) = about C: Ry(A) Rx(B) p_zero, nominally": the rotary joints from the bed to the part, nominally through
// one centre. The travel is a length without an origin, so the linear joints, which carry the tool, are left out.
void ReadNominalKinematics(const Field& machine, plant::v1::Machine* out) {
  static const std::regex kJoint(R"(R([xyz])\(([ABC])\))");
  const Field kinematics = machine.At("kinematics");
  const std::string text = kinematics.Text();
  std::set<std::string> axes;
  for (std::sregex_iterator found(text.begin(), text.end(), kJoint), end; found != end; ++found) {
    plant::v1::Joint* joint = out->mutable_kinematics()->add_part_side();
    joint->set_axis((*found)[2]);
    joint->set_kind(plant::v1::JOINT_KIND_ROTARY);
    runtime::ToProto(Eigen::Vector3d(Eigen::Vector3d::Unit((*found)[1].str()[0] - 'x')), joint->mutable_direction());
    *joint->mutable_point_mm() = out->nominal_centre_mm();
    joint->set_sign(1);
    const std::string limits_key = std::string(1, static_cast<char>(joint->axis()[0] - 'A' + 'a')) + "_limits_deg";
    const Eigen::Vector2d limits = machine.At(limits_key).Vector2();
    if (limits.x() > limits.y()) machine.At(limits_key).Refuse("the lower limit first");
    joint->set_minimum(limits.x());
    joint->set_maximum(limits.y());
    axes.insert(joint->axis());
  }
  if (!text.empty() && (axes.size() != 2 || out->kinematics().part_side_size() != 2)) {
    kinematics.Refuse("the two rotary joints as in 'Ry(A) Rx(B) p_zero'");
  }
}

plant::v1::Machine ReadDatasetMachine(const Field& root) {
  const Field machine = root.At("machine");
  plant::v1::Machine out;
  runtime::ToProto(machine.At("nominal_centre_mm").Vector3(), out.mutable_nominal_centre_mm());
  ReadNominalKinematics(machine, &out);
  *out.mutable_sensor() = ReadSensor(root.At("sensor"));
  if (const auto envelope = machine.Find("safety_envelope"))
    *out.mutable_safety_envelope() = ReadSafetyEnvelope(*envelope);
  return out;
}

// Both must fit: the artefact is scanned as artefact or arm, a blade as the rest.
void ReadSubject(const Field& scan, Dataset* dataset, ingest::v1::ScanHeader* header) {
  static const std::vector<std::string> kKinds = {"artefact", "arm", "airfoil", "local", "pins"};
  const Field kind = scan.At("kind");
  const auto chosen = std::find(kKinds.begin(), kKinds.end(), kind.Choice(kKinds)) - kKinds.begin();
  header->set_kind(static_cast<ingest::v1::ScanKind>(chosen + 1));
  const bool of_artefact = header->kind() <= ingest::v1::SCAN_KIND_ARM;
  const Field subject = scan.At("subject");
  const std::string text = subject.Text();
  if (text.empty()) return;
  const std::string prefix = of_artefact ? "artefact:" : "blade:";
  const std::string id = text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : "";
  if (of_artefact) {
    if (id != dataset->artefact_id) return subject.Refuse("artefact:" + dataset->artefact_id);
    header->set_subject(runtime::NameOf("artefacts", id));
    return;
  }
  if (!runtime::CheckId("subject", id).ok()) return subject.Refuse("blade:SERIAL");
  header->set_subject(runtime::NameOf("blades", id));
  if (std::find(dataset->blades.begin(), dataset->blades.end(), id) == dataset->blades.end())
    dataset->blades.push_back(id);
}

// How it was taken, where that is known.
void ReadConditions(const Field& scan, ingest::v1::ScanHeader* header) {
  constexpr double kWarmestC = 60;
  if (const auto part = scan.Find("temperature_c")) header->set_subject_temperature_c(part->Number(0, kWarmestC));
  if (const auto scales = scan.Find("scales_temperature_c"))
    header->set_scales_temperature_c(scales->Number(0, kWarmestC));
  if (const auto station = scan.Find("station")) header->set_station(station->Id());
  if (const auto travel = scan.Find("travel"))
    header->set_travel(travel->Choice({"forward", "backward"}) == "forward" ? ingest::v1::SCAN_TRAVEL_FORWARD
                                                                            : ingest::v1::SCAN_TRAVEL_BACKWARD);
}

void ReadScan(const Field& scan, Dataset* dataset) {
  DatasetScan& out = dataset->scans.emplace_back();
  out.file = scan.At("file").PathInside();
  out.point_count = scan.At("point_count").Whole(1, kGreatestCloudPointCount);
  ingest::v1::ScanHeader* header = &out.header;
  header->set_scan_id(scan.At("id").Id());
  const Field machine = scan.At("machine");
  const std::string machine_id = machine.Id();
  if (!machine_id.empty() && machine_id != dataset->machine_id)
    machine.Refuse("'" + dataset->machine_id + "', the machine of this data set");
  header->set_machine(runtime::NameOf("machines", dataset->machine_id));
  ReadSubject(scan, dataset, header);
  runtime::ToProto(scan.At("v0_mm").Vector3(), header->mutable_v0_mm());
  header->set_a_deg(scan.At("a_deg").Number(-3600, 3600));
  header->set_b_deg(scan.At("b_deg").Number(-3600, 3600));
  header->set_profile_pitch_mm(scan.At("profile_pitch_mm").Positive(100));
  header->set_columns_per_profile(static_cast<std::int32_t>(scan.At("columns_per_profile").Whole(1, 100000)));
  ReadConditions(scan, header);
}

}  // namespace

absl::StatusOr<Dataset> ParseDataset(const nlohmann::json& document) {
  Problems problems(false);
  const Field root(&document, "", &problems);
  Dataset dataset;
  dataset.machine_id = root.At("machine").At("id").Id();
  dataset.machine = ReadDatasetMachine(root);
  const Field artefact = root.At("artefact");
  dataset.artefact_id = artefact.At("id").Id();
  dataset.artefact = ReadArtefact(artefact);
  const Field part = root.At("part");
  dataset.part_id = part.At("id").Id();
  dataset.cad_file = part.At("cad").PathInside();
  dataset.part =
      ReadPart(part, dataset.cad_file, plant::v1::POSITION_ZONE_RADIUS);  // as datasets without a zone mean it
  dataset.touch = ReadTouchData(root.At("touch_probe"));
  dataset.sphere_poses = ReadSpherePoses(root.At("sphere_poses"));
  std::set<std::string> ids;
  for (const Field& scan : root.At("scans").Items(1, kGreatestScanCount)) {
    ReadScan(scan, &dataset);
    const std::string& id = dataset.scans.back().header.scan_id();
    if (!id.empty() && !ids.insert(id).second) scan.At("id").Refuse("an id that no other scan has");
  }
  ReadErrorSources(root, &dataset);
  if (!problems.empty()) return problems.ToStatus();
  return dataset;
}

absl::StatusOr<Dataset> LoadDataset(const std::string& folder) {
  absl::StatusOr<nlohmann::json> document = LoadDocument((std::filesystem::path(folder) / "dataset.json").string());
  if (!document.ok()) return document.status();
  absl::StatusOr<Dataset> dataset = ParseDataset(*document);
  if (!dataset.ok()) return absl::InvalidArgumentError("dataset.json:\n" + std::string(dataset.status().message()));
  return dataset;
}

}  // namespace sixpoint::cli
