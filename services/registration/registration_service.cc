#include "services/registration/registration_service.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "services/registration/registration_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "storage/registrations.h"

namespace sixpoint::registration {
namespace {

using runtime::ToGrpc;

constexpr int kUsualPageSize = 100;
constexpr int kGreatestPageSize = 1000;

// A place among the running registrations, given back at the end of the call.
class Slot {
 public:
  Slot(std::atomic<int>* running, int most) : running_(running), taken_(running->fetch_add(1) < most) {}
  ~Slot() { running_->fetch_sub(1); }
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;
  bool taken() const { return taken_; }

 private:
  std::atomic<int>* running_;
  bool taken_;
};

Caller CallerOf(const grpc::ServerContext* context) {
  return {runtime::DeadlineOf(*context), [context] { return runtime::ContextFor(*context); },
          runtime::KeepGoing(*context)};
}

// The next page starts below this sequence.
absl::StatusOr<std::int64_t> SequenceOf(const std::string& token) {
  if (token.empty()) return 0;
  std::int64_t sequence = 0;
  const auto read = std::from_chars(token.data(), token.data() + token.size(), sequence);
  if (read.ec != std::errc() || read.ptr != token.data() + token.size() || sequence < 1)
    return runtime::Refuse("page_token", token, "the next_page_token of the page before");
  return sequence;
}

absl::StatusOr<v1::ListRegistrationsResponse> List(storage::Database* database, storage::Deadline deadline,
                                                   const v1::ListRegistrationsRequest& request) {
  std::string serial;
  if (!request.blade().empty()) {
    const absl::StatusOr<std::string> id = runtime::IdOf("blade", "blades", request.blade());
    if (!id.ok()) return id.status();
    serial = *id;
  }
  const absl::StatusOr<std::int64_t> before = SequenceOf(request.page_token());
  if (!before.ok()) return before.status();
  if (request.page_size() < 0) return runtime::Refuse("page_size", std::to_string(request.page_size()), "0 to 1000");
  const int size = request.page_size() == 0 ? kUsualPageSize : std::min(request.page_size(), kGreatestPageSize);
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows = storage::ListRegistrations(*transaction, serial, *before, size + 1);
  if (!rows.ok()) return rows.status();
  v1::ListRegistrationsResponse response;
  for (const storage::RegistrationRow& row : *rows) {
    if (response.registrations_size() == size) {
      response.set_next_page_token(std::to_string(response.registrations(size - 1).record_sequence()));
      break;
    }
    *response.add_registrations() = ToProto(row);
  }
  return response;
}

}  // namespace

RegistrationService::RegistrationService(storage::Database* database, const Peers& peers, int threads)
    : database_(database), registrar_(database, peers, threads) {}

grpc::Status RegistrationService::Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                                           v1::Registration* response) {
  const Slot slot(&running_, kMostRunning);
  if (!slot.taken())
    return ToGrpc(runtime::Failure(
        absl::StatusCode::kResourceExhausted, "REGISTRATIONS_FULL",
        "registrations: " + std::to_string(kMostRunning) + " are running, want fewer at once; try again"));
  absl::StatusOr<v1::Registration> result = registrar_.Register(*request, CallerOf(context));
  if (result.ok()) *response = *std::move(result);
  return ToGrpc(result.status());
}

grpc::Status RegistrationService::GetRegistration(grpc::ServerContext* context,
                                                  const v1::GetRegistrationRequest* request,
                                                  v1::Registration* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "registrations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const auto found = storage::FindRegistration(*transaction, *id);
  if (!found.ok()) return ToGrpc(found.status());
  if (!found->has_value())
    return ToGrpc(absl::NotFoundError("name: " + request->name() + ", want a registration that is recorded"));
  *response = ToProto(**found);
  return grpc::Status::OK;
}

grpc::Status RegistrationService::ListRegistrations(grpc::ServerContext* context,
                                                    const v1::ListRegistrationsRequest* request,
                                                    v1::ListRegistrationsResponse* response) {
  absl::StatusOr<v1::ListRegistrationsResponse> page = List(database_, runtime::DeadlineOf(*context), *request);
  if (page.ok()) *response = *std::move(page);
  return ToGrpc(page.status());
}

}  // namespace sixpoint::registration
