// What every command shares: the options, the connections, and the way a command ends.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/command_line.h"
#include "services/runtime/errors.h"
#include "services/runtime/retry.h"

namespace sixpoint::cli {

// Exit codes, as docs/cli.md says.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,
  kUsage = 2,
  kUnreachable = 3,
  kNotUsable = 4,  // answered and stored, but the result must not be used: not converged, or some steps failed
};

// Thread-safe after the arguments are parsed.
class Session {
 public:
  std::string server = "127.0.0.1:7400";
  bool json = false;
  double deadline_s = 300;
  std::string data;         // folder of this machine's own plant; empty: the usual one
  std::string identity;     // folder of the certificate that is shown to the plant; empty: as IdentityFolder finds it
  std::string config_file;  // whose values stood before the options were read; empty: none

  // In place of what `identity` holds: for tests, and for programs that have theirs already. Made at the first call where it is empty.
  std::shared_ptr<grpc::ChannelCredentials> credentials;

  // The channel to a service, found by ListEndpoints of the plant service and kept. UNAVAILABLE where the plant does not
  // answer, NOT_FOUND where it has no such service, FAILED_PRECONDITION where there is no certificate to show to it.
  absl::StatusOr<std::shared_ptr<grpc::Channel>> ChannelTo(const std::string& area);

  // One unary call on a fresh context for each attempt; a service that is away or full is tried again with growing
  // pauses until deadline_s is over, so that a restart of a service is not seen. Mutating requests carry a request_id,
  // which makes that safe.
  template <typename Service, typename Request, typename Response>
  absl::Status Call(const std::string& area,
                    grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    return Retrying(
        area, [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
          response->Clear();
          return runtime::FromGrpc((Service::NewStub(channel).get()->*method)(context.get(), request, response));
        });
  }
  absl::Status Retrying(const std::string& area,
                        const std::function<absl::Status(const std::shared_ptr<grpc::Channel>&,
                                                         std::unique_ptr<grpc::ClientContext>)>& attempt);
  // A call that lasts until it is ended, without a deadline: made again for ever, once the plant was reached. `progressed` is to be called
  // whenever something came.
  absl::Status Following(
      const std::string& area,
      const std::function<absl::Status(const std::shared_ptr<grpc::Channel>&, std::unique_ptr<grpc::ClientContext>,
                                       const std::function<void()>& progressed)>& attempt);
  // Those of Retrying, for a call that begins now.
  runtime::RetryLimits Limits() const;

  // Lets a subcommand run this when it was given.
  void OnCommand(Command* command, std::function<absl::Status()> action);
  // Runs the command and gives the exit code; a failure is printed with its code, message, reason and the next step.
  int Run();
  // The command is done but its result is not usable.
  void MarkNotUsable() { exit_code_ = kNotUsable; }
  // What it was asked for is not so, and it has said what is.
  void MarkFailed() { exit_code_ = kFailed; }

 private:
  absl::Status MakeCredentials();

  std::function<absl::Status()> action_;
  int exit_code_ = kDone;
  std::atomic<bool> reached_{false};  // the plant answered once
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;
  std::map<std::string, std::string> addresses_;
};

using runtime::NewRequestId;

// What to do about a failure, in one line.
std::string NextStep(const absl::Status& status, const std::string& server);
// {"error": {"code", "message", "reason", "next"}}
nlohmann::json FailureToJson(const absl::Status& status, const std::string& server);
std::string FailureToText(const absl::Status& status, const std::string& server);

}  // namespace sixpoint::cli
