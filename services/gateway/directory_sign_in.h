// Sign-in by the house's own, the plant's identity provider (OpenID Connect, the code flow with PKCE): under /session/. The gateway takes
// people there and back; who they are the plant's service judges by the ID token.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "services/gateway/code_exchange.h"
#include "services/gateway/directory_client.h"
#include "services/gateway/exchange.h"
#include "services/gateway/sign_in_ticket.h"
#include "services/gateway/upstream.h"
#include "services/gateway/url.h"
#include "services/gateway/used_tickets.h"

namespace sixpoint::gateway {

class DirectorySignIn {
 public:
  // client: none where people sign in by password alone. upstream lives longer.
  DirectorySignIn(Upstream* upstream, std::optional<DirectoryClient> client);

  // Whether the path is one of these.
  static bool Has(const Url& url);
  // GET /session/provider: {"name": ...} of who is signed in by, {} where nobody is so.
  // GET /session/start?return=PATH: sends the browser to the provider.
  // GET /session/callback: the provider sends it back; on to PATH, signed in, or with sign_in=WHY behind it.
  Awaitable<HttpResponse> Answer(Exchange* exchange, const Url& url, const std::string& traceparent);
  // Before what runs the exchanges ends: nothing is told to it after that.
  void Stop();

 private:
  HttpResponse Start(const Exchange& exchange, const Url& url) const;
  Awaitable<HttpResponse> ComeBack(Exchange* exchange, const Url& url, const CallWish& wish);
  Awaitable<CodeAnswer> IdTokenOf(Exchange* exchange, const SignInTicket& ticket, const std::string& code);

  Upstream& upstream_;
  const std::optional<DirectoryClient> client_;
  const SignInTickets tickets_;
  UsedTickets used_;
  const std::unique_ptr<CodeWorkers> workers_;  // where there is a client
};

}  // namespace sixpoint::gateway
