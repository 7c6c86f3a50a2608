#include "services/inspection/inspect.h"

#include "services/clients/references.h"
#include "services/clients/stations.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

// The certificate of each group's pins held when they were scanned.
absl::Status CheckPins(const plant::v1::Part& part, const ingest::v1::Scan& scan) {
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    const std::string field = part.name() + ".hole_groups." + group.group() + ".gauge_pin.certificate";
    absl::Status held =
        clients::CheckCertificate(field, group.gauge_pin().has_certificate(), group.gauge_pin().certificate(),
                                  runtime::MomentOf(scan.received_at()));
    if (!held.ok()) return held;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<metrology::BladeFindings> InspectBlade(const clients::ScanClient& scans, const Inputs& inputs,
                                                      int thread_count, const runtime::Caller& caller) {
  metrology::InspectionOptions options;
  options.threads = thread_count;
  options.keep_going = caller.keep_going;
  options.other_zero_from_part = inputs.compared.other_zero_from_part;
  auto neighbours = clients::NeighboursOf(inputs.registration.station(), inputs.part);
  if (!neighbours.ok()) return neighbours.status();
  options.neighbours = *std::move(neighbours);
  metrology::BladeInspection inspection(inputs.surface, inputs.holes, *inputs.pose, inputs.sensor, inputs.axes,
                                        options);
  // Some blocks of it are decoded and compared at a time.
  const auto add = [&](int, const clients::StoredBlocks& scan) {
    if (absl::Status status = CheckPins(inputs.part, scan.record); !status.ok()) return status;
    inspection.Begin(scan.scan);
    return inspection.AddPieces(scan.blocks.size(), [&](std::size_t block) { return scan.DecodeOne(block); });
  };
  if (absl::Status status = clients::ForEachScan(scans, inputs, caller, add); !status.ok()) return status;
  return inspection.Finish();
}

}  // namespace sixpoint::inspection
