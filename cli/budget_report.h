// The budget of a hole's place: what each source makes uncertain of it.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/output.h"
#include "refusal/refusal.h"
#include "sixpoint/uncertainty/v1/uncertainty.pb.h"

namespace sixpoint::cli {

struct HoleBudget {
  std::string hole;  // GROUP/HOLE
  double expanded_uncertainty_um = 0;
  google::protobuf::RepeatedPtrField<uncertainty::v1::UncertaintyComponent> components;
};

// A table of the asked hole, or of the one that is most uncertain where none is asked. INVALID_ARGUMENT: the result has no such hole;
// FAILED_PRECONDITION: it was made before budgets were kept, or nothing was measured.
absl::StatusOr<std::string> BudgetText(const std::string& result, const std::string& hole,
                                       const std::vector<HoleBudget>& holes);

// Of the asked hole, or of all: GROUP/HOLE to source to standard uncertainty (um).
nlohmann::json BudgetJson(const std::string& hole, const std::vector<HoleBudget>& holes);

template <typename Service, typename Request, typename Response, typename BudgetsOf>
absl::Status PrintBudget(Session* session, const std::string& noun, const std::string& name, const std::string& hole,
                         grpc::Status (Service::Stub::*get)(grpc::ClientContext*, const Request&, Response*),
                         BudgetsOf budgets_of) {
  Request request;
  request.set_name(NameText(noun + "s", name));
  Response found;
  absl::Status status = session->Call<Service>(noun, get, request, &found);
  if (!status.ok()) return status;
  const std::vector<HoleBudget> holes = budgets_of(found);
  const absl::StatusOr<std::string> text = BudgetText(found.name(), hole, holes);
  if (!text.ok()) return text.status();
  if (session->json)
    PrintJson(BudgetJson(hole, holes));
  else
    std::cout << *text;
  return absl::OkStatus();
}

// `NOUN budget ID [--hole GROUP/HOLE]`. get: the service's method that answers such a result; budgets_of(result): of its holes.
template <typename Service, typename Method, typename BudgetsOf>
void AddBudgetCommand(Command* parent, Session* session, const std::string& noun, const std::string& what, Method get,
                      BudgetsOf budgets_of) {
  struct Arguments {
    std::string name, hole;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* budget = parent->AddCommand("budget", "What each source makes uncertain of a hole's " + what);
  budget->AddOption("ID", &arguments->name, "The " + noun)->Required();
  budget->AddOption("--hole", &arguments->hole, "GROUP/HOLE; without it, the most uncertain one");
  session->OnCommand(
      budget, [=] { return PrintBudget<Service>(session, noun, arguments->name, arguments->hole, get, budgets_of); });
}

}  // namespace sixpoint::cli
