#include "cli/scan_transfer.h"

#include <utility>

#include "cli/output.h"
#include "services/clients/scan_upload.h"

namespace sixpoint::cli {

absl::StatusOr<ingest::v1::StoredScan> UploadScan(Session* session, const clients::OutgoingScan& scan,
                                                  const std::function<void(std::int64_t)>& acknowledged) {
  clients::UploadOptions options;
  options.retry = session->Limits();
  options.acknowledged = acknowledged;
  std::shared_ptr<grpc::Channel> channel;
  const absl::Status found = session->Retrying("ingest", [&](const auto& ingest, auto) {
    channel = ingest;
    return absl::OkStatus();
  });
  if (!found.ok()) return found;
  return clients::UploadScan(channel, scan, std::move(options));
}

absl::StatusOr<ingest::v1::StoredScan> UploadScanUnderFreeId(Session* session, clients::OutgoingScan scan,
                                                             const std::function<void(std::int64_t)>& acknowledged) {
  // An id may be found taken only by the end: what was told until then is not told again.
  std::int64_t told = 0, of_this = 0;
  const auto each_once = [&](std::int64_t count) {
    of_this += count;
    if (acknowledged && of_this > told) acknowledged(of_this - std::exchange(told, of_this));
  };
  auto stored = UploadScan(session, scan, each_once);
  if (stored.ok() || !absl::IsAlreadyExists(stored.status())) return stored;
  of_this = 0;
  scan.header.set_scan_id(IdText(scan.header.machine()) + "." + scan.header.scan_id());
  return UploadScan(session, scan, each_once);
}

absl::StatusOr<clients::FetchedScan> DownloadScan(Session* session, const std::string& scan_name,
                                                  const std::optional<clients::ProfileRange>& range) {
  absl::StatusOr<clients::FetchedScan> fetched;
  const absl::Status status = session->Retrying("ingest", [&](const auto& channel, auto context) {
    const clients::ScanClient client(channel);
    fetched = range.has_value() ? client.Fetch(scan_name, *range, std::move(context))
                                : client.Fetch(scan_name, std::move(context));
    return fetched.status();
  });
  if (!status.ok()) return status;
  return fetched;
}

}  // namespace sixpoint::cli
