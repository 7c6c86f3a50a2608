// The budget of a hole's place: what each source makes uncertain of it.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

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

}  // namespace sixpoint::cli
