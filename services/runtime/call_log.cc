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

// So many lines a second of calls that were refused for who asked, or for how many did: nobody rolls the log away.
bool MayLogRefusal() {
  constexpr int kLinesASecond = 5;
  static std::mutex mutex;
  static Clock::time_point second;
  static int lines = 0;
  const std::lock_guard<std::mutex> lock(mutex);
  if (const Clock::time_point now = Clock::now(); now - second >= std::chrono::seconds(1)) {
    second = now;
    lines = 0;
  }
  return ++lines <= kLinesASecond;
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
      Open().by_context.erase(&context_);
    }
    CallEnds(counts_, code_, Clock::now() - begin_);
    if (is_refused_ && !MayLogRefusal()) return;  // who was denied is counted all the same
    if (!span_) Begin("");                        // it ended before its metadata came
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
    // Whom another authority names is nobody here: names that strangers think of are kept nowhere.
    bool is_known = true;
    for (const ErrorReason reason :
         {errors::v1::CERTIFICATE_FOREIGN, errors::v1::CERTIFICATE_MISSING, errors::v1::CODE_NOT_VALID})
      is_known = is_known && !HasReason(said, reason);
    if (is_known && ShownIdentity(context_)) caller_ = CallerText(said);
    if (facts_ != nullptr) facts_->SetCaller(caller_);
    const bool is_denied = absl::IsUnauthenticated(said) || absl::IsPermissionDenied(said);
    is_refused_ = is_denied || absl::IsResourceExhausted(said);
    if (!is_denied) return;
    // Its handler counts it, under the account that was meant (ServerOptions::count_refused_sign_in).
    if (HasReason(said, errors::v1::SIGN_IN_REFUSED)) return;
    denials_.Add(method_.substr(1), caller_, context_.peer(), ReasonOf(said), status.error_message());
  }

  // Of a session that does not count the gateway alone is believed: its token may say anything.
  std::string CallerText(const absl::Status& said) const {
    const bool is_believed =
        !HasReason(said, errors::v1::SESSION_NOT_VALID) && !HasReason(said, errors::v1::SERVICE_NOT_READY);
    return is_believed && SessionOf(context_) ? RequestedBy(context_) : ShownIdentity(context_)->Text();
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
