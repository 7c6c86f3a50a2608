#include "services/ingest/scan_pages.h"

#include <charconv>

#include "services/ingest/scan_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "storage/blobs.h"

namespace sixpoint::ingest {
namespace {

constexpr int kUsualPageSize = 100;
constexpr int kGreatestPageSize = 1000;
constexpr std::size_t kMarkLength = 12;

// Ties a token to its filters.
std::string MarkOf(const v1::ListScansRequest& request) {
  return storage::Sha256Hex(request.machine() + "|" + request.subject() + "|" + std::to_string(request.kind()))
      .substr(0, kMarkLength);
}

absl::StatusOr<storage::ScanFilter> FilterOf(const v1::ListScansRequest& request) {
  storage::ScanFilter filter;
  if (!request.machine().empty()) {
    const absl::StatusOr<std::string> id = runtime::IdOf("machine", "machines", request.machine());
    if (!id.ok()) return id.status();
    filter.machine_id = *id;
  }
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
  ScanPage page;
  absl::StatusOr<storage::ScanFilter> filter = FilterOf(request);
  if (!filter.ok()) return filter.status();
  page.filter = *std::move(filter);
  if (request.page_size() < 0) {
    return runtime::Refuse("page_size", std::to_string(request.page_size()), "0 to 1000");
  }
  page.size = request.page_size() == 0 ? kUsualPageSize : std::min(request.page_size(), kGreatestPageSize);
  if (request.page_token().empty()) return page;
  const std::string mark = MarkOf(request) + "-";
  const char* const end = request.page_token().data() + request.page_token().size();
  const bool ours = request.page_token().rfind(mark, 0) == 0;
  const auto read =
      std::from_chars(request.page_token().data() + (ours ? mark.size() : 0), end, page.before_sequence, 16);
  if (!ours || read.ec != std::errc() || read.ptr != end || page.before_sequence < 1) {
    return runtime::Refuse("page_token", request.page_token(), "the next_page_token of a page with the same filters");
  }
  return page;
}

std::string TokenAfter(const v1::ListScansRequest& request, std::int64_t last_sequence) {
  char digits[17];
  const auto written = std::to_chars(digits, digits + sizeof digits, last_sequence, 16);
  return MarkOf(request) + "-" + std::string(digits, written.ptr);
}

}  // namespace sixpoint::ingest
