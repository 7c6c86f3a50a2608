#include "services/runtime/admission.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpc/byte_buffer.h>
#include <grpc/grpc.h>
#include <grpc/support/time.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/support/method_handler.h>

#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/runtime/call.h"
#include "services/runtime/call_log.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/message_limits.h"
#include "services/runtime/request_checks.h"
#include "services/runtime/server.h"

namespace sixpoint::runtime {

using grpc::internal::MethodHandler;
using grpc::internal::RpcMethod;

namespace {

// gRPC reads the one request of a method before anything of ours runs, but of a method that streams requests, which looks the same
// on the wire. So to gRPC all of ours do.
RpcMethod::RpcType StreamTypeOf(const google::protobuf::MethodDescriptor& method) {
  return method.server_streaming() ? RpcMethod::BIDI_STREAMING : RpcMethod::CLIENT_STREAMING;
}

// How long a request may take to come: a method's greatest at this rate.
constexpr std::chrono::seconds kBodyPatience{10}, kPatienceWithNobody{2};
constexpr std::size_t kSlowest_bytes_per_s = 500'000;

// Whose the bytes are.
struct Destroy {
  void operator()(grpc_byte_buffer* bytes) const { grpc_byte_buffer_destroy(bytes); }
};
using Bytes = std::unique_ptr<grpc_byte_buffer, Destroy>;

// The one message of a call; none where it is given up, or is too large for any method of this server. A call whose message does not
// come is ended.
Bytes Read(const MethodHandler::HandlerParameter& call, std::chrono::milliseconds patience) {
  grpc_byte_buffer* bytes = nullptr;
  grpc_op read{};
  read.op = GRPC_OP_RECV_MESSAGE;
  read.data.recv_message.recv_message = &bytes;
  if (grpc_call_start_batch(call.call->call(), &read, 1, &bytes, nullptr) != GRPC_CALL_OK) return nullptr;
  grpc_completion_queue* const queue = call.call->cq()->cq();
  const gpr_timespec end =
      gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_millis(patience.count(), GPR_TIMESPAN));
  if (grpc_completion_queue_pluck(queue, &bytes, end, nullptr).type == GRPC_QUEUE_TIMEOUT) {
    const std::string why = "request: not there after " + std::to_string(patience.count()) + " ms, want it sooner";
    grpc_call_cancel_with_status(call.call->call(), GRPC_STATUS_DEADLINE_EXCEEDED, why.c_str(), nullptr);
    grpc_completion_queue_pluck(queue, &bytes, gpr_inf_future(GPR_CLOCK_MONOTONIC), nullptr);
  }
  return Bytes(bytes);
}

// Whatever the call's kind, a handler with a failure to tell answers that alone: it has no function to call.
void End(const MethodHandler::HandlerParameter& call, const grpc::Status& why) {
  grpc::internal::RpcMethodHandler<grpc::Service, grpc::ByteBuffer, grpc::ByteBuffer>(nullptr, nullptr)
      .RunHandler({call.call, call.server_context, nullptr, why, nullptr, call.call_requester});
}

// Machine, blade and scan of a request, wherever its own fields name one.
void SayWhatItConcerns(const google::protobuf::Message& request, CallFacts* facts) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *request.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(request, &fields);
  for (const FieldDescriptor* const field : fields)
    if (field->type() == FieldDescriptor::TYPE_STRING)
      facts->Concerns(field->is_repeated() ? reflection.GetRepeatedString(request, field, 0)
                                           : reflection.GetString(request, field));
}

// To whom it lets in, a server says which program it is and what time it has: `sixpoint doctor` compares.
void TellServer(grpc::ServerContextBase* context) {
  const auto now_us =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch());
  context->AddTrailingMetadata(kServerVersion, SoftwareVersion());
  context->AddTrailingMetadata(kServerTime_us, std::to_string(now_us.count()));
}

}  // namespace

class AdmittedMethod : public MethodHandler {
 public:
  AdmittedMethod(Admission* admission, const google::protobuf::MethodDescriptor& method, MethodHandler* handler)
      : admission_(*admission),
        method_(method),
        greatest_bytes_(GreatestRequest_bytes(method)),
        streams_requests_(method.client_streaming()),
        handler_(handler) {}

  void RunHandler(const HandlerParameter& call) override {
    const std::shared_ptr<CallFacts> facts = FactsOf(*call.server_context);
    const CallScope scope(facts);
    const absl::StatusOr<identity::Identity> caller = Check(*call.server_context);
    if (!caller.ok()) {
      admission_.gate_.Refused(*call.server_context);
      return End(call, ToGrpc(caller.status()));
    }
    const std::string name = caller->name.empty() ? "" : caller->Text();
    // How many stream their requests at once is their handlers' to say.
    const auto place = streams_requests_ ? std::nullopt : admission_.gate_.Enter(name, *call.server_context);
    if (!streams_requests_ && !place.has_value()) return End(call, CallGate::Refusal());
    if (facts != nullptr) facts->SetCaller(name);
    TellServer(call.server_context);
    // Who needs no certificate loses none.
    std::optional<Opened> opened;
    if (!caller->name.empty()) opened.emplace(&admission_, *call.server_context);
    if (streams_requests_) return handler_->RunHandler(call);
    absl::StatusOr<Bytes> request = Receive(call, /*of_nobody=*/name.empty());
    if (!request.ok()) return End(call, ToGrpc(request.status()));
    grpc::Status parsed;
    void* data = nullptr;
    void* const message = handler_->Deserialize(call.call->call(), request->release(), &parsed, &data);
    if (parsed.ok()) {
      // Generated messages have one base, at their beginning. A handler that is told of a failure leaves the message to us.
      auto* const fields = static_cast<google::protobuf::Message*>(message);
      if (facts != nullptr) SayWhatItConcerns(*fields, facts.get());
      parsed = ToGrpc(CheckFields(*fields, *caller, *call.server_context));
      if (!parsed.ok()) fields->~Message();
    }
    handler_->RunHandler({call.call, call.server_context, message, parsed, data, call.call_requester});
  }

