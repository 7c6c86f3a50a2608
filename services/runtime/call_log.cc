#include "services/runtime/call_log.h"

#include <absl/status/status.h>

#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "services/runtime/call_metrics.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/line_budget.h"
#include "services/runtime/log.h"
#include "services/runtime/span.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

using grpc::experimental::InterceptionHookPoints;
using Clock = std::chrono::steady_clock;

std::atomic<int> calls_in_flight{0};

struct OpenFacts {
  std::mutex mutex;
  std::map<const grpc::ServerContextBase*, std::shared_ptr<CallFacts>> by_context;
};
OpenFacts& Open() {
  static OpenFacts* const open = new OpenFacts();
  return *open;
}

// Of calls that were refused for who asked, or for how many did, and of those that ended before anybody was known.
LineBudget& Budget() {
  static LineBudget* const budget = new LineBudget();
  return *budget;
}

class CallLog : public grpc::experimental::Interceptor {
 public:
  CallLog(grpc::experimental::ServerRpcInfo* info, Denials* denials)
      : method_(info->method()), context_(*info->server_context()), denials_(*denials) {
    ++calls_in_flight;
    CallBegins(counts_);
  }

  // The end of the call, however it came: without a status the client had gone.
  ~CallLog() override {
    --calls_in_flight;
    {
      const std::lock_guard<std::mutex> lock(Open().mutex);
      // Its context may be gone before it, and another call's lie in the same place.
      const auto own = Open().by_context.find(&context_);
      if (own != Open().by_context.end() && own->second == facts_) Open().by_context.erase(own);
    }
    CallEnds(counts_, code_, Clock::now() - begin_);
    const bool is_nobodys = facts_ == nullptr || facts_->caller().empty();
    if ((is_refused_ || is_nobodys) && !Budget().Take()) return;  // who was denied is counted all the same
    if (!span_) Begin("");                                        // it ended before its metadata came
    const bool at_fault = code_ == grpc::StatusCode::INTERNAL || code_ == grpc::StatusCode::UNKNOWN ||
                          code_ == grpc::StatusCode::DATA_LOSS;
    span_->Write(at_fault ? LogLevel::kError : LogLevel::kInfo, code_, facts_.get());
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      TakeTraceparent(methods->GetRecvInitialMetadata());
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS))
      TakeStatus(methods->GetSendStatus());
    methods->Proceed();
  }

 private:
  void TakeStatus(const grpc::Status& status) {
    code_ = status.error_code();
    const absl::Status said = FromGrpc(status);
    caller_ = CallerText(said);
    if (facts_ != nullptr) facts_->SetCaller(caller_);
    const bool is_denied = absl::IsUnauthenticated(said) || absl::IsPermissionDenied(said);
    is_refused_ = is_denied || absl::IsResourceExhausted(said);
    if (!is_denied) return;
    // Its handler counts it, under the account that was meant (ServerOptions::count_refused_sign_in).
    if (HasReason(said, errors::v1::SIGN_IN_REFUSED)) return;
    denials_.Add(method_.substr(1), caller_, context_.peer(), ReasonOf(said), status.error_message());
  }

  // Nobody, until admission knows him: what a certificate or a session says by itself anybody can write. A certificate of ours that does
  // not count any more, or a role that is missing, was judged so far.
  std::string CallerText(const absl::Status& said) const {
    const auto shown = ShownIdentity(context_);
    if (!shown) return "";
    const bool is_admitted = facts_ != nullptr && !facts_->caller().empty();
    if (is_admitted || HasReason(said, errors::v1::ROLE_MISSING) || HasReason(said, errors::v1::SESSION_ENDED))
      return SessionOf(context_) ? RequestedBy(context_) : shown->Text();
    for (const ErrorReason reason :
         {errors::v1::CERTIFICATE_EXPIRED, errors::v1::CERTIFICATE_REVOKED, errors::v1::SESSION_NOT_VALID})
      if (HasReason(said, reason)) return shown->Text();
    return "";
  }

  void TakeTraceparent(std::multimap<grpc::string_ref, grpc::string_ref>* metadata) {
    if (metadata == nullptr || span_) return;
    const auto given = metadata->find(kTraceparent);
    Begin(given == metadata->end() ? "" : std::string(given->second.data(), given->second.size()));
    metadata->erase(kTraceparent);
    metadata->emplace(kTraceparent, span_->traceparent());  // refers to our text, which lives as long as the call
    const std::lock_guard<std::mutex> lock(Open().mutex);
    Open().by_context[&context_] = facts_;
  }

  void Begin(const std::string& parent) {
    span_.emplace(Span::Kind::kServer, method_, parent);
    facts_ = std::make_shared<CallFacts>(span_->traceparent(), method_);
  }

  const std::string method_;
  CallCounts* const counts_ = CallCountsOf(method_);
  const grpc::ServerContextBase& context_;  // lives as long as the call
  Denials& denials_;
  std::string caller_;
  bool is_refused_ = false;
  const Clock::time_point begin_ = Clock::now();
  std::optional<Span> span_;
  std::shared_ptr<CallFacts> facts_;
  grpc::StatusCode code_ = grpc::StatusCode::CANCELLED;
};

}  // namespace

std::shared_ptr<CallFacts> FactsOf(const grpc::ServerContextBase& context) {
  const std::lock_guard<std::mutex> lock(Open().mutex);
  const auto found = Open().by_context.find(&context);
  return found == Open().by_context.end() ? nullptr : found->second;
}

int CallsInFlight() { return calls_in_flight; }

grpc::experimental::Interceptor* CallLogFactory::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) {
  const std::string_view method = info->method();
  // Probes come every few seconds for ever.
  if (method.rfind("/sixpoint.", 0) != 0) return nullptr;
  return new CallLog(info, denials_);
}

}  // namespace sixpoint::runtime
