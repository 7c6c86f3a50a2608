#include "cli/plant_ports.h"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "cli/listen_address.h"
#include "cli/plant_settings.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

// 0, or errno's of a socket that would listen there.
int BindError(const addrinfo& address) {
  const int handle = socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (handle < 0) return errno;
  const int yes = 1;  // as servers do: connections that are closing do not count
  setsockopt(handle, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const int error = bind(handle, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  close(handle);
  return error;
}

absl::Status RequirePort(const PortsWish& wish, int port) {
  const std::string& host = wish.host;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
  if (failed != 0)
    return runtime::Refuse("--listen", host, std::string("a host of this machine: ") + gai_strerror(failed));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(found, &freeaddrinfo);
  int error = 0;
  for (const addrinfo* address = found; address != nullptr && error != EADDRINUSE; address = address->ai_next)
    error = BindError(*address);
  if (error == 0) return absl::OkStatus();
  if (error != EADDRINUSE)
    return runtime::Refuse("--listen", host, std::string("an address of this machine: ") + std::strerror(error));
  const std::string at = HostAndPort(ListenAddress{host, host}.Own(), port);
  // Which one it is cannot be told: another plant shows a certificate that this one has no way to judge.
  return runtime::Refuse(wish.option, at + " (another program or plant listens there)", wish.wanted);
}

}  // namespace

absl::Status RequirePorts(const PortsWish& wish, const std::set<int>& own) {
  for (int port = wish.first; port < wish.first + wish.count; ++port) {
    if (own.count(port) != 0) continue;
    if (absl::Status status = RequirePort(wish, port); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::cli
