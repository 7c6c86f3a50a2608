// The cookies that the gateway gives browsers: none that a script can read, and over TLS none that another host or path could have set.
#pragma once

#include <chrono>
#include <string>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

enum class SameSite {
  kStrict,  // sent with what this page itself asks for
  kLax,     // also where another site sends the browser here
};
struct Cookie {
  const char* name;  // over TLS behind "__Host-"
  SameSite same_site;
  std::chrono::seconds lasts{0};  // 0: as long as the browser
};

// The token of who is signed in.
inline constexpr Cookie kSessionCookie{"sixpoint-session", SameSite::kStrict};

// Its value; empty: there is none.
std::string ValueOf(const Cookie& cookie, const Exchange& exchange);
// Of the header Set-Cookie. value empty: it is to be forgotten.
std::string SetText(const Cookie& cookie, const Exchange& exchange, const std::string& value);

}  // namespace sixpoint::gateway
