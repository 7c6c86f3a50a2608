#include "services/ingest/scan_pages.h"

#include "services/ingest/scan_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::ingest {
namespace {

std::string FiltersOf(const v1::ListScansRequest& request) {
  return request.machine() + "|" + request.subject() + "|" + std::to_string(request.kind());
}

absl::StatusOr<storage::ScanFilter> FilterOf(const v1::ListScansRequest& request) {
  storage::ScanFilter filter;
  const absl::StatusOr<std::string> machine = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine.ok()) return machine.status();
  filter.machine_id = *machine;
  if (request.subject().rfind("artefacts/", 0) == 0) {
    const absl::StatusOr<std::string> id = runtime::IdOf("subject", "artefacts", request.subject());
    if (!id.ok()) return id.status();
    filter.artefact_id = *id;
  } else if (!request.subject().empty()) {
    const absl::StatusOr<std::string> id = runtime::IdOf("subject", "blades", request.subject());
    if (!id.ok()) return id.status();
    filter.blade_serial = *id;
  }
  filter.kind = KindText(request.kind());
  if (filter.kind.empty() && request.kind() != v1::SCAN_KIND_UNSPECIFIED) {
    return runtime::Refuse("kind", std::to_string(request.kind()), "a known kind or none");
  }
  return filter;
}

}  // namespace

absl::StatusOr<ScanPage> PageOf(const v1::ListScansRequest& request) {
  absl::StatusOr<storage::ScanFilter> filter = FilterOf(request);
  if (!filter.ok()) return filter.status();
  const absl::StatusOr<runtime::Page> page =
      runtime::PageOf(FiltersOf(request), request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  return ScanPage{*std::move(filter), *page};
}

std::string TokenAfter(const v1::ListScansRequest& request, std::int64_t last_sequence) {
  return runtime::TokenAfter(FiltersOf(request), last_sequence);
}

}  // namespace sixpoint::ingest
