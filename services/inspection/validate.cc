#include "services/inspection/validate.h"

#include <algorithm>
#include <set>
#include <string>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

constexpr int kGreatestScanCount = 200;
constexpr std::size_t kLongestName = 256;

std::string ScanField(int index) { return "scans[" + std::to_string(index) + "]"; }

}  // namespace

absl::Status CheckInspect(const v1::InspectRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("blade", "blades", request.blade()).status())
      .Add(runtime::CheckUuid("request_id", request.request_id()));
  if (request.scans_size() == 0 || request.scans_size() > kGreatestScanCount)
    refusals.Add(runtime::Refuse("scans", std::to_string(request.scans_size()) + " scans", "1 to 200"));
  std::set<std::string> seen;
  for (int i = 0; i < std::min(request.scans_size(), kGreatestScanCount); ++i) {
    refusals.Add(runtime::IdOf(ScanField(i), "scans", request.scans(i)).status());
    if (!seen.insert(request.scans(i)).second)
      refusals.Add(runtime::Refuse(ScanField(i), request.scans(i), "each scan once"));
  }
  if (request.requested_by().size() > kLongestName)
    refusals.Add(runtime::Refuse("requested_by", request.requested_by(), "at most 256 bytes"));
  if (request.method() == registration::v1::METHOD_ALLOWANCE || !registration::v1::Method_IsValid(request.method()))
    refusals.Add(runtime::Refuse("method", registration::v1::Method_Name(request.method()),
                                 "six-point, six-point-normals, best-fit or local; a machined part is not its blank"));
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
