#include "services/runtime/admission.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpc/byte_buffer.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/support/method_handler.h>

#include <chrono>
#include <list>
#include <memory>
#include <optional>
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

RpcMethod::RpcType TypeOf(const google::protobuf::MethodDescriptor& method) {
  if (method.client_streaming())
    return method.server_streaming() ? RpcMethod::BIDI_STREAMING : RpcMethod::CLIENT_STREAMING;
  return method.server_streaming() ? RpcMethod::SERVER_STREAMING : RpcMethod::NORMAL_RPC;
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

  // As it came, until the call is admitted.
  void* Deserialize(grpc_call*, grpc_byte_buffer* request, grpc::Status*, void**) override { return request; }

  void RunHandler(const HandlerParameter& call) override {
    const std::shared_ptr<CallFacts> facts = FactsOf(*call.server_context);
    const CallScope scope(facts);
    auto* const request = static_cast<grpc_byte_buffer*>(call.request);
    const absl::StatusOr<identity::Identity> caller = Check(call, request);
    if (!caller.ok()) {
      if (request != nullptr) grpc_byte_buffer_destroy(request);
      return End(call, ToGrpc(caller.status()));
    }
    if (facts != nullptr) facts->SetCaller(caller->name.empty() ? "" : caller->Text());
    TellServer(call.server_context);
    // Who needs no certificate loses none.
    std::optional<Opened> opened;
    if (!caller->name.empty()) opened.emplace(&admission_, *call.server_context);
    if (streams_requests_) return handler_->RunHandler(call);
    grpc::Status parsed;
    void* data = nullptr;
    void* const message = handler_->Deserialize(call.call->call(), request, &parsed, &data);
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
      std::string certificate_pem = ShownCertificate(context);
      const std::lock_guard<std::mutex> lock(admission_.mutex_);
      place_ =
          admission_.open_calls_.insert(admission_.open_calls_.end(), {&context, std::move(certificate_pem), false});
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
    return admission_.access_.CheckMachine(method_, caller, request, DeadlineOf(context));
  }

  absl::StatusOr<identity::Identity> Check(const HandlerParameter& call, grpc_byte_buffer* request) const {
    if (call.server_context->IsCancelled()) return absl::CancelledError("the client went away before its turn came");
    absl::StatusOr<identity::Identity> caller = admission_.access_.Admit(method_, *call.server_context);
    if (!caller.ok()) return caller;
    if (absl::Status ready = admission_.CheckReady(); !ready.ok()) return ready;
    const std::size_t size_bytes = request == nullptr ? 0 : grpc_byte_buffer_length(request);
    if (size_bytes <= greatest_bytes_) return caller;
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
      AddMethod(new grpc::internal::RpcServiceMethod(names_.back().c_str(), TypeOf(method),
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
    const absl::Status counts = access_.StillCounts(call.certificate_pem);
    if (counts.ok() || !absl::IsUnauthenticated(counts)) continue;
    Log(LogLevel::kWarning, "call ended: " + std::string(counts.message()));
    call.context->TryCancel();
    call.is_ended = true;
  }
}

}  // namespace sixpoint::runtime
