// A TCP connection with TLS that never waits, to a server by HTTP/2, as somebody whom the plant knows.
#pragma once

#include <openssl/ssl.h>

#include <memory>
#include <string>

namespace sixpoint::bench {

class TlsSocket {
 public:
  // None: refused, or no handshake within some seconds. source: the address that makes the peer; empty: the usual one.
  static std::unique_ptr<TlsSocket> Connect(const std::string& address, const std::string& identity,
                                            const std::string& source);
  ~TlsSocket();
  TlsSocket(const TlsSocket&) = delete;
  TlsSocket& operator=(const TlsSocket&) = delete;

  // Takes from the front what could be written. False: closed.
  bool Write(std::string* bytes);
  // How many came; 0: none now; -1: closed.
  int Read(char* to, int size);
  int fd() const { return fd_; }

 private:
  TlsSocket(int fd, SSL* ssl) : fd_(fd), ssl_(ssl) {}
  const int fd_;
  SSL* const ssl_;
};

}  // namespace sixpoint::bench
