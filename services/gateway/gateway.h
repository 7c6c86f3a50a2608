// What each request is answered: calls by the Connect protocol, sign-in, the doors for plain HTTP, the page's files.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "identity/session.h"
#include "identity/trust.h"
#include "services/gateway/connect_protocol.h"
#include "services/gateway/directory_sign_in.h"
#include "services/gateway/exchange.h"
#include "services/gateway/files.h"
#include "services/gateway/scan_door.h"
#include "services/gateway/sessions.h"
#include "services/gateway/upstream.h"
#include "services/gateway/url.h"

namespace sixpoint::gateway {

class Gateway {
 public:
  // upstream and trust live longer. directory: where people sign in by the plant's identity provider too.
  Gateway(Upstream* upstream, identity::Trust* trust, Files files, std::optional<DirectoryClient> directory)
      : upstream_(*upstream),
        sessions_(upstream),
        directory_(upstream, std::move(directory)),
        scans_(upstream),
        trust_(trust),
        files_(std::move(files)) {}

  // Always answers, whatever came. Thread-safe.
  Awaitable<void> Handle(Exchange* exchange);
  // Once nobody is served any more, and before what Handle ran in goes.
  void Stop() {
    directory_.Stop();
    upstream_.Stop();
  }

 private:
  Awaitable<void> Route(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code);
  // /blobs, /programs and /scans.
  Awaitable<HttpResponse> Door(Exchange* exchange, const Url& url, const std::string& traceparent,
                               grpc::StatusCode* code);
  Awaitable<void> Connect(Exchange* exchange, const std::string& traceparent, grpc::StatusCode* code);
  Awaitable<void> Unary(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                        grpc::StatusCode* code);
  Awaitable<void> Stream(Exchange* exchange, const ConnectCall& call, std::string message, const CallWish& wish,
                         grpc::StatusCode* code);

  Upstream& upstream_;
  Sessions sessions_;
  DirectorySignIn directory_;
  ScanDoor scans_;
  identity::SessionTrust trust_;
  const Files files_;
};

// With what every answer says to browsers: nothing is sniffed, framed, or fetched from elsewhere.
HttpResponse Guarded(HttpResponse response);

}  // namespace sixpoint::gateway
