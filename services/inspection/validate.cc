#include "services/inspection/validate.h"

#include <string>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

std::string ScanField(int index) { return "scans[" + std::to_string(index) + "]"; }

}  // namespace

absl::Status CheckInspect(const v1::InspectRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("blade", "blades", request.blade()).status())
      .Add(runtime::CheckNames("scans", "scans", request.scans(), 1));
  if (request.method() == registration::v1::METHOD_ALLOWANCE || !registration::v1::Method_IsValid(request.method()))
    refusals.Add(runtime::Refuse("method", registration::v1::Method_Name(request.method()),
                                 "six-point, six-point-normals, best-fit or local; a machined part is not its blank"));
  if (!request.sensor_calibration().empty())
    refusals.Add(runtime::IdOf("sensor_calibration", "calibrations", request.sensor_calibration()).status());
  return refusals.status();
}

absl::Status CheckScan(int index, const ingest::v1::ScanHeader& header, const std::string& blade) {
  if (header.subject() != blade)
    return runtime::Refuse(ScanField(index), header.scan_id() + " of " + header.subject(), "a scan of " + blade);
  if (header.kind() != ingest::v1::SCAN_KIND_PINS) {
    return runtime::Refuse(ScanField(index),
                           header.scan_id() + " of the kind " + ingest::v1::ScanKind_Name(header.kind()),
                           "SCAN_KIND_PINS, the machined part with a pin in each hole");
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::inspection
