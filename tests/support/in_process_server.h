// Serves given services on 127.0.0.1 inside the test's own process: handlers alone, without the door that real services have.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/service_type.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

namespace sixpoint::testing {

class InProcessServer {
 public:
  // The services must live longer. Port 0: any that is free. write_patience: as real services have it (write_watch.h). credentials:
  // others where a handler asks who calls; their clients connect to address() by their own.
  explicit InProcessServer(
      const std::vector<grpc::Service*>& services, int port = 0,
      std::chrono::milliseconds write_patience = std::chrono::seconds(60),
      const std::shared_ptr<grpc::ServerCredentials>& credentials = grpc::InsecureServerCredentials());
  ~InProcessServer();
  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  std::shared_ptr<grpc::Channel> Connect() const;  // without credentials

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace sixpoint::testing
