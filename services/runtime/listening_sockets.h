// The sockets that a server listens on.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <utility>
#include <vector>

namespace sixpoint::runtime {

// One open descriptor, closed at its end.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.Release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Reset(other.Release());
    return *this;
  }
  ~Descriptor() { Reset(); }

  int get() const { return fd_; }
  bool is_open() const { return fd_ >= 0; }
  int Release() { return std::exchange(fd_, -1); }
  void Reset(int fd = -1);

 private:
  int fd_;
};

// HOST:PORT, [IPV6]:PORT, unix:PATH or unix-abstract:NAME, as gRPC writes them; a host name listens on all its addresses, 0.0.0.0
// and [::] on all of the machine, by IPv4 and IPv6. Port 0 takes any that is free. A port that another process listens on is
// refused; a unix socket that an earlier one left behind is replaced. Non-blocking.
absl::StatusOr<std::vector<Descriptor>> ListenAt(const std::string& address);
// Of a TCP socket; else 0.
int PortOf(const Descriptor& socket);
// A unix socket's file is gone with it.
void RemoveUnixSocket(const std::string& address);

}  // namespace sixpoint::runtime
