#include "services/inspection/inspect_blade.h"

#include <algorithm>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "metrology/inspection/blade_inspection.h"
#include "services/correction/registered_pose.h"
#include "services/inspection/inspection_messages.h"
#include "services/inspection/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/requests.h"

namespace sixpoint::inspection {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;
// Of the tightest position tolerance, what the surface's shape may deviate before the positioning matters.
constexpr double kShapeOfTolerance = 0.1;

absl::Status CheckScans(const Peers& peers, const v1::InspectRequest& request, const Caller& caller) {
  for (int i = 0; i < request.scans_size(); ++i) {
    ingest::v1::GetScanRequest get;
    get.set_name(request.scans(i));
    ingest::v1::Scan scan;
    const grpc::Status got = peers.scan_records->GetScan(caller.context().get(), get, &scan);
    if (!got.ok()) return runtime::FromGrpc(got);
    if (absl::Status status = CheckScan(i, scan.header(), request.blade()); !status.ok()) return status;
  }
  return absl::OkStatus();
}

registration::v1::Method MethodOf(const v1::InspectRequest& request) {
  return request.method() == registration::v1::METHOD_UNSPECIFIED ? registration::v1::METHOD_SIX_POINT
                                                                  : request.method();
}

// Whatever its outcome is. What is not the method that was asked for stands only beside it, and takes all the part.
absl::StatusOr<registration::v1::Registration> Register(const Peers& peers, const v1::InspectRequest& request,
                                                        registration::v1::Method method, const Caller& caller) {
  registration::v1::RegisterRequest wanted;
  wanted.set_blade(request.blade());
  *wanted.mutable_scans() = request.scans();
  wanted.set_method(method);
  if (request.has_options()) *wanted.mutable_options() = request.options();
  wanted.set_apply_axis_tables(request.apply_axis_tables());
  wanted.set_requested_by(request.requested_by());
  wanted.set_for_inspection(true);
  // Answers are kept by method and id: a retry of this inspection finds the registrations that it made.
  wanted.set_request_id(request.request_id());
  if (method != MethodOf(request)) {
    if (wanted.has_options()) wanted.mutable_options()->clear_regions_in();
    if (!request.request_id().empty())
      wanted.set_request_id(storage::UuidFrom(request.request_id() + " " + registration::v1::Method_Name(method)));
  }
  registration::v1::Registration registration;
  const grpc::Status got = peers.registration->Register(caller.context().get(), wanted, &registration);
  if (!got.ok()) return runtime::FromGrpc(got);
  return registration;
}

// What other registrations of the same scans say of the one that the verdict rests on.
struct Compared {
  std::optional<registration::v1::Disagreement> disagreement;
  bool disagrees = false;
  std::vector<Eigen::Isometry3d> other_zero_from_part;  // in the uncertainties
  bool covered = false;                                 // all that were to be
  std::vector<std::string> names;
};

// None where the part or what was asked for does not allow this positioning, or its fit gives no pose: the result says
// that it lacks. A plant that cannot register now (its calibration, its points, a service that is away) ends the call.
absl::StatusOr<std::optional<registration::v1::Registration>> Other(const Peers& peers,
                                                                    const v1::InspectRequest& request,
                                                                    registration::v1::Method method,
                                                                    const Caller& caller, Compared* compared) {
  absl::StatusOr<registration::v1::Registration> other = Register(peers, request, method, caller);
  if (absl::IsInvalidArgument(other.status()) || runtime::HasReason(other.status(), errors::v1::SIX_POINTS_MISSING))
    return std::nullopt;
  if (!other.ok()) return other.status();
  compared->names.push_back(other->name());
  if (!clients::CheckConverged(*other).ok()) return std::nullopt;
  return *std::move(other);
}

// Six-point and a local fit by regions were compared with the best fit by registration; a best fit is compared with the pairs.
// Where they disagree, the part's shape is not its CAD's: the best fit and the nest of six datum points are what the drawing
// may mean.
absl::StatusOr<Compared> Compare(const Peers& peers, const v1::InspectRequest& request,
                                 const registration::v1::Registration& registration, double tightest_um,
                                 const Caller& caller) {
  Compared compared;
  const registration::v1::Method method = MethodOf(request);
  if (registration.evidence().has_disagreement()) compared.disagreement = registration.evidence().disagreement();
  if (method == registration::v1::METHOD_BEST_FIT) {
    const auto pairs = Other(peers, request, registration::v1::METHOD_SIX_POINT, caller, &compared);
    if (!pairs.ok()) return pairs.status();
    if (pairs->has_value() && (*pairs)->evidence().has_disagreement())
      compared.disagreement = (*pairs)->evidence().disagreement();
  }
  compared.disagrees = (compared.disagreement && compared.disagreement->beyond()) ||
                       registration.evidence().model_sigma_um() > kShapeOfTolerance * tightest_um;
  if (!compared.disagrees || method == registration::v1::METHOD_SIX_POINT_NORMALS) return compared;
  compared.covered = true;
  for (const registration::v1::Method other :
       {registration::v1::METHOD_BEST_FIT, registration::v1::METHOD_SIX_POINT_NORMALS}) {
    if (other == method) continue;
    const auto found = Other(peers, request, other, caller, &compared);
    if (!found.ok()) return found.status();
    if (!found->has_value()) {
      compared.covered = false;
      continue;
    }
    const auto pose = runtime::FromProto("registration.zero_from_part", (*found)->zero_from_part());
    if (!pose.ok()) return pose.status();
    compared.other_zero_from_part.push_back(*pose);
  }
  return compared;
}

absl::StatusOr<std::vector<metrology::InspectedHole>> HolesOf(const plant::v1::Part& part) {
  std::vector<metrology::InspectedHole> holes;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    const std::string field = "part.hole_groups." + group.group();
    const auto axis = runtime::FromProto(field + ".axis_in_part", group.axis_in_part());
    if (!axis.ok()) return axis.status();
    for (const plant::v1::Hole& hole : group.holes()) {
      const auto start = runtime::FromProto(field + "." + hole.hole() + ".start_in_part_mm", hole.start_in_part_mm());
      if (!start.ok()) return start.status();
      const auto normal = runtime::FromProto(field + "." + hole.hole() + ".normal_in_part", hole.normal_in_part());
      if (!normal.ok()) return normal.status();
      metrology::InspectedHole& wanted = holes.emplace_back();
      wanted.group = group.group();
      wanted.name = hole.hole();
      wanted.pin = {*start, *axis, *normal, group.diameter_mm()};
      wanted.position_tolerance_mm = group.position_tolerance_mm();
      wanted.inclination_tolerance_rad = group.inclination_tolerance_deg() * kRad;
    }
  }
  if (holes.empty()) {
    return runtime::Failure(errors::v1::PART_WITHOUT_HOLES, part.name() + ".hole_groups: no holes, want at least one",
                            {{"resource", part.name()}});
  }
  return holes;
}

