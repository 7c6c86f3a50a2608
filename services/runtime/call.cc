#include "services/runtime/call.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "services/runtime/call_scope.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/client_spans.h"
#include "services/runtime/trace.h"

namespace sixpoint::runtime {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kDefaultDeadline{120};
constexpr std::chrono::hours kLongestDeadline{1};
// What is left for our own answer after a callee's.
constexpr std::chrono::milliseconds kMargin{200};
constexpr int kLargestAnswer_bytes = 64 << 20;

// UNAVAILABLE only: every other code may have done its work (gRFC A6). Never an upload: when its server dies in the middle,
// gRPC 1.51 fails the client's next Write and yet sends what it had buffered again, as a call of its own: a stream cut
// short, or one that nobody ends. Who uploads starts the stream again himself.
constexpr char kServiceConfig[] = R"({
  "methodConfig": [{"name": [{"service": "sixpoint.ingest.v1.ScanService", "method": "UploadScan"},
                             {"service": "sixpoint.plant.v1.CredentialsService", "method": "TakeCredentials"}]},
                   {"name": [{}], "retryPolicy": {"maxAttempts": 4, "initialBackoff": "0.1s", "maxBackoff": "1s",
                    "backoffMultiplier": 2, "retryableStatusCodes": ["UNAVAILABLE"]}}],
  "retryThrottling": {"maxTokens": 10, "tokenRatio": 0.1}
})";

// What is left until then; centuries where there is none.
std::chrono::milliseconds LeftUntil(gpr_timespec deadline) {
  return std::chrono::milliseconds(gpr_time_to_millis(gpr_time_sub(deadline, gpr_now(deadline.clock_type))));
}

gpr_timespec In(Clock::duration patience) {
  const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(patience);
  return gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_nanos(left.count(), GPR_TIMESPAN));
}

grpc::ChannelArguments ArgumentsOf(int connection) {
  grpc::ChannelArguments arguments;
  if (connection > 0)
    arguments.SetInt("sixpoint.connection", connection);  // gRPC shares those whose arguments are alike
  arguments.SetServiceConfigJSON(kServiceConfig);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  // A peer that restarts is found again within about a second, not after the default minutes.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1'000);
  // A proxy in the environment is for the world outside, not for the plant's own services.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(kLargestAnswer_bytes);
  return arguments;
}

}  // namespace

Clock::time_point DeadlineOf(const grpc::ServerContextBase& context) {
  const std::chrono::milliseconds left = LeftUntil(context.raw_deadline());
  if (left > std::chrono::hours(24)) return Clock::now() + kDefaultDeadline;
  return Clock::now() + std::min<Clock::duration>(left, kLongestDeadline);
}

Clock::time_point DeadlineWithin(const grpc::ServerContext& context, std::chrono::hours longest) {
  return Clock::now() + std::min<Clock::duration>(LeftUntil(context.raw_deadline()), longest);
}

Clock::time_point DeadlineOf(const grpc::ClientContext& context) {
  return Clock::now() + std::min<Clock::duration>(LeftUntil(context.raw_deadline()), std::chrono::hours(24));
}

void EndBy(Clock::time_point deadline, grpc::ClientContext* context) {
  context->set_deadline(In(std::max<Clock::duration>(std::min(DeadlineOf(*context), deadline) - Clock::now(), {})));
}

std::function<bool()> KeepGoing(const grpc::ServerContext& context) {
  return [&context, deadline = DeadlineOf(context)] { return Clock::now() < deadline && !context.IsCancelled(); };
}

absl::Status Stopped(const grpc::ServerContext& context, const std::string& kept) {
  if (context.IsCancelled() && LeftUntil(context.raw_deadline()).count() > 0)
    return absl::CancelledError("the client went away; " + kept);
  return absl::DeadlineExceededError("the call's time is over; " + kept);
}

std::string TraceIdOf(const grpc::ServerContextBase& context) {
  const auto given = context.client_metadata().find(kTraceparent);
  if (given == context.client_metadata().end()) return "";
  return TraceIdOf(std::string_view(given->second.data(), given->second.size()));
}

namespace {

std::unique_ptr<grpc::ClientContext> ContextOf(const grpc::ServerContext& context) {
  std::unique_ptr<grpc::ClientContext> made = grpc::ClientContext::FromServerContext(context);
  const Clock::duration left = std::max<Clock::duration>(DeadlineOf(context) - Clock::now(), {});
  made->set_deadline(In(left - std::min<Clock::duration>(kMargin, left / 10)));
  const auto traceparent = context.client_metadata().find(kTraceparent);
  made->AddMetadata(kTraceparent, traceparent == context.client_metadata().end()
                                      ? NewTraceparent()
                                      : std::string(traceparent->second.data(), traceparent->second.size()));
  return made;
}

}  // namespace

std::unique_ptr<grpc::ClientContext> ContextFor(const grpc::ServerContext& context) {
  std::unique_ptr<grpc::ClientContext> made = ContextOf(context);
  if (const std::string asker = RequestedFor(context); !asker.empty()) made->AddMetadata(kRequestedFor, asker);
  return made;
}

Caller CallerOf(const grpc::ServerContext& context) {
  return {DeadlineOf(context),
          [&context] { return ContextFor(context); },
          KeepGoing(context),
          RequestedBy(context),
          TraceIdOf(context),
          ReaderOf(context),
          [&context] { return ContextOf(context); }};
}

std::unique_ptr<grpc::ClientContext> ContextFor(double seconds) {
  std::unique_ptr<grpc::ClientContext> made = ContextWithoutDeadline();
  made->set_deadline(In(std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3))));
  return made;
}

std::unique_ptr<grpc::ClientContext> ContextWithoutDeadline() {
  auto made = std::make_unique<grpc::ClientContext>();
  made->AddMetadata(kTraceparent, CurrentTraceparent());
  return made;
}

std::shared_ptr<grpc::Channel> ConnectTo(const std::string& address,
                                         const std::shared_ptr<grpc::ChannelCredentials>& credentials, int connection) {
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<ClientSpans>());
  return grpc::experimental::CreateCustomChannelWithInterceptors(address, credentials, ArgumentsOf(connection),
                                                                 std::move(interceptors));
}

std::shared_ptr<grpc::Channel> PassOnTo(const std::string& address,
                                        const std::shared_ptr<grpc::ChannelCredentials>& credentials, int connection) {
  return grpc::CreateCustomChannel(address, credentials, ArgumentsOf(connection));
}

}  // namespace sixpoint::runtime
