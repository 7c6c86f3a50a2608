#include "cli/service_health.h"

#include <arpa/inet.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

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
  const int handle = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(handle, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(handle, 8), 0);
  ASSERT_EQ(getsockname(handle, reinterpret_cast<sockaddr*>(&address), &size), 0);
  EXPECT_EQ(ServiceHealth("127.0.0.1:" + std::to_string(ntohs(address.sin_port)), kPatience), "SILENT");
  close(handle);
}

}  // namespace
}  // namespace sixpoint::cli