 private:
  // While one lives, its call may be ended for its certificate.
  class Opened {
   public:
    Opened(Admission* admission, const grpc::ServerContextBase& context) : admission_(*admission) {
      std::string certificate_pem = ShownCertificate(context), session_token = ShownSession(context);
      const std::lock_guard<std::mutex> lock(admission_.mutex_);
      place_ = admission_.open_calls_.insert(admission_.open_calls_.end(),
                                             {&context, std::move(certificate_pem), std::move(session_token), false});
    }
    ~Opened() {
      const std::lock_guard<std::mutex> lock(admission_.mutex_);
      admission_.open_calls_.erase(place_);
    }
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;

   private:
    Admission& admission_;
    std::list<Admission::OpenCall>::iterator place_;
  };

  absl::Status CheckFields(const google::protobuf::Message& request, const identity::Identity& caller,
                           const grpc::ServerContextBase& context) const {
    absl::Status status = Refusals().Add(CheckBounds(request)).Add(CheckRequestId(method_, request)).status();
    if (!status.ok()) return status;
    status = admission_.access_.CheckMachine(method_, caller, request, DeadlineOf(context));
    if (!status.ok()) return status;
    return admission_.clearance_.Check(method_, ReaderOf(context), request, DeadlineOf(context));
  }

  absl::StatusOr<identity::Identity> Check(const grpc::ServerContextBase& context) const {
    if (context.IsCancelled()) return absl::CancelledError("the client went away before its turn came");
    absl::StatusOr<identity::Identity> caller = admission_.access_.Admit(method_, context);
    if (!caller.ok()) return caller;
    if (absl::Status ready = admission_.CheckReady(); !ready.ok()) return ready;
    return caller;
  }

  absl::StatusOr<Bytes> Receive(const HandlerParameter& call, bool of_nobody) const {
    const std::chrono::milliseconds patience =
        of_nobody ? kPatienceWithNobody : kBodyPatience + std::chrono::seconds(greatest_bytes_ / kSlowest_bytes_per_s);
    Bytes request = Read(call, patience);
    if (request == nullptr)
      return Refuse("request", "none", "one message of at most " + std::to_string(greatest_bytes_) + " bytes");
    const std::size_t size_bytes = grpc_byte_buffer_length(request.get());
    if (size_bytes <= greatest_bytes_) return request;
    return Refuse("request", std::to_string(size_bytes) + " bytes", "at most " + std::to_string(greatest_bytes_));
  }

  Admission& admission_;
  const google::protobuf::MethodDescriptor& method_;
  const std::size_t greatest_bytes_;
  const bool streams_requests_;
  MethodHandler* const handler_;  // its service's
};

namespace {

// gRPC 1.51 lets nothing refuse a call before its handler: an interceptor only watches. So a service of ours has the methods,
// and each runs the handler of the service behind it.
class AdmittedService : public grpc::Service {
 public:
  AdmittedService(Admission* admission, const google::protobuf::ServiceDescriptor& descriptor, grpc::Service* behind) {
    // Generated code adds its methods in the order of the contract. GetHandler is a derived class's to call.
    const auto handler_of = &AdmittedService::GetHandler;
    for (int i = 0; i < descriptor.method_count(); ++i) {
      const auto& method = *descriptor.method(i);
      names_.push_back("/" + descriptor.full_name() + "/" + method.name());
      AddMethod(new grpc::internal::RpcServiceMethod(names_.back().c_str(), StreamTypeOf(method),
                                                     new AdmittedMethod(admission, method, (behind->*handler_of)(i))));
    }
  }

 private:
  std::list<std::string> names_;  // gRPC keeps where they lie
};

}  // namespace

void Admission::SetNotReady(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  not_ready_ = why;
}

void Admission::SetReady() {
  const std::lock_guard<std::mutex> lock(mutex_);
  not_ready_.reset();
}

absl::Status Admission::CheckReady() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!not_ready_.has_value()) return absl::OkStatus();
  return Failure(errors::v1::SERVICE_NOT_READY, "the service is not ready: " + *not_ready_);
}

std::unique_ptr<grpc::Service> Admission::Admit(const std::string& full_name, grpc::Service* service) {
  const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(full_name);
  return std::make_unique<AdmittedService>(this, *descriptor, service);
}

void Admission::EndUnbelieved() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (OpenCall& call : open_calls_) {
    if (call.is_ended) continue;
    const absl::Status counts = access_.StillCounts(call.certificate_pem, call.session_token);
    if (counts.ok() || !absl::IsUnauthenticated(counts)) continue;
    Log(LogLevel::kWarning, "call ended: " + std::string(counts.message()));
    call.context->TryCancel();
    call.is_ended = true;
  }
}

}  // namespace sixpoint::runtime
