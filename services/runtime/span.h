// One call's line in the log, which is a span too: beside the fields that people read it holds the span as OTLP/JSON has it, so that a
// collector reads the same file (docs/logs.md). Private to runtime.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <string>

#include "services/runtime/call_scope.h"
#include "services/runtime/log.h"

namespace sixpoint::runtime {

// Begins where it is made.
class Span {
 public:
  enum class Kind { kServer, kClient };
  // rpc: "/sixpoint.plant.v1.PlantService/GetBlade". Whoever it is part of by `parent`, a traceparent; empty: a new trace's first.
  Span(Kind kind, std::string rpc, const std::string& parent);
  const std::string& traceparent() const { return traceparent_; }
  // Written at its end. `facts`: what is known of it beside the span's own.
  void Write(LogLevel level, grpc::StatusCode code, const CallFacts* facts) const;

 private:
  const Kind kind_;
  const std::string rpc_, parent_, traceparent_;
  const std::chrono::system_clock::time_point begin_ = std::chrono::system_clock::now();
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace sixpoint::runtime
