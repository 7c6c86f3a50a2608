#include "services/runtime/listening_sockets.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr std::string_view kUnix = "unix:", kUnixAbstract = "unix-abstract:";
constexpr char kWanted[] = "HOST:PORT, [IPV6]:PORT, unix:PATH or unix-abstract:NAME";
// As gRPC sets it beside its keepalive: what was sent and is not acknowledged for so long ends the connection.
constexpr int kUnacknowledged_ms = 10'000;

bool Consume(std::string_view* text, std::string_view prefix) {
  if (text->substr(0, prefix.size()) != prefix) return false;
  text->remove_prefix(prefix.size());
  return true;
}

struct HostAndPort {
  std::string host, port;
};

std::optional<HostAndPort> Split(std::string_view address) {
  for (const char* scheme : {"dns:", "ipv4:", "ipv6:"})
    if (Consume(&address, scheme)) break;
  while (Consume(&address, "/")) continue;
  const std::size_t colon = address.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  std::string_view host = address.substr(0, colon);
  const std::string_view port = address.substr(colon + 1);
  // IPv6 in brackets, and nothing else with a colon.
  const bool bracketed = Consume(&host, "[");
  if (bracketed && (host.empty() || host.back() != ']')) return std::nullopt;
  if (bracketed) host.remove_suffix(1);
  if (!bracketed && host.find_first_of(":]") != std::string_view::npos) return std::nullopt;
  if (host.empty() || port.empty() || port.find_first_not_of("0123456789") != std::string_view::npos ||
      port.size() > 5 || std::stoi(std::string(port)) > 65'535)
    return std::nullopt;
  return HostAndPort{std::string(host), std::string(port)};
}

absl::Status Error(const std::string& address, const std::string& why, const std::string& wanted) {
  return Refuse("--listen", address + " (" + why + ")", wanted);
}

absl::Status CannotListen(const std::string& address, int error) {
  return Error(address, std::strerror(error), "an address of this machine that is free");
}

// errno where there is none.
struct Opened {
  Descriptor socket;
  int error = 0;
};

Opened Listen(int family, const sockaddr* address, socklen_t length) {
  Descriptor made(::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!made.is_open()) return {Descriptor(), errno};
  const int yes = 1, no = 0;
  if (family != AF_UNIX) {
    // What accepted sockets inherit. A port whose old connections still linger may be taken, one that is listened on may not.
    setsockopt(made.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    setsockopt(made.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    setsockopt(made.get(), IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledged_ms, sizeof kUnacknowledged_ms);
  }
  if (family == AF_INET6) setsockopt(made.get(), IPPROTO_IPV6, IPV6_V6ONLY, &no, sizeof no);
  if (bind(made.get(), address, length) != 0 || listen(made.get(), SOMAXCONN) != 0) return {Descriptor(), errno};
  return {std::move(made), 0};
}

absl::StatusOr<std::vector<Descriptor>> ListenAtUnix(const std::string& address, std::string name) {
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  // An abstract name begins with a NUL byte and has none at its end; a path has one at its end.
  const bool abstract = name[0] == '\0';
  if (name.size() + (abstract ? 0 : 1) > sizeof place.sun_path)
    return Refuse("--listen", "a unix socket's name of " + std::to_string(name.size()) + " bytes",
                  "at most " + std::to_string(sizeof place.sun_path - 1));
  std::memcpy(place.sun_path, name.data(), name.size());
  if (!abstract) RemoveUnixSocket(address);
  Opened opened = Listen(AF_UNIX, reinterpret_cast<const sockaddr*>(&place),
                         static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size() + (abstract ? 0 : 1)));
  if (!opened.socket.is_open()) return CannotListen(address, opened.error);
  std::vector<Descriptor> sockets;
  sockets.push_back(std::move(opened.socket));
  return sockets;
}

bool IsEveryAddress(const std::string& host) { return host == "0.0.0.0" || host == "::"; }
// What a machine without IPv6 says, or one whose host name has an address of another machine beside its own.
bool IsNotHere(int error) { return error == EAFNOSUPPORT || error == EADDRNOTAVAIL; }

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

absl::StatusOr<Addresses> Resolve(const std::string& address, const HostAndPort& at) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  // 0.0.0.0 is [::] too, whose sockets take both.
  const std::string host = at.host == "0.0.0.0" ? "::" : at.host;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), at.port.c_str(), &hints, &found);
  if (error != 0) return Error(address, gai_strerror(error), "a host that can be found");
  return Addresses(found, &freeaddrinfo);
}

void SetPort(int port, addrinfo* address) {
  if (address->ai_family == AF_INET6)
    reinterpret_cast<sockaddr_in6*>(address->ai_addr)->sin6_port = htons(static_cast<uint16_t>(port));
  else
    reinterpret_cast<sockaddr_in*>(address->ai_addr)->sin_port = htons(static_cast<uint16_t>(port));
}

}  // namespace

void Descriptor::Reset(int fd) {
  if (fd_ >= 0) close(fd_);
  fd_ = fd;
}

absl::StatusOr<std::vector<Descriptor>> ListenAt(const std::string& address) {
  std::string_view name = address;
  if (Consume(&name, kUnixAbstract) && !name.empty())
    return ListenAtUnix(address, std::string(1, '\0') + std::string(name));
  if (Consume(&name, kUnix) && !name.empty()) return ListenAtUnix(address, std::string(name));
  const std::optional<HostAndPort> at = Split(address);
  if (!at.has_value()) return Refuse("--listen", address, kWanted);
  const absl::StatusOr<Addresses> addresses = Resolve(address, *at);
  if (!addresses.ok()) return addresses.status();
  std::vector<Descriptor> sockets;
  int not_here = 0;
  for (addrinfo* each = addresses->get(); each != nullptr; each = each->ai_next) {
    // Any port, but the same at each address.
    if (!sockets.empty()) SetPort(PortOf(sockets.front()), each);
    Opened opened = Listen(each->ai_family, each->ai_addr, each->ai_addrlen);
    if (opened.socket.is_open())
      sockets.push_back(std::move(opened.socket));
    else if (IsNotHere(opened.error))
      not_here = opened.error;
    else
      return CannotListen(address, opened.error);
  }
  if (sockets.empty() && IsEveryAddress(at->host)) {  // a machine without IPv6
    sockaddr_in every{};
    every.sin_family = AF_INET;
    every.sin_port = htons(static_cast<uint16_t>(std::stoi(at->port)));
    Opened opened = Listen(AF_INET, reinterpret_cast<const sockaddr*>(&every), sizeof every);
    if (!opened.socket.is_open()) return CannotListen(address, opened.error);
    sockets.push_back(std::move(opened.socket));
  }
  if (sockets.empty()) return CannotListen(address, not_here);
  return sockets;
}

int PortOf(const Descriptor& socket) {
  sockaddr_storage bound{};
  socklen_t length = sizeof bound;
  if (getsockname(socket.get(), reinterpret_cast<sockaddr*>(&bound), &length) != 0) return 0;
  if (bound.ss_family == AF_INET) return ntohs(reinterpret_cast<const sockaddr_in*>(&bound)->sin_port);
  if (bound.ss_family == AF_INET6) return ntohs(reinterpret_cast<const sockaddr_in6*>(&bound)->sin6_port);
  return 0;
}

void RemoveUnixSocket(const std::string& address) {
  std::string_view path = address;
  if (!Consume(&path, kUnix)) return;
  struct stat found {};
  // Never another file that has the name.
  if (stat(std::string(path).c_str(), &found) == 0 && S_ISSOCK(found.st_mode)) unlink(std::string(path).c_str());
}

}  // namespace sixpoint::runtime
