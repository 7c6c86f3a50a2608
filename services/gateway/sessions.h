// Who is signed in, by the browser's cookie or a program's bearer token, and how people sign in and out: /session.
#pragma once

#include <string>

#include "services/gateway/exchange.h"
#include "services/gateway/upstream.h"

namespace sixpoint::gateway {

class Sessions {
 public:
  // Lives longer.
  explicit Sessions(Upstream* upstream) : upstream_(*upstream) {}

  // The token that came with the request; empty: none.
  static std::string TokenOf(const Exchange& exchange);
  // Whether what the request asks for may be done for its sender: nothing that another site's page sends is. A browser says so itself.
  static bool IsFromElsewhere(const Exchange::Head& head);

  // POST {"name", "password"}: signs in. GET: who is signed in ({}: nobody), and another quarter of an hour where little is left. DELETE: signs out.
  Awaitable<HttpResponse> Answer(Exchange* exchange, const std::string& traceparent);

 private:
  Awaitable<HttpResponse> SignIn(Exchange* exchange, const CallWish& wish);
  Awaitable<HttpResponse> Renew(Exchange* exchange, const CallWish& wish);
  Awaitable<HttpResponse> SignOut(Exchange* exchange, const CallWish& wish);

  Upstream& upstream_;
};

}  // namespace sixpoint::gateway
