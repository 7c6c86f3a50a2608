#include "storage/requests.h"

#include "storage/blobs.h"

namespace sixpoint::storage {
namespace {

// A lock on (method, id) until the transaction ends: of two retries at once the second waits and then finds the answer.
constexpr char kLockRequest[] = "SELECT pg_advisory_xact_lock(hashtextextended($1 || ' ' || $2, 0))";
constexpr char kSelectAnswer[] = "SELECT request_sha256, response FROM requests WHERE method = $1 AND request_id = $2";
constexpr char kInsertAnswer[] =
    "INSERT INTO requests (method, request_id, request_sha256, response) VALUES ($1, $2, $3, $4)";

constexpr int kMostAttempts = 3;

absl::StatusOr<std::string> RecordNow(Database& database, const RecordedRequest& request, Deadline deadline,
                                      const std::function<absl::StatusOr<std::string>(Transaction&)>& work) {
  absl::StatusOr<Transaction> transaction = database.Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  absl::StatusOr<std::optional<std::string>> kept =
      FindAnswer(*transaction, request.call, request.request_id, request.bytes);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return **std::move(kept);
  absl::StatusOr<std::string> answer = work(*transaction);
  if (!answer.ok()) return answer;
  absl::Status status = KeepAnswer(*transaction, request.call, request.request_id, request.bytes, *answer);
  if (status.ok()) status = transaction->Commit();
  if (!status.ok()) return status;
  return answer;
}

}  // namespace

absl::StatusOr<std::optional<std::string>> FindAnswer(Transaction& transaction, std::string_view method,
                                                      const std::string& request_id, std::string_view request_bytes) {
  if (request_id.empty()) return std::nullopt;
  const Params key = Params().Text(method).Text(request_id);
  const absl::StatusOr<Rows> locked = transaction.Execute(kLockRequest, key);
  if (!locked.ok()) return locked.status();
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectAnswer, key);
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  const std::string known_sha256 = rows->Text(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  if (known_sha256 != Sha256Hex(request_bytes)) {
    return absl::AlreadyExistsError("request_id: " + request_id + " was used for another request, want a new id");
  }
  return rows->Checked(rows->Bytes(0, 1));
}

absl::Status KeepAnswer(Transaction& transaction, std::string_view method, const std::string& request_id,
                        std::string_view request_bytes, std::string_view response_bytes) {
  if (request_id.empty()) return absl::OkStatus();
  return transaction
      .Execute(kInsertAnswer,
               Params().Text(method).Text(request_id).Text(Sha256Hex(request_bytes)).Bytes(response_bytes))
      .status();
}

absl::StatusOr<std::optional<std::string>> FindAnswer(Database& database, const RecordedRequest& request,
                                                      Deadline deadline) {
  if (request.request_id.empty()) return std::nullopt;
  absl::StatusOr<Transaction> transaction = database.Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  return FindAnswer(*transaction, request.call, request.request_id, request.bytes);
}

absl::StatusOr<std::string> RecordOnce(Database& database, const RecordedRequest& request, Deadline deadline,
                                       const std::function<absl::StatusOr<std::string>(Transaction&)>& work) {
  absl::StatusOr<std::string> answer = RecordNow(database, request, deadline, work);
  for (int attempt = 1; attempt < kMostAttempts && absl::IsAborted(answer.status()); ++attempt)
    answer = RecordNow(database, request, deadline, work);
  return answer;
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
