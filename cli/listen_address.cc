#include "cli/listen_address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>

#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

constexpr char kWantedHost[] = "an IP address or a host name";

bool IsIpv6(const std::string& host) {
  in6_addr address;
  return inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

bool IsEveryAddress(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

// It becomes a word of a configuration file.
bool IsHost(const std::string& host) {
  const auto in_a_name = [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '-'; };
  return IsIpv6(host) || (!host.empty() && host[0] != '-' && std::all_of(host.begin(), host.end(), in_a_name));
}

}  // namespace

bool ListenAddress::IsLoopback() const {
  in_addr address;
  const bool in_127 = inet_pton(AF_INET, listen.c_str(), &address) == 1 && (ntohl(address.s_addr) >> 24) == 127;
  return in_127 || listen == "::1" || listen == "localhost";
}

std::string ListenAddress::Own() const { return listen == "0.0.0.0" ? "127.0.0.1" : listen == "::" ? "::1" : listen; }

absl::StatusOr<ListenAddress> ListenAddressOf(const std::string& listen, const std::string& announce, bool insecure) {
  if (!IsHost(listen)) return runtime::Refuse("--listen", listen, kWantedHost);
  if (!announce.empty() && (!IsHost(announce) || IsEveryAddress(announce)))
    return runtime::Refuse("--announce", announce, kWantedHost);
  if (announce.empty() && IsEveryAddress(listen))
    return runtime::Refuse("--listen", listen, "--announce too: the host by which clients reach this machine");
  const ListenAddress address{listen, announce.empty() ? listen : announce};
  if (!address.IsLoopback() && !insecure)
    return runtime::Refuse(
        "--listen", listen,
        "a loopback address: nothing identifies callers yet, so that whoever reaches the plant may read "
        "and change everything in it. --insecure listens all the same");
  return address;
}

std::string HostAndPort(const std::string& host, int port) {
  return (IsIpv6(host) ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

}  // namespace sixpoint::cli
