// What each request is answered: calls by the Connect protocol, sign-in, the page's files.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "identity/session.h"
#include "identity/trust.h"
#include "services/gateway/connect_protocol.h"
#include "services/gateway/exchange.h"
#include "services/gateway/files.h"
#include "services/gateway/sessions.h"
#include "services/gateway/upstream.h"

namespace sixpoint::gateway {

class Gateway {
 public:
  // upstream and trust live longer. files: none where no page is served.
  Gateway(Upstream* upstream, identity::Trust* trust, std::optional<Files> files)
      : upstream_(*upstream), sessions_(upstream), trust_(trust), files_(std::move(files)) {}

  // Always answers, whatever came. Thread-safe.
  Awaitable<void> Handle(Exchange* exchange);

 private:
  Awaitable<void> Route(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code);
  Awaitable<void> Connect(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code);
  Awaitable<void> Unary(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                        grpc::StatusCode* code);
  Awaitable<void> Stream(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                         grpc::StatusCode* code);

  Upstream& upstream_;
  Sessions sessions_;
  identity::SessionTrust trust_;
  const std::optional<Files> files_;
};

// With what every answer says to browsers: nothing is sniffed, framed, or fetched from elsewhere.
HttpResponse Guarded(HttpResponse response);

}  // namespace sixpoint::gateway
