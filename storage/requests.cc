#include "storage/requests.h"

#include "storage/blobs.h"
#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

// A lock on (call, id) until the transaction ends: of two retries at once the second waits and then finds what the first recorded.
constexpr char kLockRequest[] = "SELECT pg_advisory_xact_lock(hashtextextended($1 || ' ' || $2, 0))";
constexpr char kSelectKept[] =
    "SELECT r.request_sha256, n.name FROM requests r JOIN record_names n ON n.record_id = r.record_id "
    "WHERE r.request_id = $2::uuid AND r.call = $1";
constexpr char kInsertKept[] =
    "INSERT INTO requests (call, request_id, request_sha256, record_id) "
    "SELECT $1, $2::uuid, $3, n.record_id FROM record_names n WHERE n.name = $4";

}  // namespace

KeptRequest KeptRequestOf(const RecordedRequest& request) {
  return {request.call, request.request_id, Sha256Hex(request.bytes), request.trace_id};
}

absl::Status RequestIdReused(const std::string& request_id) {
  return WithReason(
      absl::AlreadyExistsError("request_id: " + request_id + " was used for another request, want a new id"),
      kRequestIdReused);
}

absl::StatusOr<std::optional<std::string>> FindKept(Transaction& transaction, const RecordedRequest& request) {
  if (request.request_id.empty()) return std::nullopt;
  const Params key = Params().Text(request.call).Text(request.request_id);
  const absl::StatusOr<Rows> locked = transaction.Execute(kLockRequest, key);
  if (!locked.ok()) return locked.status();
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectKept, key);
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  const std::string known_sha256 = rows->Digest(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  if (known_sha256 != Sha256Hex(request.bytes)) return RequestIdReused(request.request_id);
  return rows->Checked(rows->Text(0, 1));
}

absl::Status KeepRequest(Transaction& transaction, const std::optional<KeptRequest>& request, const std::string& name) {
  if (!request || request->request_id.empty()) return absl::OkStatus();
  const absl::StatusOr<Rows> kept = transaction.Execute(
      kInsertKept, Params().Text(request->call).Text(request->request_id).Digest(request->sha256).Text(name));
  if (!kept.ok()) return kept.status();
  if (kept->affected() != 1)
    return absl::FailedPreconditionError("request: gives " + name + ", want something recorded");
  return absl::OkStatus();
}

// The digest's first bits, but for those that say the version and the variant.
std::string UuidFrom(std::string_view text) {
  std::string id = Sha256Hex(text).substr(0, 32);
  id[12] = '8';
  id[16] = "89ab"[id[16] % 4];
  for (const std::size_t dash : {20, 16, 12, 8}) id.insert(dash, "-");
  return id;
}

}  // namespace sixpoint::storage
