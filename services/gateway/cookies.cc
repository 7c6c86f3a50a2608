#include "services/gateway/cookies.h"

#include <algorithm>

namespace sixpoint::gateway {
namespace {

// Browsers keep one of that prefix only where it came encrypted, for this host and all of its paths.
std::string NameOf(const Cookie& cookie, const Exchange& exchange) {
  return (exchange.is_encrypted() ? "__Host-" : "") + std::string(cookie.name);
}

}  // namespace

std::string ValueOf(const Cookie& cookie, const Exchange& exchange) {
  const std::string text = HeaderOf(exchange.head(), "Cookie"), name = NameOf(cookie, exchange) + "=";
  for (std::size_t begin = 0; begin < text.size();) {
    while (begin < text.size() && text[begin] == ' ') ++begin;
    const std::size_t end = std::min(text.find(';', begin), text.size());
    if (text.compare(begin, name.size(), name) == 0) return text.substr(begin + name.size(), end - begin - name.size());
    begin = end + 1;
  }
  return "";
}

std::string SetText(const Cookie& cookie, const Exchange& exchange, const std::string& value) {
  std::string text = NameOf(cookie, exchange) + "=" + value +
                     "; Path=/; HttpOnly; SameSite=" + (cookie.same_site == SameSite::kStrict ? "Strict" : "Lax");
  if (exchange.is_encrypted()) text += "; Secure";
  if (value.empty())
    text += "; Max-Age=0";
  else if (cookie.lasts.count() > 0)
    text += "; Max-Age=" + std::to_string(cookie.lasts.count());
  return text;
}

}  // namespace sixpoint::gateway
