#include "simulator/blade_requests.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>

#include "metrology/frames/angles.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/retry.h"

namespace sixpoint::simulator {
namespace {

template <typename Request>
Request Named(const std::string& name) {
  Request request;
  request.set_name(name);
  request.set_request_id(runtime::NewRequestId());
  return request;
}

}  // namespace

calibration::v1::CalibrateSensorRequest SensorRequest(const std::string& machine, const std::string& artefact,
                                                      const TouchProbing& probing, double probe_noise_um) {
  calibration::v1::CalibrateSensorRequest request;
  request.set_machine(machine);
  request.set_artefact(artefact);
  calibration::v1::TouchData* touch = request.mutable_touch();
  for (const auto& [name, centre] : probing.centres_mm) {
    calibration::v1::NamedPoint* point = touch->add_centres();
    point->set_feature(name);
    runtime::ToProto(centre, point->mutable_point_mm());
  }
  for (const Eigen::Vector3d& point : probing.plane_mm) runtime::ToProto(point, touch->add_plane_mm());
  for (const Eigen::Vector3d& point : probing.side_x_mm) runtime::ToProto(point, touch->add_side_x_mm());
  for (const Eigen::Vector3d& point : probing.side_y_mm) runtime::ToProto(point, touch->add_side_y_mm());
  touch->set_standard_uncertainty_um(probe_noise_um);
  request.set_method(calibration::v1::SENSOR_METHOD_JOINT);
  request.set_request_id(runtime::NewRequestId());
  return request;
}

calibration::v1::CalibrateRotationRequest RotationRequest(const std::string& machine,
                                                          const std::vector<ProbedSphere>& probed) {
  calibration::v1::CalibrateRotationRequest request;
  request.set_machine(machine);
  for (const ProbedSphere& sphere : probed) {
    calibration::v1::SpherePose* pose = request.add_poses();
    pose->set_a_deg(sphere.a_deg);
    pose->set_b_deg(sphere.b_deg);
    runtime::ToProto(sphere.centre_mm, pose->mutable_centre_mm());
    pose->set_held_out(sphere.held_out);
  }
  request.set_method(calibration::v1::ROTATION_METHOD_LINES);
  request.set_request_id(runtime::NewRequestId());
  return request;
}

correction::v1::ReleaseCorrectionRequest ReleaseRequest(const std::string& correction, const std::string& reason) {
  auto request = Named<correction::v1::ReleaseCorrectionRequest>(correction);
  request.set_reason(reason);
  return request;
}

correction::v1::FetchProgramRequest FetchRequest(const std::string& correction, const std::string& machine,
                                                 const std::string& blade, const std::string& clamping) {
  auto request = Named<correction::v1::FetchProgramRequest>(correction);
  request.set_machine(machine);
  request.set_blade(blade);
  request.set_clamping(clamping);
  return request;
}

correction::v1::ReportCutRequest CutRequest(const std::string& correction, const DesignedPart& part) {
  auto request = Named<correction::v1::ReportCutRequest>(correction);
  for (const DesignedHoleGroup& group : part.hole_groups)
    for (const DesignedHole& hole : group.holes) {
      correction::v1::CutHole* cut = request.add_holes();
      cut->set_group(group.name);
      cut->set_hole(hole.name);
    }
  *request.mutable_cut_at() = google::protobuf::util::TimeUtil::GetCurrentTime();
  return request;
}

registration::v1::PlanMeasurementRequest PlanRequest(const std::string& machine, const std::string& part,
                                                     const std::string& station, bool six_points) {
  registration::v1::PlanMeasurementRequest request;
  request.set_machine(machine);
  request.set_part(part);
  request.set_station(station);
  request.set_six_points(six_points);
  return request;
}

double LeastCoverage(const registration::v1::MeasuringPlan& plan) {
  double least = 1;
  for (const registration::v1::RegionCoverage& region : plan.regions()) least = std::min(least, region.coverage());
  return least;
}

std::vector<ScanPlan> ScansOf(const registration::v1::MeasuringPlan& plan, double pitch_mm) {
  std::vector<ScanPlan> scans;
  for (const registration::v1::PlannedPortion& portion : plan.portions()) {
    ScanPlan& scan = scans.emplace_back();
    scan.v0_mm = {portion.v0_mm().x_mm(), portion.v0_mm().y_mm(), portion.v0_mm().z_mm()};
    scan.a_deg = portion.a_deg();
    scan.b_deg = portion.b_deg();
    scan.last_x_mm = portion.length_mm();
    scan.pitch_mm = pitch_mm;
  }
  return scans;
}

double WorstPlace_um(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other,
                     const std::vector<Eigen::Vector3d>& points_mm) {
  double worst = 0;
  for (const Eigen::Vector3d& point : points_mm) worst = std::max(worst, 1e3 * (one * point - other * point).norm());
  return worst;
}

double WorstStart_um(const correction::v1::Correction& correction, const DesignedPart& part, const MachineTruth& truth,
                     const Eigen::Isometry3d& zero_from_part) {
  using metrology::kRadPerDeg;
  double worst = 0;
  for (const correction::v1::CorrectedGroup& group : correction.groups()) {
    const Eigen::Isometry3d machine_from_part =
        truth.axes.MachineFromZero(group.a_deg() * kRadPerDeg, group.b_deg() * kRadPerDeg) * zero_from_part;
    for (const DesignedHoleGroup& designed : part.hole_groups)
      for (std::size_t i = 0; designed.name == group.group() && i < designed.holes.size(); ++i) {
        const geometry::v1::Point& start = group.holes(static_cast<int>(i)).start_mm();
        const Eigen::Vector3d off =
            machine_from_part * designed.holes[i].start_mm - Eigen::Vector3d(start.x_mm(), start.y_mm(), start.z_mm());
        worst = std::max(worst, 1e3 * off.norm());
      }
  }
  return worst;
}

}  // namespace sixpoint::simulator
