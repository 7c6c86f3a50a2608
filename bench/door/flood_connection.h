// A flooding client's connection: TLS over TCP that never waits, to a server by HTTP/2, as somebody whom the plant knows.
#pragma once

#include <openssl/ssl.h>

#include <memory>
#include <string>

namespace sixpoint::bench {

class FloodConnection {
 public:
  // None: refused, or no handshake within some seconds. source: the address that makes the peer; empty: the usual one.
  static std::unique_ptr<FloodConnection> Connect(const std::string& address, const std::string& identity,
                                                  const std::string& source);
  ~FloodConnection();
  FloodConnection(const FloodConnection&) = delete;
  FloodConnection& operator=(const FloodConnection&) = delete;

  // Takes from the front what could be written. False: closed.
  bool Write(std::string* bytes);
  // How many came; 0: none now; -1: closed.
  int Read(char* to, int size);
  int fd() const { return fd_; }

 private:
  FloodConnection(int fd, SSL* ssl) : fd_(fd), ssl_(ssl) {}
  const int fd_;
  SSL* const ssl_;
};

}  // namespace sixpoint::bench
