#include "cli/service_health.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <gtest/gtest.h>

#include "services/runtime/credentials.h"
#include "services/runtime/listening_sockets.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "tests/support/plant_certificates.h"

namespace sixpoint::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{500};
constexpr std::chrono::seconds kLong{20};

// Nothing but health.
class HealthServer {
 public:
  explicit HealthServer(const std::shared_ptr<grpc::ServerCredentials>& credentials) {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    builder.AddListeningPort("127.0.0.1:0", credentials, &port_);
    server_ = builder.BuildAndStart();
    Say(true);
  }
  void Say(bool serving) { server_->GetHealthCheckService()->SetServingStatus("", serving); }
  void Stop() { server_->Shutdown(); }
  std::string At(const std::string& host) const { return host + ":" + std::to_string(port_); }

 private:
  ingest::v1::ScanService::Service service_;  // gRPC wants one
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

TEST(ServiceHealth, IsWhatTheServiceSays) {
  testing::PlantCertificates certificates;
  HealthServer server(runtime::ServerCredentialsOf(certificates.Service("ingest")).value());
  const auto nobody = runtime::ChannelCredentialsOf(certificates.Nobody()).value();
  EXPECT_EQ(ServiceHealth(server.At("127.0.0.1"), nobody, kLong), "SERVING");
  server.Say(false);
  EXPECT_EQ(ServiceHealth(server.At("127.0.0.1"), nobody, kLong), "NOT_SERVING");
  server.Stop();
  EXPECT_EQ(ServiceHealth(server.At("127.0.0.1"), nobody, kLong), "NOT_REACHED");
}

// The words of gRPC and OpenSSL are all that tells these apart; here they are asked for.
TEST(ServiceHealth, OfWhomTheAuthorityDoesNotKnowIsNotBelieved) {
  testing::PlantCertificates certificates, others;
  HealthServer server(runtime::ServerCredentialsOf(others.Service("ingest")).value());
  EXPECT_EQ(ServiceHealth(server.At("127.0.0.1"), runtime::ChannelCredentialsOf(certificates.Nobody()).value(), kLong),
            "NOT_TRUSTED");
  identity::CertificateWish wish;
  wish.identity = identity::IdentityOf("services/plant", {}).value();
  wish.hosts = {"10.1.2.3"};
  HealthServer elsewhere(runtime::ServerCredentialsOf(certificates.Issue(wish)).value());
  EXPECT_EQ(
      ServiceHealth(elsewhere.At("127.0.0.1"), runtime::ChannelCredentialsOf(certificates.Nobody()).value(), kLong),
      "NOT_TRUSTED");
}

TEST(ServiceHealth, WithoutTlsThereIsNoPlant) {
  testing::PlantCertificates certificates;
  HealthServer server(grpc::InsecureServerCredentials());
  EXPECT_EQ(ServiceHealth(server.At("127.0.0.1"), runtime::ChannelCredentialsOf(certificates.Nobody()).value(), kLong),
            "NOT_REACHED");
}

// As a service without descriptors does: the kernel takes the connection, and nobody speaks.
TEST(ServiceHealth, SilenceIsNotAbsence) {
  const auto sockets = runtime::ListenAt("127.0.0.1:0");
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  testing::PlantCertificates certificates;
  EXPECT_EQ(ServiceHealth("127.0.0.1:" + std::to_string(runtime::PortOf(sockets->front())),
                          runtime::ChannelCredentialsOf(certificates.Nobody()).value(), kPatience),
            "SILENT");
}

}  // namespace
}  // namespace sixpoint::cli
