// Serves given services on 127.0.0.1, any free port, inside the test's own process.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/service_type.h>

#include <memory>
#include <string>
#include <vector>

namespace sixpoint::testing {

class InProcessServer {
 public:
  // The services must live longer.
  explicit InProcessServer(const std::vector<grpc::Service*>& services);
  ~InProcessServer();
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  std::shared_ptr<grpc::Channel> Connect() const;

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace sixpoint::testing
