// A value of a method, as it was stated or as it is usually.
#pragma once

#include <string>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {

// refusals: of one that is out of its bounds, "method.name".
inline double AppliedValue(const std::string& name, bool is_stated, double value, double usual, double least,
                           double most, runtime::Refusals* refusals) {
  if (!is_stated) return usual;
  if (!(value >= least && value <= most))
    refusals->Add(runtime::Refuse("method." + name, value, NumberText(least) + " to " + NumberText(most)));
  return value;
}

}  // namespace sixpoint::correction
