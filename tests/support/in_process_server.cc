#include "tests/support/in_process_server.h"

#include <grpcpp/support/client_interceptor.h>
#include <grpcpp/support/server_interceptor.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>

#include "services/runtime/call.h"
#include "services/runtime/write_watch.h"

namespace sixpoint::testing {
namespace {

// A call orders what its client did before it, its handler, and what its client does after it: by a socket, and inside gRPC, of which
// a thread sanitizer sees nothing. Here it is told.
class Ordering : public grpc::experimental::Interceptor {
 public:
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    static std::atomic<int> order{0};
    order.fetch_add(1, std::memory_order_acq_rel);
    methods->Proceed();
  }
};

class OrderingOfClients : public grpc::experimental::ClientInterceptorFactoryInterface {
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo*) override {
    return new Ordering;
  }
};

class OrderingOfServers : public grpc::experimental::ServerInterceptorFactoryInterface {
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo*) override {
    return new Ordering;
  }
};

}  // namespace

InProcessServer::InProcessServer(const std::vector<grpc::Service*>& services, int port,
                                 std::chrono::milliseconds write_patience,
                                 const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  static std::once_flag of_clients;
  std::call_once(of_clients, [] { grpc::experimental::RegisterGlobalClientInterceptorFactory(new OrderingOfClients); });
  grpc::ServerBuilder builder;
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> of_servers;
  of_servers.push_back(std::make_unique<OrderingOfServers>());
  of_servers.push_back(std::make_unique<runtime::WriteWatchFactory>(write_patience));
  builder.experimental().SetInterceptorCreators(std::move(of_servers));
  builder.AddListeningPort("127.0.0.1:" + std::to_string(port), credentials, &port_);
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
