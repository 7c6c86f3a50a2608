#include "cli/service_health.h"

#include <grpcpp/grpcpp.h>

#include "cli/tls_failure.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace sixpoint::cli {

std::string ServiceHealth(const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                          std::chrono::milliseconds patience) {
  grpc::ChannelArguments arguments;
  // A proxy in the environment is for the world outside, not for the plant's own services.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto stub = grpc::health::v1::Health::NewStub(grpc::CreateCustomChannel(address, credentials, arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + patience);
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, {}, &response);
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) return "SILENT";
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    const TlsFailure failure = TlsFailureOf(status.error_message());
    return failure == TlsFailure::kNotTrusted || failure == TlsFailure::kOtherHost ? "NOT_TRUSTED" : "NOT_REACHED";
  }
  if (!status.ok()) return "NOT_SERVING";
  return grpc::health::v1::HealthCheckResponse::ServingStatus_Name(response.status());
}

}  // namespace sixpoint::cli
