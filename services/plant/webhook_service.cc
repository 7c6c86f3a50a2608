#include "services/plant/webhook_service.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "identity/message_code.h"
#include "services/plant/event_filter.h"
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
using storage::WebhookRow;

constexpr char kCollection[] = "webhooks";

void SetFilter(const storage::EventFilter& filter, v1::EventFilter* out) {
  const auto name = [](const char* collection, const std::string& id) {
    return id.empty() ? id : runtime::NameOf(collection, id);
  };
  for (const std::string& kind : filter.kinds) out->add_kinds(kind);
  for (const std::string& verdict : filter.verdicts) out->add_verdicts(verdict);
  out->set_machine(name("machines", filter.machine_id));
  out->set_blade(name("blades", filter.blade_serial));
  out->set_part(name("parts", filter.part_id));
}

v1::Webhook WebhookOf(const WebhookRow& row, std::int64_t newest_sequence) {
  v1::Webhook webhook;
  webhook.set_name(runtime::NameOf(kCollection, row.webhook_id));
  webhook.set_url(row.url);
  SetFilter(row.filter, webhook.mutable_filter());
  runtime::ToProto(row.recorded_at, webhook.mutable_created_at());
  webhook.set_requested_by(row.requested_by);
  if (row.withdrawn_at) runtime::ToProto(*row.withdrawn_at, webhook.mutable_withdrawn_at());
  webhook.set_withdrawn_by(row.withdrawn_by);
  const storage::WebhookDelivery& delivery = row.delivery;
  webhook.set_looked_at_sequence(delivery.looked_at_sequence);
  webhook.set_delivered_sequence(delivery.delivered_sequence);
  if (delivery.delivered_at) runtime::ToProto(*delivery.delivered_at, webhook.mutable_delivered_at());
  webhook.set_lag_count(std::max<std::int64_t>(newest_sequence - delivery.looked_at_sequence, 0));
  if (delivery.failing_since) runtime::ToProto(*delivery.failing_since, webhook.mutable_failing_since());
  webhook.set_failure_count(delivery.failure_count);
  webhook.set_last_failure(delivery.last_failure);
  return webhook;
}

// As the reader may be told it: tokens that stand in the address's query are its maker's.
WebhookRow WithoutTokens(WebhookRow row, const storage::Reader& reader) {
  if (row.reader.identity != reader.identity) row.url = row.url.substr(0, row.url.find_first_of("?#"));
  return row;
}

absl::Status NotThere(const std::string& name) {
  return runtime::Failure(errors::v1::WEBHOOK_NOT_FOUND, "name: " + name + ", want a webhook that was made",
                          {{"resource", name}});
}

// What is asked for, where it is sound; all that is wrong with it where it is not.
absl::StatusOr<WebhookRow> RowOf(const v1::CreateWebhookRequest& request, const storage::JournalNow& now) {
  WebhookRow row;
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("webhook_id", request.webhook_id()));
  if (const std::string wanted = WrongUrl(request.url()); !wanted.empty())
    refusals.Add(runtime::Refuse("url", request.url(), wanted));
  absl::StatusOr<storage::EventFilter> filter = EventFilterOf(request.filter(), now);
  refusals.Add(filter.status());
  if (!request.from_now()) refusals.Add(CheckAfterSequence(request.after_sequence(), now));
  if (!refusals.status().ok()) return refusals.status();
  row.webhook_id = request.webhook_id();
  row.url = request.url();
  row.filter = *std::move(filter);
  row.begins_after = request.from_now() ? now.newest_sequence : request.after_sequence();
  row.request_id = request.request_id();
  return row;
}

}  // namespace

grpc::Status WebhookService::CreateWebhook(grpc::ServerContext* context, const v1::CreateWebhookRequest* request,
                                           v1::CreateWebhookResponse* response) {
  const absl::StatusOr<storage::JournalNow> now = journal_->Now(runtime::DeadlineOf(*context));
  if (!now.ok()) return ToGrpc(now.status());
  absl::StatusOr<WebhookRow> row = RowOf(*request, *now);
  if (!row.ok()) return ToGrpc(row.status());
  row->secret = identity::NewMessageKey();
  row->reader = runtime::ReaderOf(*context);
  row->requested_by = runtime::RequestedBy(*context);
  const auto made = webhooks_->Create(*row, StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!made.ok()) return ToGrpc(made.status());
  *response->mutable_webhook() = WebhookOf(*made, now->newest_sequence);
  response->set_secret(SecretText(made->secret));
  return grpc::Status::OK;
}

