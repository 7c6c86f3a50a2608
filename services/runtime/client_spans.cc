#include "services/runtime/client_spans.h"

#include <map>
#include <optional>
#include <string>

#include "services/runtime/call_scope.h"
#include "services/runtime/log.h"
#include "services/runtime/span.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

using grpc::experimental::InterceptionHookPoints;

class ClientSpan : public grpc::experimental::Interceptor {
 public:
  explicit ClientSpan(const char* rpc) : rpc_(rpc) {}
  // One that was given up has no status.
  ~ClientSpan() override { End(grpc::StatusCode::CANCELLED); }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA))
      Begin(methods->GetSendInitialMetadata());
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_STATUS))
      if (const grpc::Status* const status = methods->GetRecvStatus()) End(status->error_code());
    methods->Proceed();
  }

 private:
  void Begin(std::multimap<std::string, std::string>* metadata) {
    if (metadata == nullptr || span_) return;
    const auto given = metadata->find(kTraceparent);
    const std::string parent = given == metadata->end() ? CurrentTraceparent() : given->second;
    span_.emplace(Span::Kind::kClient, rpc_, parent);
    metadata->erase(kTraceparent);
    metadata->emplace(kTraceparent, span_->traceparent());
  }

  void End(grpc::StatusCode code) {
    // A program's standard error is for people.
    if (span_ && !has_ended_ && !LoggedService().empty()) span_->Write(LogLevel::kInfo, code, nullptr);
    has_ended_ = true;
  }

  const std::string rpc_;
  std::optional<Span> span_;
  bool has_ended_ = false;
};

}  // namespace

grpc::experimental::Interceptor* ClientSpans::CreateClientInterceptor(grpc::experimental::ClientRpcInfo* info) {
  return new ClientSpan(info->method());
}

}  // namespace sixpoint::runtime
