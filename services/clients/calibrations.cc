#include "services/clients/calibrations.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "metrology/kinematics/linear_axes.h"
#include "refusal/message_text.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"

namespace sixpoint::clients {
namespace {

using calibration::v1::Calibration;

absl::Status Damaged(const Calibration& calibration, const std::string& what) {
  return absl::DataLossError(calibration.name() + ": " + what);
}

template <int kSize>
absl::StatusOr<Eigen::Matrix<double, kSize, kSize>> SquareOf(const Calibration& calibration, const std::string& field,
                                                             const geometry::v1::Matrix& in) {
  const absl::StatusOr<Eigen::MatrixXd> matrix = runtime::FromProto(field, in);
  if (!matrix.ok()) return Damaged(calibration, std::string(matrix.status().message()));
  if (matrix->rows() != kSize || matrix->cols() != kSize) return Damaged(calibration, field + " of another size");
  return Eigen::Matrix<double, kSize, kSize>(*matrix);
}

absl::Status ReadField(const Calibration& calibration, metrology::SensorPose* sensor) {
  const calibration::v1::SensorCalibration& in = calibration.sensor();
  if (in.field_terms_um().empty()) return absl::OkStatus();
  if (in.field_terms_um_size() != metrology::kFieldParameterCount)
    return Damaged(calibration, "field_terms_um of another size");
  const auto covariance =
      SquareOf<metrology::kFieldParameterCount>(calibration, "field_covariance_um2", in.field_covariance_um2());
  if (!covariance.ok()) return covariance.status();
  metrology::MeasuredField& field = sensor->measured_field.emplace();
  field.terms_mm = 1e-3 * metrology::FieldTerms(in.field_terms_um().data());
  field.covariance_mm2 = 1e-6 * *covariance;
  field.stated_mm = 1e-3 * in.field_stated_um();
  return absl::OkStatus();
}

absl::StatusOr<FetchedSensorCalibration> SensorOf(const Calibration& calibration) {
  if (!calibration.has_sensor())
    return runtime::Refuse("calibration", calibration.name(), "a calibration of kind SENSOR");
  const calibration::v1::SensorCalibration& in = calibration.sensor();
  FetchedSensorCalibration out;
  out.name = calibration.name();
  out.valid_until = runtime::MomentOf(calibration.valid_until());
  geometry::v1::RigidTransform transform;
  *transform.mutable_rotation() = in.machine_from_sensor_rotation();
  *transform.mutable_translation_mm() = in.t_sm_mm();
  const absl::StatusOr<Eigen::Isometry3d> pose = runtime::FromProto("sensor", transform);
  if (!pose.ok()) return Damaged(calibration, std::string(pose.status().message()));
  out.sensor.rotation = pose->linear();
  out.sensor.t_sm_mm = pose->translation();
  const auto covariance = SquareOf<metrology::kSensorParameterCount>(calibration, "covariance", in.covariance());
  if (!covariance.ok()) return covariance.status();
  out.sensor.covariance = *covariance;
  if (!in.certificate().empty()) out.sensor.cloud = metrology::CloudKind::kSnapshot;
  if (in.has_degrees_of_freedom()) out.sensor.degrees_of_freedom = in.degrees_of_freedom();
  out.arm_series = in.arm_series();
  out.sensor_serial_number = in.sensor_serial_number();
  out.travel = in.travel();
  out.machine = calibration.machine();
  out.withdrawn = calibration.state() == calibration::v1::CALIBRATION_STATE_WITHDRAWN;
  out.draft = calibration.state() == calibration::v1::CALIBRATION_STATE_DRAFT;
  if (calibration.has_interim_check()) out.interim = calibration.interim_check();
  if (absl::Status s = ReadField(calibration, &out.sensor); !s.ok()) return s;
  for (const calibration::v1::ArmShare& share : in.arm_shares()) {
    const auto response =
        SquareOf<metrology::kSensorParameterCount>(calibration, "arm_shares.response", share.response());
    if (!response.ok()) return response.status();
    out.arm_shares.push_back({share.arm_series(), *response});
  }
  if (!in.has_field_response()) return out;
  const absl::StatusOr<Eigen::MatrixXd> response = runtime::FromProto("field_response", in.field_response());
  if (!response.ok()) return Damaged(calibration, std::string(response.status().message()));
  if (response->rows() != metrology::kSensorParameterCount || response->cols() != metrology::kFieldParameterCount)
    return Damaged(calibration, "field_response of another size");
  out.sensor.field_response = *response;
  return out;
}

absl::StatusOr<FetchedRotationCalibration> RotationOf(const Calibration& calibration) {
  if (!calibration.has_rotation())
    return runtime::Refuse("calibration", calibration.name(), "a calibration of kind ROTATION");
  const calibration::v1::RotationCalibration& in = calibration.rotation();
  FetchedRotationCalibration out;
  out.name = calibration.name();
  out.valid_until = runtime::MomentOf(calibration.valid_until());
  const absl::StatusOr<metrology::AxisLine> a = runtime::FromProto("a_axis", in.a_axis());
  if (!a.ok()) return Damaged(calibration, std::string(a.status().message()));
  const absl::StatusOr<metrology::AxisLine> b = runtime::FromProto("b_axis", in.b_axis());
  if (!b.ok()) return Damaged(calibration, std::string(b.status().message()));
  out.axes = {*a, *b};
  const auto covariance = SquareOf<metrology::kAxisParameterCount>(calibration, "covariance", in.covariance());
  if (!covariance.ok()) return covariance.status();
  out.covariance = *covariance;
  if (in.has_degrees_of_freedom()) out.degrees_of_freedom = in.degrees_of_freedom();
  // Calibrations from before letters were kept are of A and B.
  if (in.axes_size() != 0 && in.axes_size() != 2)
    return Damaged(calibration, std::to_string(in.axes_size()) + " axes, want 2");
  out.letters = {in.axes_size() == 2 ? in.axes(0) : "A", in.axes_size() == 2 ? in.axes(1) : "B"};
  out.inputs = {calibration.inputs().begin(), calibration.inputs().end()};
  out.linear_response = metrology::LineResponse(out.axes);  // of one that did not keep its own
  if (!in.has_linear_response()) return out;
  const absl::StatusOr<Eigen::MatrixXd> response = runtime::FromProto("linear_response", in.linear_response());
  if (!response.ok()) return Damaged(calibration, std::string(response.status().message()));
  if (response->rows() != metrology::kAxisParameterCount || response->cols() != metrology::kLinearParameterCount)
    return Damaged(calibration, "linear_response of another size");
  out.linear_response = *response;
  return out;
}

std::vector<double> Radians(const google::protobuf::RepeatedField<double>& values_deg) {
  std::vector<double> values_rad;
  for (const double value : values_deg) values_rad.push_back(value * runtime::kRadPerDeg);
  return values_rad;
}

absl::StatusOr<FetchedAxis> AxisOf(const Calibration& calibration) {
  if (!calibration.has_axis()) return runtime::Refuse("calibration", calibration.name(), "a calibration of kind AXIS");
  const calibration::v1::AxisCharacterisation& in = calibration.axis();
  FetchedAxis out;
  out.name = calibration.name();
  out.axis = in.axis();
  out.valid_until = runtime::MomentOf(calibration.valid_until());
  metrology::AngleTable table{Radians(in.table().forward_error_deg()), Radians(in.table().backward_error_deg())};
  if (absl::Status s = table.Check(); !s.ok()) return Damaged(calibration, std::string(s.message()));
  out.positioning.table = std::move(table);
  const double uncertainty_deg = in.compensated_standard_uncertainty().value_deg();
  if (!(uncertainty_deg >= 0 && uncertainty_deg < 10))
    return Damaged(calibration, "compensated_standard_uncertainty: " + NumberText(uncertainty_deg) + " deg");
  out.positioning.standard_uncertainty_rad = uncertainty_deg * runtime::kRadPerDeg;
  const double whole_deg = in.standard_uncertainty().value_deg();
  if (!(whole_deg >= 0 && whole_deg < 10))
    return Damaged(calibration, "standard_uncertainty: " + NumberText(whole_deg) + " deg");
  out.whole_standard_uncertainty_rad = whole_deg * runtime::kRadPerDeg;
  return out;
}

}  // namespace

absl::StatusOr<FetchedArmStudy> ArmOf(const calibration::v1::Study& study) {
  std::vector<metrology::ArmDisplacement> displacements;
  for (const calibration::v1::ArmDisplacement& in : study.arm().displacements()) {
    metrology::ArmDisplacement& one = displacements.emplace_back();
    one.translation_mm = {in.dx_mm(), in.dy_mm(), in.dz_mm()};
    one.angles = {in.dalpha_deg() * runtime::kRadPerDeg, in.dbeta_deg() * runtime::kRadPerDeg,
                  in.dgamma_deg() * runtime::kRadPerDeg};
  }
  // dx, dy, dz in mm or um, then dalpha, dbeta, dgamma in deg.
  metrology::Vector6d sigma = metrology::Vector6d::Zero();
  for (const calibration::v1::Spread& in : study.arm().spreads()) {
    static const std::vector<std::string> kOrder = {"dalpha", "dbeta", "dgamma", "dx", "dy", "dz"};
    const auto found = std::find(kOrder.begin(), kOrder.end(), in.quantity());
    if (found == kOrder.end()) continue;
    const double unit = in.unit() == "deg" ? runtime::kRadPerDeg : in.unit() == "um" ? 1e-3 : 1;
    sigma[found - kOrder.begin()] = unit * in.stated_standard_uncertainty();
  }
  const absl::StatusOr<metrology::ArmSpread> spread = metrology::ArmSpreadOf(displacements, sigma);
  if (!spread.ok()) return absl::DataLossError(study.name() + ": " + std::string(spread.status().message()));
  return FetchedArmStudy{study.name(), *spread};
}

struct CalibrationClient::Stubs {
  std::unique_ptr<calibration::v1::CalibrationService::Stub> calibrations;
  std::unique_ptr<calibration::v1::StudyService::Stub> studies;
};

CalibrationClient::CalibrationClient(const std::shared_ptr<grpc::Channel>& calibration)
    : stubs_(new Stubs{calibration::v1::CalibrationService::NewStub(calibration),
                       calibration::v1::StudyService::NewStub(calibration)}) {}
CalibrationClient::~CalibrationClient() = default;

absl::StatusOr<std::optional<FetchedArmStudy>> CalibrationClient::ArmStudy(
    const std::string& machine, std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::ListStudiesRequest request;
  request.set_machine(machine);
  request.set_kind(calibration::v1::STUDY_KIND_ARM);
  request.set_page_size(1);
  calibration::v1::ListStudiesResponse found;
  if (const grpc::Status s = stubs_->studies->ListStudies(context.get(), request, &found); !s.ok())
    return runtime::FromGrpc(s);
  if (found.studies().empty()) return std::nullopt;
  absl::StatusOr<FetchedArmStudy> arm = ArmOf(found.studies(0));
  if (!arm.ok()) return arm.status();
  return *std::move(arm);
}

absl::StatusOr<FetchedArmStudy> CalibrationClient::ArmStudyOf(const std::string& name,
                                                              std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::GetStudyRequest request;
  request.set_name(name);
  calibration::v1::Study study;
  if (const grpc::Status s = stubs_->studies->GetStudy(context.get(), request, &study); !s.ok())
    return runtime::FromGrpc(s);
  return ArmOf(study);
}

absl::Status CalibrationClient::CheckNotMoved(const std::string& field, const FetchedSensorCalibration& sensor,
                                              const google::protobuf::Timestamp& scans_received_at) {
  if (!sensor.interim || sensor.interim->verdict() == calibration::v1::STUDY_VERDICT_ACCEPTED) return absl::OkStatus();
  // A scanner that was knocked stays where it went: it stood as calibrated before every check that was accepted.
  const bool is_known = scans_received_at.seconds() != 0;
  if (is_known && sensor.interim->has_stood_until() &&
      runtime::MomentOf(scans_received_at) <= runtime::MomentOf(sensor.interim->stood_until()))
    return absl::OkStatus();
  return runtime::Failure(errors::v1::SENSOR_MOVED,
                          field + ": " + sensor.name + ", whose newest interim check (" + sensor.interim->study() +
                              ") did not find the scanner where it was calibrated, want one of later scans "
                              "accepted by a limit not greater, or a new calibration and scans",
                          {{"resource", sensor.name}, {"study", sensor.interim->study()}});
}

absl::Status CalibrationClient::CheckMaps(const std::string& field, const FetchedSensorCalibration& sensor,
                                          const ingest::v1::ScanHeader& scan) {
  const bool maps_snapshots = sensor.sensor.cloud == metrology::CloudKind::kSnapshot;
  if (maps_snapshots == (scan.cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT)) return absl::OkStatus();
  return runtime::Failure(errors::v1::SENSOR_UNSUITABLE,
                          field +
                              ".cloud: " + (maps_snapshots ? "PROFILES, want SNAPSHOT" : "SNAPSHOT, want PROFILES") +
                              ", which " + sensor.name + " maps",
                          {{"resource", sensor.name}});
}

absl::StatusOr<bool> CalibrationClient::CheckedInClamping(const std::string& sensor_calibration,
                                                          const std::string& clamping, double limit_um,
                                                          std::unique_ptr<grpc::ClientContext> context) const {
  if (clamping.empty()) return false;
  calibration::v1::ListStudiesRequest request;
  request.set_kind(calibration::v1::STUDY_KIND_INTERIM_CHECK);
  request.set_verdict(calibration::v1::STUDY_VERDICT_ACCEPTED);
  request.set_sensor_calibration(sensor_calibration);
  request.set_clamping(clamping);
  calibration::v1::ListStudiesResponse found;
  if (const grpc::Status s = stubs_->studies->ListStudies(context.get(), request, &found); !s.ok())
    return runtime::FromGrpc(s);
  return std::any_of(found.studies().begin(), found.studies().end(),
                     [&](const calibration::v1::Study& study) { return study.interim_check().limit_um() <= limit_um; });
}

absl::StatusOr<FetchedSensorCalibration> CalibrationClient::SensorInForce(
    const std::string& machine, std::unique_ptr<grpc::ClientContext> context) const {
  return SensorInForceAt(machine, {}, std::move(context));
}

absl::StatusOr<FetchedSensorCalibration> CalibrationClient::SensorInForceAt(
    const std::string& machine, const google::protobuf::Timestamp& at,
    std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::GetCalibrationInForceRequest request;
  request.set_machine(machine);
  request.set_kind(calibration::v1::CALIBRATION_KIND_SENSOR);
  if (at.seconds() != 0) *request.mutable_at() = at;
  Calibration found;
  if (const grpc::Status s = stubs_->calibrations->GetCalibrationInForce(context.get(), request, &found); !s.ok())
    return runtime::FromGrpc(s);
  return SensorOf(found);
}

absl::StatusOr<FetchedRotationCalibration> CalibrationClient::RotationInForce(
    const std::string& machine, std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::GetCalibrationInForceRequest request;
  request.set_machine(machine);
  request.set_kind(calibration::v1::CALIBRATION_KIND_ROTATION);
  Calibration found;
  if (const grpc::Status s = stubs_->calibrations->GetCalibrationInForce(context.get(), request, &found); !s.ok())
    return runtime::FromGrpc(s);
  return RotationOf(found);
}

absl::StatusOr<Calibration> CalibrationClient::Get(const std::string& name,
                                                   std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::GetCalibrationRequest request;
  request.set_name(name);
  Calibration found;
  if (const grpc::Status s = stubs_->calibrations->GetCalibration(context.get(), request, &found); !s.ok())
    return runtime::FromGrpc(s);
  return found;
}

absl::StatusOr<FetchedSensorCalibration> CalibrationClient::Sensor(const std::string& name,
                                                                   std::unique_ptr<grpc::ClientContext> context) const {
  const absl::StatusOr<Calibration> found = Get(name, std::move(context));
  if (!found.ok()) return found.status();
  return SensorOf(*found);
}

absl::StatusOr<FetchedRotationCalibration> CalibrationClient::Rotation(
    const std::string& name, std::unique_ptr<grpc::ClientContext> context) const {
  const absl::StatusOr<Calibration> found = Get(name, std::move(context));
  if (!found.ok()) return found.status();
  return RotationOf(*found);
}

absl::StatusOr<std::optional<FetchedAxis>> CalibrationClient::AxisInForce(
    const std::string& machine, const std::string& axis, std::unique_ptr<grpc::ClientContext> context) const {
  calibration::v1::GetCalibrationInForceRequest request;
  request.set_machine(machine);
  request.set_kind(calibration::v1::CALIBRATION_KIND_AXIS);
  request.set_axis(axis);
  Calibration found;
  if (const grpc::Status s = stubs_->calibrations->GetCalibrationInForce(context.get(), request, &found); !s.ok()) {
    const absl::Status status = runtime::FromGrpc(s);
    if (runtime::HasReason(status, errors::v1::CALIBRATION_MISSING)) return std::nullopt;
    return status;
  }
  return AxisOf(found);
}

absl::StatusOr<FetchedAxis> CalibrationClient::Axis(const std::string& name,
                                                    std::unique_ptr<grpc::ClientContext> context) const {
  const absl::StatusOr<Calibration> found = Get(name, std::move(context));
  if (!found.ok()) return found.status();
  return AxisOf(*found);
}

absl::Status CalibrationClient::NotInForce(const std::string& field, const std::string& used,
                                           const std::string& in_force,
                                           std::unique_ptr<grpc::ClientContext> context) const {
  const absl::StatusOr<Calibration> known = Get(used, std::move(context));
  if (!known.ok()) return known.status();
  const Calibration& found = *known;
  const std::string wanted = ", want a registration that rests on the calibration in force";
  if (found.state() == calibration::v1::CALIBRATION_STATE_WITHDRAWN)
    return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                            field + ": " + used + ", withdrawn by " + found.withdrawal().requested_by() + " (" +
                                found.withdrawal().reason() + ")" + wanted + " (" + in_force + ")",
                            {{"resource", used}, {"in_force", in_force}});
  return runtime::Failure(errors::v1::CALIBRATION_EXPIRED, field + ": " + used + ", superseded by " + in_force + wanted,
                          {{"resource", used}, {"in_force", in_force}});
}

}  // namespace sixpoint::clients