grpc::Status WebhookService::WithdrawWebhook(grpc::ServerContext* context, const v1::WithdrawWebhookRequest* request,
                                             v1::Webhook* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", kCollection, request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const storage::Reader reader = runtime::ReaderOf(*context);
  const auto withdrawn = webhooks_->Withdraw({*id, runtime::RequestedBy(*context), request->request_id(), reader},
                                             StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!withdrawn.ok()) return ToGrpc(withdrawn.status());
  if (!withdrawn->has_value()) return ToGrpc(NotThere(request->name()));
  *response = WebhookOf(WithoutTokens(**withdrawn, reader), (*withdrawn)->delivery.looked_at_sequence);
  return grpc::Status::OK;
}

absl::StatusOr<WebhookRow> WebhookService::Find(const grpc::ServerContext& context, const storage::Reader& reader,
                                                const std::string& name) const {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", kCollection, name);
  if (!id.ok()) return id.status();
  const auto row = webhooks_->Find(*id, reader, runtime::DeadlineOf(context));
  if (!row.ok()) return row.status();
  if (!row->has_value()) return NotThere(name);
  return **row;
}

grpc::Status WebhookService::GetWebhook(grpc::ServerContext* context, const v1::GetWebhookRequest* request,
                                        v1::Webhook* response) {
  const storage::Reader reader = runtime::ReaderOf(*context);
  const absl::StatusOr<WebhookRow> row = Find(*context, reader, request->name());
  if (!row.ok()) return ToGrpc(row.status());
  const absl::StatusOr<storage::JournalNow> now = journal_->Now(runtime::DeadlineOf(*context));
  if (!now.ok()) return ToGrpc(now.status());
  *response = WebhookOf(WithoutTokens(*row, reader), now->newest_sequence);
  return grpc::Status::OK;
}

grpc::Status WebhookService::ListWebhooks(grpc::ServerContext* context, const v1::ListWebhooksRequest* request,
                                          v1::ListWebhooksResponse* response) {
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  const storage::Reader reader = runtime::ReaderOf(*context);
  const auto rows =
      webhooks_->List(request->withdrawn_too(), page->after_id, page->size + 1, reader, runtime::DeadlineOf(*context));
  if (!rows.ok()) return ToGrpc(rows.status());
  const absl::StatusOr<storage::JournalNow> now = journal_->Now(runtime::DeadlineOf(*context));
  if (!now.ok()) return ToGrpc(now.status());
  const absl::StatusOr<const WebhookRow*> last = runtime::AddPage(
      *rows, page->size,
      [&](const WebhookRow& row) { return WebhookOf(WithoutTokens(row, reader), now->newest_sequence); },
      response->mutable_webhooks());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr) response->set_next_page_token(runtime::TokenAfterId(filters, (*last)->webhook_id));
  return grpc::Status::OK;
}

grpc::Status WebhookService::TestWebhook(grpc::ServerContext* context, const v1::TestWebhookRequest* request,
                                         v1::TestWebhookResponse* response) {
  // Nothing of its filter is told here.
  const absl::StatusOr<WebhookRow> row = Find(*context, storage::Reader::Everything(), request->name());
  if (!row.ok()) return ToGrpc(row.status());
  if (row->withdrawn_at)
    return ToGrpc(runtime::Failure(errors::v1::WEBHOOK_WITHDRAWN,
                                   "name: " + request->name() + ", want one that was not withdrawn",
                                   {{"resource", request->name()}}));
  const absl::StatusOr<storage::JournalNow> now = journal_->Now(runtime::DeadlineOf(*context));
  if (!now.ok()) return ToGrpc(now.status());
  const auto began = std::chrono::steady_clock::now();
  const WebhookAnswer answer = sender_->Test(*row, request->request_id(), "urn:uuid:" + now->plant_id);
  response->set_is_taken(answer.is_taken());
  response->set_http_status(answer.http_status);
  response->set_failure(answer.failure);
  response->set_took_s(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
