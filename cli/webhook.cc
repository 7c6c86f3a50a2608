// `sixpoint webhook`: addresses that events are sent to.
#include <cstdio>
#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/table.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/webhook.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::Webhook;
using plant::v1::WebhookService;

std::string WebhookStateText(const Webhook& webhook) {
  if (webhook.has_withdrawn_at()) return "withdrawn";
  if (webhook.has_failing_since()) return "failing";
  return webhook.has_delivered_at() ? "delivers" : "nothing sent yet";
}

std::string WebhookText(const Webhook& webhook) {
  std::string text =
      webhook.name() + ": " + WebhookStateText(webhook) + "\n  to        " + webhook.url() + "\n  made      " +
      TimeText(webhook.created_at()) + " by " + webhook.requested_by() + "\n  delivered " +
      (webhook.has_delivered_at()
           ? "up to " + std::to_string(webhook.delivered_sequence()) + " at " + TimeText(webhook.delivered_at())
           : std::string("nothing")) +
      "\n  behind    " + std::to_string(webhook.lag_count()) + " entries of the journal\n";
  if (webhook.has_failing_since())
    text += "  failing   since " + TimeText(webhook.failing_since()) + ", " + std::to_string(webhook.failure_count()) +
            " attempts\n";
  if (!webhook.last_failure().empty()) text += "  last failure: " + webhook.last_failure() + "\n";
  if (webhook.has_withdrawn_at())
    text += "  withdrawn " + TimeText(webhook.withdrawn_at()) + " by " + webhook.withdrawn_by() + "\n";
  return text;
}

std::string CreatedText(const plant::v1::CreateWebhookResponse& made) {
  return WebhookText(made.webhook()) + "  secret    " + made.secret() +
         "\nThe receiver checks signatures with the secret; it is not shown again.\n";
}

void AddAddCommand(Command* webhook, Session* session) {
  struct Arguments {
    std::string name, url, machine, blade, part;
    std::vector<std::string> kinds, verdicts;
    std::int64_t after = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* const add = webhook->AddCommand("add", "Sends events to an address from now on, and shows the secret once");
  add->AddOption("NAME", &arguments->name, "What it is to be called")->Required();
  add->AddOption("URL", &arguments->url, "https://... or http://...")->Required();
  AddKindsOption(add, &arguments->kinds);
  add->AddOption("--verdicts", &arguments->verdicts, "Only with one of these: NOT_CONFORM,UNDECIDABLE,...")->List();
  add->AddOption("--machine", &arguments->machine, "Only of this machine");
  add->AddOption("--blade", &arguments->blade, "Only of this blade: its serial number");
  add->AddOption("--part", &arguments->part, "Only of this part, its blades and what is recorded of them");
  const Option* const after = add->AddOption(
      "--after", &arguments->after, "Begins past this number, 0: with all that ever was; without it with what comes");
  session->OnCommand(add, [session, arguments, after]() -> absl::Status {
    plant::v1::CreateWebhookRequest request;
    request.set_webhook_id(arguments->name);
    request.set_url(arguments->url);
    const auto name = [](const char* collection, const std::string& id) {
      return id.empty() ? id : NameText(collection, id);
    };
    plant::v1::EventFilter& filter = *request.mutable_filter();
    for (const std::string& kind : arguments->kinds) filter.add_kinds(kind);
    for (const std::string& verdict : arguments->verdicts) filter.add_verdicts(verdict);
    filter.set_machine(name("machines", arguments->machine));
    filter.set_blade(name("blades", arguments->blade));
    filter.set_part(name("parts", arguments->part));
    request.set_after_sequence(arguments->after);
    request.set_from_now(!after->given());
    request.set_request_id(NewRequestId());
    return CallAndPrint<WebhookService>(session, "plant", &WebhookService::Stub::CreateWebhook, request, CreatedText)
        .status();
  });
}

// A command with NAME, and the call that it is for.
template <typename Request>
Command* AddNamed(Command* webhook, const std::string& name, const std::string& help,
                  const std::shared_ptr<Request>& request) {
  Command* const command = webhook->AddCommand(name, help);
  command->AddOption("NAME", request->mutable_name(), "As it was called")->Required();
  return command;
}

std::string TestText(const plant::v1::TestWebhookResponse& answer) {
  char took[40];
  std::snprintf(took, sizeof took, ", %.3f s\n", answer.took_s());
  if (answer.is_taken()) return "taken: HTTP " + std::to_string(answer.http_status()) + took;
  return "not taken: " + answer.failure() + took;
}

}  // namespace

void AddWebhookCommands(Command* app, Session* session) {
  Command* const webhook = app->AddCommand("webhook", "Addresses that events are sent to, for an MES that cannot ask");
  webhook->RequireCommand();
  AddAddCommand(webhook, session);
  AddListCommand<WebhookService>(webhook, session, "Lists them, with how far each has come", "plant",
                                 &WebhookService::Stub::ListWebhooks, plant::v1::ListWebhooksRequest(),
                                 Table({"name", "url", "state", ">delivered", ">behind", "last failure"}),
                                 &plant::v1::ListWebhooksResponse::webhooks, [](const Webhook& one) {
                                   return Cells{IdText(one.name()),
                                                one.url(),
                                                WebhookStateText(one),
                                                std::to_string(one.delivered_sequence()),
                                                std::to_string(one.lag_count()),
                                                one.last_failure().empty() ? "-" : one.last_failure()};
                                 });
  const auto shown = std::make_shared<plant::v1::GetWebhookRequest>();
  session->OnCommand(AddNamed(webhook, "show", "Shows one: where to, how far, and why it fails", shown),
                     [session, shown]() -> absl::Status {
                       shown->set_name(NameText("webhooks", shown->name()));
                       return CallAndPrint<WebhookService>(session, "plant", &WebhookService::Stub::GetWebhook, *shown,
                                                           WebhookText)
                           .status();
                     });
  const auto removed = std::make_shared<plant::v1::WithdrawWebhookRequest>();
  session->OnCommand(AddNamed(webhook, "remove", "Sends nothing more there, for ever", removed),
                     [session, removed]() -> absl::Status {
                       removed->set_name(NameText("webhooks", removed->name()));
                       removed->set_request_id(NewRequestId());
                       return CallAndPrint<WebhookService>(session, "plant", &WebhookService::Stub::WithdrawWebhook,
                                                           *removed, WebhookText)
                           .status();
                     });
  const auto tested = std::make_shared<plant::v1::TestWebhookRequest>();
  session->OnCommand(AddNamed(webhook, "test", "Sends a test event now, and says what came of it", tested),
                     [session, tested]() -> absl::Status {
                       tested->set_name(NameText("webhooks", tested->name()));
                       tested->set_request_id(NewRequestId());
                       const auto answer = CallAndPrint<WebhookService>(
                           session, "plant", &WebhookService::Stub::TestWebhook, *tested, TestText);
                       if (answer.ok() && !answer->is_taken()) session->MarkFailed();
                       return answer.status();
                     });
}

}  // namespace sixpoint::cli
