#include "services/runtime/call_metrics.h"

#include <google/protobuf/descriptor.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "services/runtime/metrics.h"

namespace sixpoint::runtime {
namespace {

// By grpc::StatusCode, as gRPC's other servers name them to Prometheus.
constexpr std::array<const char*, 17> kCodes = {
    "OK",       "Canceled",       "Unknown",          "InvalidArgument",   "DeadlineExceeded",
    "NotFound", "AlreadyExists",  "PermissionDenied", "ResourceExhausted", "FailedPrecondition",
    "Aborted",  "OutOfRange",     "Unimplemented",    "Internal",          "Unavailable",
    "DataLoss", "Unauthenticated"};
constexpr int kUnknown = 2;

std::string TypeWordOf(const google::protobuf::MethodDescriptor& method) {
  if (method.client_streaming()) return method.server_streaming() ? "bidi_stream" : "client_stream";
  return method.server_streaming() ? "server_stream" : "unary";
}

}  // namespace

class CallCounts {
 public:
  explicit CallCounts(const MetricLabels& labels)
      : started_("grpc_server_started_total", "Calls that began.", labels),
        seconds_("grpc_server_handling_seconds", "Time from a call's first byte to its end.", UsualSeconds(), labels) {
    for (std::size_t i = 0; i < kCodes.size(); ++i) {
      MetricLabels with_code = labels;
      with_code["grpc_code"] = kCodes[i];
      handled_[i].emplace("grpc_server_handled_total", "Calls that ended, by how.", with_code);
    }
  }

  void Begin() { started_.Add(); }
  void End(int code, std::chrono::duration<double> duration) {
    const bool is_known = code >= 0 && code < static_cast<int>(kCodes.size());
    handled_[static_cast<std::size_t>(is_known ? code : kUnknown)]->Add();
    seconds_.Observe(duration.count());
  }

 private:
  Counter started_;
  Histogram seconds_;
  std::array<std::optional<Counter>, kCodes.size()> handled_;
};

namespace {

// Filled before calls come and only read since.
std::map<std::string, std::unique_ptr<CallCounts>, std::less<>>& Known() {
  static auto* const known = new std::map<std::string, std::unique_ptr<CallCounts>, std::less<>>();
  return *known;
}

}  // namespace

void CountCallsOf(std::string_view service) {
  const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(std::string(service));
  if (descriptor == nullptr) return;
  for (int i = 0; i < descriptor->method_count(); ++i) {
    const auto& method = *descriptor->method(i);
    Known()["/" + descriptor->full_name() + "/" + method.name()] = std::make_unique<CallCounts>(MetricLabels{
        {"grpc_type", TypeWordOf(method)}, {"grpc_service", descriptor->full_name()}, {"grpc_method", method.name()}});
  }
}

CallCounts* CallCountsOf(std::string_view method) {
  static auto* const others =
      new CallCounts({{"grpc_type", "unary"}, {"grpc_service", "other"}, {"grpc_method", "other"}});
  const auto found = Known().find(method);
  return found == Known().end() ? others : found->second.get();
}

void CallBegins(CallCounts* counts) { counts->Begin(); }
void CallEnds(CallCounts* counts, int code, std::chrono::duration<double> duration) { counts->End(code, duration); }

}  // namespace sixpoint::runtime
