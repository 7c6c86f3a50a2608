#include "services/correction/blade_points.h"

#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::correction {

absl::Status ReadBladePoints(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                             const runtime::Caller& caller,
                             const std::function<absl::Status(const metrology::LineScan&)>& begin,
                             const std::function<absl::Status(const metrology::Points&)>& add) {
  return clients::ForEachScan(scans, blade, caller, [&](int index, const clients::StoredBlocks& scan) -> absl::Status {
    if (scan.record.header().kind() == ingest::v1::SCAN_KIND_PINS)
      return runtime::Refuse("registration.scans[" + std::to_string(index) + "]", "a scan with pins in the holes",
                             "scans of the blank alone");
    absl::Status status = begin(scan.scan);
    for (std::size_t i = 0; status.ok() && i < scan.blocks.size(); ++i) {
      const auto points_mm = scan.DecodeOne(i);
      if (!points_mm.ok()) return points_mm.status();
      status = add(*points_mm);
    }
    return status;
  });
}

}  // namespace sixpoint::correction
