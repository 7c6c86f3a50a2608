// sixpoint.plant.v1.WebhookService.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "services/plant/webhook_sender.h"
#include "sixpoint/plant/v1/webhook.grpc.pb.h"
#include "storage/webhooks.h"

namespace sixpoint::plant {

class WebhookService final : public v1::WebhookService::Service {
 public:
  WebhookService(std::shared_ptr<storage::WebhookStore> webhooks, std::shared_ptr<const storage::EventReader> journal,
                 std::unique_ptr<WebhookSender> sender)
      : webhooks_(std::move(webhooks)), journal_(std::move(journal)), sender_(std::move(sender)) {}

  grpc::Status CreateWebhook(grpc::ServerContext* context, const v1::CreateWebhookRequest* request,
                             v1::CreateWebhookResponse* response) override;
  grpc::Status WithdrawWebhook(grpc::ServerContext* context, const v1::WithdrawWebhookRequest* request,
                               v1::Webhook* response) override;
  grpc::Status GetWebhook(grpc::ServerContext* context, const v1::GetWebhookRequest* request,
                          v1::Webhook* response) override;
  grpc::Status ListWebhooks(grpc::ServerContext* context, const v1::ListWebhooksRequest* request,
                            v1::ListWebhooksResponse* response) override;
  grpc::Status TestWebhook(grpc::ServerContext* context, const v1::TestWebhookRequest* request,
                           v1::TestWebhookResponse* response) override;
  // Sends nothing more.
  void Stop() { sender_->Stop(); }

 private:
  absl::StatusOr<storage::WebhookRow> Find(const grpc::ServerContext& context, const storage::Reader& reader,
                                           const std::string& name) const;

  const std::shared_ptr<storage::WebhookStore> webhooks_;
  const std::shared_ptr<const storage::EventReader> journal_;
  const std::unique_ptr<WebhookSender> sender_;
};

}  // namespace sixpoint::plant
