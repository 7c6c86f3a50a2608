#include "services/plant/clearance_service.h"

#include <optional>
#include <string>
#include <vector>

#include "identity/identity.h"
#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;

// A login that reads SQL, by its name in the database: no identity, for it calls nothing (docs/sql.md).
bool IsReader(const std::string& holder) {
  constexpr std::size_t kPrefix = sizeof "readers/" - 1, kLongest = 63;
  if (holder.rfind("readers/", 0) != 0 || holder.size() == kPrefix || holder.size() > kPrefix + kLongest) return false;
  return holder[kPrefix] >= 'a' && holder[kPrefix] <= 'z' &&
         holder.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_", kPrefix) == std::string::npos;
}

absl::Status CheckHolder(const std::string& holder) {
  const bool is_machine = holder.rfind("machines/", 0) == 0;
  if (identity::IsUser(holder) || (is_machine && identity::IsIdentity(holder)) || IsReader(holder))
    return absl::OkStatus();
  return runtime::Refuse("holder", holder, "users/NAME, machines/ID or readers/LOGIN");
}

absl::Status CheckScope(const std::string& scope) {
  if (runtime::IdOf("scope", "customers", scope).ok() || runtime::IdOf("scope", "parts", scope).ok())
    return absl::OkStatus();
  return runtime::Refuse("scope", scope, "customers/ID or parts/ID");
}

template <typename Request>
absl::StatusOr<storage::ClearanceOrder> OrderOf(const Request& request, const grpc::ServerContext& context) {
  const absl::Status sound =
      runtime::Refusals().Add(CheckHolder(request.holder())).Add(CheckScope(request.scope())).status();
  if (!sound.ok()) return sound;
  return storage::ClearanceOrder{request.holder(), request.scope(), runtime::RequestedBy(context),
                                 request.request_id()};
}

v1::Clearance ClearanceOf(const storage::ClearanceRow& row) {
  v1::Clearance clearance;
  clearance.set_holder(row.holder);
  clearance.set_scope(row.scope);
  runtime::ToProto(row.granted_at, clearance.mutable_granted_at());
  clearance.set_granted_by(row.granted_by);
  if (row.withdrawn_at) runtime::ToProto(*row.withdrawn_at, clearance.mutable_withdrawn_at());
  clearance.set_withdrawn_by(row.withdrawn_by);
  return clearance;
}

}  // namespace

grpc::Status ClearanceService::GrantClearance(grpc::ServerContext* context, const v1::GrantClearanceRequest* request,
                                              v1::Clearance* response) {
  const absl::StatusOr<storage::ClearanceOrder> order = OrderOf(*request, *context);
  if (!order.ok()) return ToGrpc(order.status());
  const auto granted = clearances_->Grant(*order, StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (granted.ok()) *response = ClearanceOf(*granted);
  return ToGrpc(granted.status());
}

grpc::Status ClearanceService::WithdrawClearance(grpc::ServerContext* context,
                                                 const v1::WithdrawClearanceRequest* request, v1::Clearance* response) {
  const absl::StatusOr<storage::ClearanceOrder> order = OrderOf(*request, *context);
  if (!order.ok()) return ToGrpc(order.status());
  const auto withdrawn = clearances_->Withdraw(*order, StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!withdrawn.ok()) return ToGrpc(withdrawn.status());
  if (!withdrawn->has_value())
    return ToGrpc(
        runtime::Failure(errors::v1::CLEARANCE_NOT_FOUND,
                         "clearance: of " + order->holder + " for " + order->scope + ", want one that was granted",
                         {{"resource", order->holder}}));
  *response = ClearanceOf(**withdrawn);
  return grpc::Status::OK;
}

grpc::Status ClearanceService::ListClearances(grpc::ServerContext* context, const v1::ListClearancesRequest* request,
                                              v1::ListClearancesResponse* response) {
  runtime::Refusals refusals;
  if (!request->holder().empty()) refusals.Add(CheckHolder(request->holder()));
  if (!request->scope().empty()) refusals.Add(CheckScope(request->scope()));
  if (absl::Status sound = refusals.status(); !sound.ok()) return ToGrpc(sound);
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::ClearanceFilter filter{request->holder(), request->scope(), request->withdrawn_too()};
  const auto rows = clearances_->List(filter, page->before_sequence, page->size + 1, runtime::DeadlineOf(*context));
  if (!rows.ok()) return ToGrpc(rows.status());
  const absl::StatusOr<const storage::ClearanceRow*> last = runtime::AddPage(
      *rows, page->size, [](const storage::ClearanceRow& row) { return ClearanceOf(row); },
      response->mutable_clearances());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(runtime::TokenAfter(filters, (*last)->granted_sequence));
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