// Scan by scan, each decoded block by block; the next is fetched meanwhile.
absl::Status AddScans(const Peers& peers, const registration::v1::Registration& registration, const Caller& caller,
                      metrology::BladeInspection* inspection) {
  const auto fetch = [&](int i) { return peers.scans.FetchBlocks(registration.scans(i), caller.context()); };
  std::future<absl::StatusOr<clients::StoredBlocks>> next = std::async(std::launch::async, fetch, 0);
  for (int i = 0; i < registration.scans_size(); ++i) {
    const absl::StatusOr<clients::StoredBlocks> fetched = next.get();
    if (!fetched.ok()) return fetched.status();
    if (i + 1 < registration.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    inspection->Begin(fetched->scan);
    absl::Status added;
    const absl::Status decoded = fetched->Decode([&](const metrology::Points& points_mm) {
      if (added.ok()) added = inspection->AddPoints(points_mm);
    });
    if (!decoded.ok()) return decoded;
    if (!added.ok()) return added;
  }
  return absl::OkStatus();
}

absl::StatusOr<storage::InspectionRow> RowFor(const v1::InspectRequest& request,
                                              const registration::v1::Registration& registration) {
  storage::InspectionRow row;
  row.inspection_id = storage::NewUuid();
  for (const auto& [field, collection, name, id] :
       {std::tuple{"registration.blade", "blades", &registration.blade(), &row.blade_serial},
        std::tuple{"registration.name", "registrations", &registration.name(), &row.registration_id},
        std::tuple{"registration.machine", "machines", &registration.machine(), &row.machine_id},
        std::tuple{"registration.part", "parts", &registration.part(), &row.part_id},
        std::tuple{"registration.sensor_calibration", "calibrations", &registration.sensor_calibration(),
                   &row.sensor_calibration_id},
        std::tuple{"registration.rotation_calibration", "calibrations", &registration.rotation_calibration(),
                   &row.rotation_calibration_id}}) {
    const absl::StatusOr<std::string> found = runtime::IdOf(field, collection, *name);
    if (!found.ok()) return found.status();
    *id = *found;
  }
  for (const std::string& scan : registration.scans()) {
    const absl::StatusOr<std::string> scan_id = runtime::IdOf("registration.scans", "scans", scan);
    if (!scan_id.ok()) return scan_id.status();
    row.scan_ids.push_back(*scan_id);
  }
  row.machine_revision = registration.machine_revision();
  row.part_revision = registration.part_revision();
  row.method = registration::v1::Method_Name(registration.method()).substr(std::string("METHOD_").size());
  row.requested_by = request.requested_by();
  row.software_version = runtime::SoftwareVersion();
  return row;
}

storage::RecordEntry EntryOf(const storage::InspectionRow& row, const registration::v1::Registration& registration,
                             const Compared& compared) {
  storage::RecordEntry entry;
  entry.kind = "inspection";
  entry.name = runtime::NameOf("inspections", row.inspection_id);
  entry.inputs = {registration.name(), registration.machine() + "@" + std::to_string(row.machine_revision),
                  registration.part() + "@" + std::to_string(row.part_revision), registration.sensor_calibration(),
                  registration.rotation_calibration()};
  for (const registration::v1::ScanAngle& angle : registration.angles())  // each name is kept once
    entry.inputs.push_back(angle.characterisation());
  entry.inputs.insert(entry.inputs.end(), compared.names.begin(), compared.names.end());
  entry.inputs.insert(entry.inputs.end(), registration.scans().begin(), registration.scans().end());
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = registration::v1::Method_Name(registration.method());
  entry.software_version = row.software_version;
  entry.requested_by = row.requested_by;
  nlohmann::json counts = {{"CONFORM", 0}, {"NOT_CONFORM", 0}, {"UNDECIDABLE", 0}, {"NOT_MEASURED", 0}};
  for (const storage::InspectionHoleRow& hole : row.holes) counts[hole.verdict] = counts[hole.verdict].get<int>() + 1;
  entry.summary_json =
      nlohmann::json{{"verdict", row.verdict}, {"hole_counts", counts}, {"deviation_rms_um", row.deviation_rms_um}}
          .dump();
  return entry;
}

}  // namespace

