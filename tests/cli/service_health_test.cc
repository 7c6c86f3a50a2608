#include "cli/service_health.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>

#include "services/runtime/listening_sockets.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{500};

TEST(ServiceHealth, IsWhatTheServiceSays) {
  grpc::EnableDefaultHealthCheckService(true);
  int port = 0;
  grpc::ServerBuilder builder;
  ingest::v1::ScanService::Service service;  // gRPC wants one
  builder.RegisterService(&service);
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const std::string address = "127.0.0.1:" + std::to_string(port);
  const std::chrono::seconds patience{20};
  server->GetHealthCheckService()->SetServingStatus("", false);
  EXPECT_EQ(ServiceHealth(address, patience), "NOT_SERVING");
  server->GetHealthCheckService()->SetServingStatus("", true);
  EXPECT_EQ(ServiceHealth(address, patience), "SERVING");
  server->Shutdown();
  EXPECT_EQ(ServiceHealth(address, patience), "NOT_REACHED");
}

// As a service without descriptors does: the kernel takes the connection, and nobody speaks.
TEST(ServiceHealth, SilenceIsNotAbsence) {
  const auto sockets = runtime::ListenAt("127.0.0.1:0");
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  EXPECT_EQ(ServiceHealth("127.0.0.1:" + std::to_string(runtime::PortOf(sockets->front())), kPatience), "SILENT");
}

}  // namespace
}  // namespace sixpoint::cli
