#include "tests/services/runtime/raw_connection.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

namespace sixpoint::runtime::testing {
namespace {

constexpr int kPatience_ms = 10'000;
constexpr std::string_view kUnix = "unix:";

sockaddr_in Ipv4(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  return address;
}

int Connect(const std::string& address, const std::string& source) {
  if (address.rfind(kUnix, 0) == 0) {
    sockaddr_un place{};
    place.sun_family = AF_UNIX;
    std::strncpy(place.sun_path, address.c_str() + kUnix.size(), sizeof place.sun_path - 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0) return fd;
    close(fd);
    return -1;
  }
  const std::size_t colon = address.rfind(':');
  const sockaddr_in to = Ipv4(address.substr(0, colon), std::stoi(address.substr(colon + 1)));
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in from = Ipv4(source.empty() ? "0.0.0.0" : source, 0);
  if (fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0 &&
      connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0)
    return fd;
  close(fd);
  return -1;
}

// HTTP/2 is agreed on in the handshake; the server's certificate is not looked at. One for each identity.
SSL_CTX* ClientContext(const std::string& identity) {
  static std::mutex mutex;
  static auto& contexts = *new std::map<std::string, SSL_CTX*>;  // OpenSSL ends before what is static here
  const std::lock_guard<std::mutex> lock(mutex);
  SSL_CTX*& made = contexts[identity];
  if (made != nullptr) return made;
  made = SSL_CTX_new(TLS_client_method());
  const unsigned char h2[] = {2, 'h', '2'};
  SSL_CTX_set_alpn_protos(made, h2, sizeof h2);
  SSL_CTX_set_mode(made, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  if (identity.empty()) return made;
  const std::string file = identity + "/identity.pem";
  SSL_CTX_use_certificate_chain_file(made, file.c_str());
  SSL_CTX_use_PrivateKey_file(made, file.c_str(), SSL_FILETYPE_PEM);
  return made;
}

}  // namespace

struct RawConnection::Tls {
  explicit Tls(const std::string& identity) : ssl(SSL_new(ClientContext(identity))) {}
  ~Tls() { SSL_free(ssl); }
  Tls(const Tls&) = delete;
  Tls& operator=(const Tls&) = delete;
  // Waits for the other end no longer than we have patience.
  bool ShakeHands(int fd) const {
    const timeval patience{kPatience_ms / 1000, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    return SSL_set_fd(ssl, fd) == 1 && SSL_connect(ssl) == 1 && fcntl(fd, F_SETFL, O_NONBLOCK) == 0;
  }
  bool MayGoOn(int result) const {
    const int error = SSL_get_error(ssl, result);
    return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
  }
  SSL* const ssl;
};

RawConnection::RawConnection(const std::string& address, const std::string& source, Speaks speaks,
                             const std::string& identity)
    : fd_(Connect(address, source)) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  if (fd_ < 0 || speaks == Speaks::kNothing) return;
  tls_ = std::make_unique<Tls>(identity);
  if (!tls_->ShakeHands(fd_)) tls_.reset();
}
RawConnection::RawConnection(RawConnection&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), tls_(std::move(other.tls_)) {}
RawConnection::~RawConnection() {
  tls_.reset();
  if (fd_ >= 0) close(fd_);
}

bool RawConnection::ReadAway() {
  char bytes[65'536];
  while (tls_ != nullptr) {
    const int count = SSL_read(tls_->ssl, bytes, sizeof bytes);
    if (count <= 0) return tls_->MayGoOn(count);
  }
  while (true) {
    const ssize_t count = recv(fd_, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EAGAIN)) return false;
    if (count < 0) return true;
  }
}

bool RawConnection::Send(std::string_view bytes, Answers answers) {
  if (tls_ == nullptr) return false;
  const short events = answers == Answers::kLeft ? POLLOUT : POLLIN | POLLOUT;
  while (!bytes.empty()) {
    pollfd ready{fd_, events, 0};
    if (poll(&ready, 1, kPatience_ms) <= 0) return false;
    if (answers == Answers::kLeft && (ready.revents & ~POLLOUT) != 0) return false;
    if ((ready.revents & ~POLLOUT) != 0 && !ReadAway()) return false;
    if ((ready.revents & POLLOUT) == 0) continue;
    const int count = SSL_write(tls_->ssl, bytes.data(), static_cast<int>(bytes.size()));
    if (count <= 0 && !tls_->MayGoOn(count)) return false;
    if (count > 0) bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool RawConnection::SendBare(std::string_view bytes) {
  return send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

bool RawConnection::Renegotiate() {
  if (tls_ == nullptr || SSL_renegotiate(tls_->ssl) != 1) return false;
  const int result = SSL_do_handshake(tls_->ssl);
  return (result == 1 || tls_->MayGoOn(result)) && ReadAway();
}

bool RawConnection::IsClosedWithin(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  do {
    if (!ReadAway()) return true;
    pollfd readable{fd_, POLLIN, 0};
    poll(&readable, 1, seconds > 0 ? 20 : 0);
  } while (std::chrono::steady_clock::now() < end);
  return !ReadAway();
}

std::string FrameOf(Frame type, int flags, unsigned stream, std::string_view payload) {
  const std::size_t length = payload.size();
  const auto byte = [](std::size_t value) { return static_cast<char>(value & 0xff); };
  std::string frame{byte(length >> 16),
                    byte(length >> 8),
                    byte(length),
                    byte(static_cast<std::size_t>(type)),
                    byte(static_cast<std::size_t>(flags)),
                    byte(stream >> 24),
                    byte(stream >> 16),
                    byte(stream >> 8),
                    byte(stream)};
  return frame.append(payload);
}

std::string Preface() { return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + FrameOf(Frame::kSettings, 0, 0, ""); }

std::string CallHeaders(std::string_view path) {
  const auto text = [](std::string_view value) {
    return std::string(1, static_cast<char>(value.size())).append(value);
  };
  // RFC 7541: POST and http are of the static table, the rest are literals that no table keeps.
  return "\x83\x86\x04" + text(path) + "\x01" + text("x") + "\x0f\x10" + text("application/grpc") +
         std::string(1, '\0') + text("te") + text("trailers");
}

}  // namespace sixpoint::runtime::testing
