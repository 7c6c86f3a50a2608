#include "tests/support/in_process_server.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "services/runtime/call.h"

namespace sixpoint::testing {

InProcessServer::InProcessServer(const std::vector<grpc::Service*>& services, int port) {
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:" + std::to_string(port), grpc::InsecureServerCredentials(), &port_);
  builder.SetMaxReceiveMessageSize(8 << 20);  // as ServerOptions' default
  for (grpc::Service* service : services) builder.RegisterService(service);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr || port_ == 0) {
    std::fprintf(stderr, "in-process server: cannot listen on 127.0.0.1\n");
    std::exit(1);
  }
}

InProcessServer::~InProcessServer() {
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(2));
  server_->Wait();
}

std::shared_ptr<grpc::Channel> InProcessServer::Connect() const {
  return runtime::ConnectTo(address(), grpc::InsecureChannelCredentials());
}

}  // namespace sixpoint::testing
