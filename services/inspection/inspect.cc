#include "services/inspection/inspect.h"

#include <future>

#include "services/clients/error_sources.h"
#include "services/clients/references.h"
#include "services/runtime/call_scope.h"
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

// Scan by scan, some blocks of it decoded and compared at a time; the next is fetched meanwhile.
absl::Status AddScans(const clients::ScanClient& scans, const Inputs& inputs, const runtime::Caller& caller,
                      metrology::BladeInspection* inspection) {
  const registration::v1::Registration& registration = inputs.registration;
  const auto fetch = [&, call = runtime::CurrentCall()](int i) {
    const runtime::CallScope scope(call);
    return scans.FetchBlocks(registration.scans(i), caller.make_context());
  };
  std::future<absl::StatusOr<clients::StoredBlocks>> next = std::async(std::launch::async, fetch, 0);
  for (int i = 0; i < registration.scans_size(); ++i) {
    absl::StatusOr<clients::StoredBlocks> fetched = next.get();
    if (!fetched.ok()) return fetched.status();
    if (i + 1 < registration.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    if (absl::Status status = CheckPins(inputs.part, fetched->record); !status.ok()) return status;
    const auto stretch = clients::StretchOf({inputs.machine, inputs.part, fetched->record.header()});
    if (!stretch.ok()) return stretch.status();
    fetched->scan.stretch = stretch->ratio;
    inspection->Begin(fetched->scan);
    absl::Status added =
        inspection->AddPieces(fetched->blocks.size(), [&](std::size_t block) { return fetched->DecodeOne(block); });
    if (!added.ok()) return added;
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
  metrology::BladeInspection inspection(inputs.surface, inputs.holes, *inputs.pose, inputs.sensor, inputs.axes,
                                        options);
  if (absl::Status status = AddScans(scans, inputs, caller, &inspection); !status.ok()) return status;
  return inspection.Finish();
}

}  // namespace sixpoint::inspection
