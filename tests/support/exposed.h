// What whoever watches a service is told of it.
#pragma once

#include <string>

#include "services/runtime/metrics.h"

namespace sixpoint::testing {

// The value of a series, written with its labels, or 0 where none is told.
inline double Exposed(const std::string& series) {
  const std::string told = "\n" + runtime::ExpositionText(), wanted = "\n" + series + " ";
  const std::size_t at = told.find(wanted);
  return at == std::string::npos ? 0 : std::stod(told.substr(at + wanted.size()));
}

}  // namespace sixpoint::testing
