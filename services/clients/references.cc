#include "services/clients/references.h"

#include <google/protobuf/util/time_util.h>

#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::clients {

absl::Status CheckCertificate(const std::string& field, bool given, const plant::v1::Certificate& certificate,
                              std::chrono::system_clock::time_point at) {
  if (!given || at < runtime::MomentOf(certificate.expires_at())) return absl::OkStatus();
  return runtime::Failure(errors::v1::REFERENCE_EXPIRED,
                          field + ": " + certificate.number() + ", which ended on " +
                              google::protobuf::util::TimeUtil::ToString(certificate.expires_at()) +
                              ", want one that held when it was measured",
                          {{"resource", field}, {"certificate", certificate.number()}});
}

absl::Status CheckTouchProbe(const plant::v1::Machine& machine, std::chrono::system_clock::time_point at) {
  const plant::v1::TouchProbe& probe = machine.touch_probe();
  return CheckCertificate(machine.name() + ".touch_probe.certificate", probe.has_certificate(), probe.certificate(),
                          at);
}

double PositioningFigure_deg(const plant::v1::Machine& machine, const std::string& letter) {
  for (const plant::v1::Joint& joint : machine.kinematics().part_side())
    if (joint.axis() == letter) return joint.positioning_standard_uncertainty_deg();
  return 0;
}

absl::Status CheckLineScanner(const plant::v1::Machine& machine) {
  if (machine.sensor().kind() != plant::v1::SENSOR_KIND_SNAPSHOT) return absl::OkStatus();
  return runtime::Failure(errors::v1::SENSOR_UNSUITABLE,
                          machine.name() +
                              ".sensor.kind: SNAPSHOT, want a line scanner, whose profiles this needs; how a snapshot "
                              "sensor stands is stated (StateSensorPose)",
                          {{"resource", machine.name()}});
}

absl::Status CheckSnapshotSensor(const plant::v1::Machine& machine) {
  if (machine.sensor().kind() == plant::v1::SENSOR_KIND_SNAPSHOT) return absl::OkStatus();
  return runtime::Failure(errors::v1::SENSOR_UNSUITABLE,
                          machine.name() +
                              ".sensor.kind: LINE, want SNAPSHOT: how a line scanner stands is measured with an "
                              "artefact (CalibrateSensor)",
                          {{"resource", machine.name()}});
}

absl::Status CheckProfiles(const std::string& field, const ingest::v1::Scan& scan) {
  if (scan.header().cloud() != ingest::v1::CLOUD_KIND_SNAPSHOT) return absl::OkStatus();
  return runtime::Refuse(field, scan.name() + ", a snapshot", "profiles of a line scanner");
}

std::string CloudText(const ingest::v1::ScanHeader& scan) {
  return scan.cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT ? "SNAPSHOT" : "PROFILES";
}

}  // namespace sixpoint::clients
