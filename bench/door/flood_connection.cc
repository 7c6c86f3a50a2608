#include "bench/door/flood_connection.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <map>

namespace sixpoint::bench {
namespace {

constexpr int kPatience_s = 5;

sockaddr_in Ipv4(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  return address;
}

// One for each identity: what it shows is read once. None: it could not be made.
SSL_CTX* ContextOf(const std::string& identity) {
  static auto& contexts = *new std::map<std::string, SSL_CTX*>;  // OpenSSL ends before what is static here
  SSL_CTX*& context = contexts[identity];
  if (context != nullptr) return context;
  context = SSL_CTX_new(TLS_client_method());
  if (context == nullptr) return nullptr;
  const unsigned char h2[] = {2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context, h2, sizeof h2);
  SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  if (identity.empty()) return context;
  const std::string file = identity + "/identity.pem";
  SSL_CTX_use_certificate_chain_file(context, file.c_str());
  SSL_CTX_use_PrivateKey_file(context, file.c_str(), SSL_FILETYPE_PEM);
  return context;
}

bool MayGoOn(SSL* ssl, int result) {
  const int error = SSL_get_error(ssl, result);
  return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
}

}  // namespace

std::unique_ptr<FloodConnection> FloodConnection::Connect(const std::string& address, const std::string& identity,
                                                          const std::string& source) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  const std::size_t colon = address.rfind(':');
  const sockaddr_in to = Ipv4(address.substr(0, colon), std::stoi(address.substr(colon + 1)));
  const sockaddr_in from = Ipv4(source.empty() ? "0.0.0.0" : source, 0);
  SSL_CTX* const context = ContextOf(identity);
  const int fd = context == nullptr ? -1 : socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return nullptr;
  const timeval patience{kPatience_s, 0};
  const int at_once = 1;
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
  SSL* const ssl = SSL_new(context);
  std::unique_ptr<FloodConnection> made(new FloodConnection(fd, ssl));
  if (ssl == nullptr || bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0 ||
      connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 || SSL_set_fd(ssl, fd) != 1 ||
      SSL_connect(ssl) != 1 || fcntl(fd, F_SETFL, O_NONBLOCK) != 0)
    return nullptr;
  return made;
}

FloodConnection::~FloodConnection() {
  SSL_free(ssl_);
  close(fd_);
}

bool FloodConnection::Write(std::string* bytes) {
  std::size_t done = 0;
  while (done < bytes->size()) {
    const int count =
        SSL_write(ssl_, bytes->data() + done, static_cast<int>(std::min<std::size_t>(bytes->size() - done, 1U << 16)));
    if (count <= 0 && !MayGoOn(ssl_, count)) return false;
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes->erase(0, done);
  return true;
}

int FloodConnection::Read(char* to, int size) {
  const int count = SSL_read(ssl_, to, size);
  if (count > 0) return count;
  return MayGoOn(ssl_, count) ? 0 : -1;
}

}  // namespace sixpoint::bench
