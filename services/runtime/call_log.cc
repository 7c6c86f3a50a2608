#include "services/runtime/call_log.h"

#include <absl/status/status.h>

#include <atomic>
#include <chrono>
#include <map>
#include <string>
#include <string_view>

#include "services/runtime/log.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

using grpc::experimental::InterceptionHookPoints;
using Clock = std::chrono::steady_clock;

std::atomic<int> calls_in_flight{0};

class CallLog : public grpc::experimental::Interceptor {
 public:
  explicit CallLog(const char* method) : method_(method) { ++calls_in_flight; }

  // The end of the call, however it came: without a status the client had gone.
  ~CallLog() override {
    const double duration_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin_).count();
    const bool at_fault = code_ == "INTERNAL" || code_ == "UNKNOWN" || code_ == "DATA_LOSS";
    Log(at_fault ? LogLevel::kError : LogLevel::kInfo, "call",
        {{"trace_id", TraceIdOf(traceparent_)}, {"rpc", method_}, {"code", code_}, {"dur_ms", duration_ms}});
    --calls_in_flight;
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      TakeTraceparent(methods->GetRecvInitialMetadata());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      code_ = absl::StatusCodeToString(static_cast<absl::StatusCode>(methods->GetSendStatus().error_code()));
    }
    methods->Proceed();
  }

 private:
  void TakeTraceparent(std::multimap<grpc::string_ref, grpc::string_ref>* metadata) {
    if (metadata == nullptr) return;
    const auto given = metadata->find(kTraceparent);
    if (given != metadata->end()) {
      traceparent_.assign(given->second.data(), given->second.size());
      if (!TraceIdOf(traceparent_).empty()) return;
      metadata->erase(kTraceparent);
    }
    traceparent_ = NewTraceparent();
    metadata->emplace(kTraceparent, traceparent_);  // refers to our text, which lives as long as the call
  }

  const std::string method_;
  const Clock::time_point begin_ = Clock::now();
  std::string traceparent_;
  std::string code_ = "CANCELLED";
};

}  // namespace

int CallsInFlight() { return calls_in_flight; }

grpc::experimental::Interceptor* CallLogFactory::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) {
  const std::string_view method = info->method();
  // Probes come every few seconds for ever.
  if (method.rfind("/sixpoint.", 0) != 0) return nullptr;
  return new CallLog(info->method());
}

}  // namespace sixpoint::runtime
