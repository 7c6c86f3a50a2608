// One call inside a server: its deadline and cancellation, passed down to the database, the kernels and other services.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "storage/reader.h"

namespace sixpoint::runtime {

// In the trailing metadata of each call that is let in: SoftwareVersion() of the server, and its clock when the call began, in
// microseconds since 1970.
inline constexpr char kServerVersion[] = "sixpoint-version", kServerTime_us[] = "sixpoint-time-us";

// The client's deadline, at most an hour from now, or now + 120 s where it gave none. Deadlines are of the clock that nobody sets: a
// computer that learns the time while a call runs neither ends it nor lets it run for ever.
std::chrono::steady_clock::time_point DeadlineOf(const grpc::ServerContextBase& context);
// The same, where calls may last longer; so long where the client gave none.
std::chrono::steady_clock::time_point DeadlineWithin(const grpc::ServerContext& context, std::chrono::hours longest);
// Of a call that we make; a day from now where it has none.
std::chrono::steady_clock::time_point DeadlineOf(const grpc::ClientContext& context);
// Ends a call that we make then, if it would not end before.
void EndBy(std::chrono::steady_clock::time_point deadline, grpc::ClientContext* context);
// For kernels: false once the client is gone or its time is over. Valid while the call lasts.
std::function<bool()> KeepGoing(const grpc::ServerContext& context);
// Why work ended early that KeepGoing told to stop: CANCELLED of a client that is gone, DEADLINE_EXCEEDED of one whose time is
// over, so that it hears the same from here as from its own clock. `kept`: what becomes of what was done.
absl::Status Stopped(const grpc::ServerContext& context, const std::string& kept);
// The trace that a call is of (trace.h).
std::string TraceIdOf(const grpc::ServerContextBase& context);
// A context for a call to another service: remaining time less a margin, part of this call's span, for the same caller.
std::unique_ptr<grpc::ClientContext> ContextFor(const grpc::ServerContext& context);
// What the work of a call needs of it: its deadline, its cancellation, a context for each call to another service, and who asks
// (caller_identity.h) and in which trace, as what it records says.
struct Caller {
  std::chrono::steady_clock::time_point deadline;
  std::function<std::unique_ptr<grpc::ClientContext>()> make_context;
  std::function<bool()> keep_going;
  std::string requested_by;
  std::string trace_id;
  storage::Reader reader = {};
  // As make_context, for nobody: what a machine's safety rests on does not depend on who may see it. What comes back is not told.
  std::function<std::unique_ptr<grpc::ClientContext>()> make_own_context = nullptr;
};
// Valid while the call lasts.
Caller CallerOf(const grpc::ServerContext& context);
// The same for programs (cli, simulator): a deadline that many seconds from now, part of what the thread does (call_scope.h).
std::unique_ptr<grpc::ClientContext> ContextFor(double seconds);
// The same, without a deadline.
std::unique_ptr<grpc::ClientContext> ContextWithoutDeadline();
// A channel with keepalive, message limits and retry of UNAVAILABLE; each call on it is a span. credentials: credentials.h.
// connection: channels of one number share a connection, others have their own.
std::shared_ptr<grpc::Channel> ConnectTo(const std::string& address,
                                         const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                                         int connection = 0);
// The same of who only hands calls on: each is part of the span that came in, and no other.
std::shared_ptr<grpc::Channel> PassOnTo(const std::string& address,
                                        const std::shared_ptr<grpc::ChannelCredentials>& credentials, int connection);

}  // namespace sixpoint::runtime
