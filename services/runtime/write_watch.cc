#include "services/runtime/write_watch.h"

#include <cstddef>
#include <optional>

namespace sixpoint::runtime {
namespace {

using grpc::experimental::InterceptionHookPoints;

constexpr std::size_t kSlowestBytesPerMs = 500;  // as the gateway lets browsers read

class WriteWatch : public grpc::experimental::Interceptor {
 public:
  WriteWatch(grpc::experimental::ServerRpcInfo* info, CallWatchdog* watchdog, std::chrono::milliseconds patience)
      : context_(info->server_context()), watchdog_(watchdog), patience_(patience) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      const std::chrono::milliseconds of_its_bytes(methods->GetSerializedSendMessage()->Length() / kSlowestBytesPerMs);
      watch_.emplace(watchdog_, context_, std::chrono::steady_clock::time_point::max(), patience_ + of_its_bytes);
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_SEND_MESSAGE)) watch_.reset();
    methods->Proceed();
  }

 private:
  grpc::ServerContextBase* const context_;
  CallWatchdog* const watchdog_;
  const std::chrono::milliseconds patience_;
  std::optional<CallWatch> watch_;
};

}  // namespace

grpc::experimental::Interceptor* WriteWatchFactory::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) {
  return new WriteWatch(info, &watchdog_, patience_);
}

}  // namespace sixpoint::runtime
