// What the kernel says of this process, by the names that Prometheus' own clients give it, and what it was built from.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/runtime/metrics.h"

namespace sixpoint::runtime {

class ProcessMetrics {
 public:
  explicit ProcessMetrics(const std::string& area);

 private:
  std::vector<std::unique_ptr<Computed>> all_;
};

}  // namespace sixpoint::runtime
