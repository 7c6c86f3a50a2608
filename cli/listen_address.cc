#include "cli/listen_address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>

#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

constexpr char kWantedHost[] = "an IP address or a host name";
constexpr std::size_t kLongestHostName = 253, kLongestLabel = 63;

bool IsIpv6(const std::string& host) {
  in6_addr address;
  return inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

// What lies between the dots of a name.
bool IsLabel(const std::string& label) {
  return !label.empty() && label.size() <= kLongestLabel && label.front() != '-' && label.back() != '-' &&
         std::all_of(label.begin(), label.end(), [](unsigned char c) { return std::isalnum(c) || c == '-'; });
}

// A certificate names an address as the system writes it, and is compared letter by letter: "fe80::1" of "FE80:0::1".
std::string AsTheSystemWrites(const std::string& host) {
  in6_addr address;
  char text[INET6_ADDRSTRLEN];
  if (inet_pton(AF_INET6, host.c_str(), &address) != 1) return host;
  return inet_ntop(AF_INET6, &address, text, sizeof text) == nullptr ? host : text;
}

}  // namespace

bool IsEveryAddress(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

bool IsHost(const std::string& host) {
  in_addr address;
  if (IsIpv6(host) || inet_pton(AF_INET, host.c_str(), &address) == 1) return true;
  if (host.size() > kLongestHostName) return false;
  std::string label;
  for (std::size_t from = 0; from <= host.size(); from += label.size() + 1) {
    label = host.substr(from, host.find('.', from) - from);
    if (!IsLabel(label)) return false;
  }
  // 10.0.0.256 is an address with a mistake.
  return !std::all_of(label.begin(), label.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool ListenAddress::IsLoopback() const {
  in_addr address;
  const bool in_127 = inet_pton(AF_INET, listen.c_str(), &address) == 1 && (ntohl(address.s_addr) >> 24) == 127;
  return in_127 || listen == "::1" || listen == "localhost";
}

std::string ListenAddress::Own() const { return listen == "0.0.0.0" ? "127.0.0.1" : listen == "::" ? "::1" : listen; }

absl::StatusOr<ListenAddress> ListenAddressOf(const std::string& listen, const std::string& announce) {
  if (!IsHost(listen)) return runtime::Refuse("--listen", listen, kWantedHost);
  const std::string listens = AsTheSystemWrites(listen), announced = AsTheSystemWrites(announce);
  if (!announced.empty() && (!IsHost(announced) || IsEveryAddress(announced)))
    return runtime::Refuse("--announce", announce, kWantedHost);
  if (announced.empty() && IsEveryAddress(listens))
    return runtime::Refuse("--listen", listen, "--announce too: the host by which clients reach this machine");
  return ListenAddress{listens, announced.empty() ? listens : announced};
}

std::string HostAndPort(const std::string& host, int port) {
  return (IsIpv6(host) ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

}  // namespace sixpoint::cli