absl::StatusOr<MadeInspection> InspectBlade(const Peers& peers, const v1::InspectRequest& request,
                                            const Caller& caller) {
  if (absl::Status status = CheckScans(peers, request, caller); !status.ok()) return status;
  const auto registration = Register(peers, request, MethodOf(request), caller);
  if (!registration.ok()) return registration.status();
  if (absl::Status status = clients::CheckConverged(*registration); !status.ok()) return status;
  absl::StatusOr<storage::InspectionRow> row = RowFor(request, *registration);
  if (!row.ok()) return row.status();

  const auto sensor = peers.calibrations.Sensor(registration->sensor_calibration(), caller.context());
  if (!sensor.ok()) return sensor.status();
  const auto rotation = peers.calibrations.Rotation(registration->rotation_calibration(), caller.context());
  if (!rotation.ok()) return rotation.status();
  const auto tables = clients::TablesOf(*registration, peers.calibrations, caller.context);
  if (!tables.ok()) return tables.status();
  const auto pose = clients::RegisteredPoseOf(*registration, sensor->sensor, *rotation, *tables);
  if (!pose.ok()) return pose.status();
  const auto part = peers.plant.GetPart(registration->part(), registration->part_revision(), caller.context());
  if (!part.ok()) return part.status();
  auto holes = HolesOf(*part);
  if (!holes.ok()) return holes.status();
  double tightest_um = std::numeric_limits<double>::infinity();
  for (const metrology::InspectedHole& hole : *holes)
    tightest_um = std::min(tightest_um, 1e3 * hole.position_tolerance_mm);
  const absl::StatusOr<Compared> compared = Compare(peers, request, *registration, tightest_um, caller);
  if (!compared.ok()) return compared.status();
  if (compared->disagreement) {
    row->disagreement_um = compared->disagreement->greatest_um();
    row->disagreement_ratio = compared->disagreement->ratio();
  }
  row->positioning_disagrees = compared->disagrees;
  row->positioning_covered = compared->covered;
  auto surface = peers.plant.GetSurface(*part, caller.context());
  if (!surface.ok()) return surface.status();

  metrology::InspectionOptions options;
  options.threads = caller.threads;
  options.keep_going = caller.keep_going;
  options.other_zero_from_part = compared->other_zero_from_part;
  metrology::BladeInspection inspection(*std::move(surface), *holes, *pose, sensor->sensor, rotation->axes, options);
  if (absl::Status status = AddScans(peers, *registration, caller, &inspection); !status.ok()) return status;
  const absl::StatusOr<metrology::BladeFindings> findings = inspection.Finish();
  if (!findings.ok()) return findings.status();
  SetFindings(*holes, *findings, &*row);

  MadeInspection made;
  made.entry = EntryOf(*row, *registration, *compared);
  made.row = *std::move(row);
  return made;
}

}  // namespace sixpoint::inspection
