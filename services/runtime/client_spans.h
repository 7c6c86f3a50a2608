// Each call that is made on a channel is a span of its own: it is sent with the call in place of the one that it is part of, and a
// service writes it into its log. Private to runtime.
#pragma once

#include <grpcpp/support/client_interceptor.h>

namespace sixpoint::runtime {

class ClientSpans : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo* info) override;
};

}  // namespace sixpoint::runtime
