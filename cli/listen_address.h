// Where a plant on this machine listens, and what its clients are told.
#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace sixpoint::cli {

struct ListenAddress {
  std::string listen = "127.0.0.1";    // host that the services bind; 0.0.0.0 or :: for every address of the machine
  std::string announce = "127.0.0.1";  // host that clients are told

  // Only programs on this machine can reach it.
  bool IsLoopback() const;
  // Host by which this machine itself reaches the services.
  std::string Own() const;
};

// An empty `announce` is `listen`. INVALID_ARGUMENT where clients could not use what they were told.
absl::StatusOr<ListenAddress> ListenAddressOf(const std::string& listen, const std::string& announce);

// An IP address or a name: one word of a configuration file, and what a certificate can hold.
bool IsHost(const std::string& host);
// 0.0.0.0 or ::, which is no host for a client.
bool IsEveryAddress(const std::string& host);

// "127.0.0.1:7400", "[::1]:7400".
std::string HostAndPort(const std::string& host, int port);

}  // namespace sixpoint::cli
