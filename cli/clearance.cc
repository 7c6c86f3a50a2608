// `sixpoint clearance`: who may see what is of which part.
#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/clearance.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::ClearanceService;

std::string UntilText(const plant::v1::Clearance& clearance) {
  return clearance.has_withdrawn_at() ? TimeText(clearance.withdrawn_at()) : "-";
}

std::string ClearanceText(const plant::v1::Clearance& clearance) {
  std::string text = clearance.holder() + " is cleared for " + clearance.scope() + " since " +
                     TimeText(clearance.granted_at()) + ", by " + clearance.granted_by() + "\n";
  if (clearance.has_withdrawn_at())
    text = clearance.holder() + " was cleared for " + clearance.scope() + " from " + TimeText(clearance.granted_at()) +
           " until " + UntilText(clearance) + "; withdrawn by " + clearance.withdrawn_by() + "\n";
  return text;
}

struct ClearanceArguments {
  std::string holder, scope;
};

// HOLDER and SCOPE, and the call that both are for.
template <typename Request>
void AddDecision(Command* clearance, Session* session, const std::string& name, const std::string& help,
                 grpc::Status (ClearanceService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                plant::v1::Clearance*)) {
  const auto arguments = std::make_shared<ClearanceArguments>();
  Command* const command = clearance->AddCommand(name, help);
  command->AddOption("HOLDER", &arguments->holder, "users/NAME, machines/ID or readers/LOGIN")->Required();
  command->AddOption("SCOPE", &arguments->scope, "customers/ID or parts/ID")->Required();
  session->OnCommand(command, [session, arguments, method]() -> absl::Status {
    Request request;
    request.set_holder(arguments->holder);
    request.set_scope(arguments->scope);
    request.set_request_id(NewRequestId());
    return CallAndPrint<ClearanceService>(session, "plant", method, request, ClearanceText).status();
  });
}

}  // namespace

void AddClearanceCommands(Command* app, Session* session) {
  Command* const clearance = app->AddCommand("clearance", "Who may see what of the parts that have a customer");
  clearance->RequireCommand();
  AddDecision<plant::v1::GrantClearanceRequest>(clearance, session, "grant", "Lets somebody see it from now on",
                                                &ClearanceService::Stub::GrantClearance);
  AddDecision<plant::v1::WithdrawClearanceRequest>(clearance, session, "withdraw",
                                                   "Hides it from him from the next call on",
                                                   &ClearanceService::Stub::WithdrawClearance);
  AddListCommand<ClearanceService>(
      clearance, session, "Lists who is cleared for what, and since when", "plant",
      &ClearanceService::Stub::ListClearances, plant::v1::ListClearancesRequest(),
      Table({"holder", "scope", "since", "by", "until", "withdrawn by"}),
      &plant::v1::ListClearancesResponse::clearances, [](const plant::v1::Clearance& entry) {
        return Cells{entry.holder(),     entry.scope(),    TimeText(entry.granted_at()),
                     entry.granted_by(), UntilText(entry), entry.withdrawn_by().empty() ? "-" : entry.withdrawn_by()};
      });
}

}  // namespace sixpoint::cli
