#include "services/runtime/tls_socket.h"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <array>

#include "identity/certificates.h"
#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr std::size_t kMostFile_bytes = 64 * 1024;
// Of certificates that somebody shows; ours are below one.
constexpr long kMostShown_bytes = 16 * 1024;

using Context = std::unique_ptr<SSL_CTX, identity::FreedBy<SSL_CTX_free>>;

// That whoever shows a certificate holds its key the handshake proves; whose it is, is asked later.
int TakeAny(int, X509_STORE_CTX*) { return 1; }

Context ContextOf(const std::string& pem) {
  const absl::StatusOr<identity::OwnKey> own = identity::OwnKeyOf(pem);
  Context context(SSL_CTX_new(TLS_server_method()));
  if (!own.ok() || context == nullptr) return nullptr;
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  // A session that is taken up again would show the certificate of another handshake.
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context.get(), SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  SSL_CTX_set_num_tickets(context.get(), 0);
  SSL_CTX_set_max_cert_list(context.get(), kMostShown_bytes);
  SSL_CTX_set_mode(context.get(),
                   SSL_MODE_RELEASE_BUFFERS | SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  // Who sends one record after another that is no data would keep a read from ever coming back.
  SSL_CTX_clear_mode(context.get(), SSL_MODE_AUTO_RETRY);
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, TakeAny);
  if (SSL_CTX_use_certificate(context.get(), own->certificate.get()) != 1 ||
      SSL_CTX_use_PrivateKey(context.get(), own->key.get()) != 1)
    return nullptr;
  return context;
}

}  // namespace

absl::StatusOr<std::unique_ptr<TlsServer>> TlsServer::Open(const std::filesystem::path& identity_file) {
  std::unique_ptr<TlsServer> server(new TlsServer(identity_file));
  if (absl::Status read = server->Read(); !read.ok()) return read;
  return server;
}

TlsServer::~TlsServer() { SSL_CTX_free(context_); }

absl::Status TlsServer::Read() {
  std::optional<identity::FileMark> mark;
  const absl::StatusOr<std::string> pem = identity::ReadFile(identity_file_, kMostFile_bytes, &mark);
  if (!pem.ok()) return pem.status();
  Context context = ContextOf(*pem);
  ERR_clear_error();
  if (context == nullptr) return Refuse("certificates", identity_file_.string(), "a key and its certificate");
  SSL_CTX_free(context_);
  context_ = context.release();
  mark_ = mark;
  return absl::OkStatus();
}

ssl_ctx_st* TlsServer::Current() {
  if (const auto now = identity::MarkOf(identity_file_); !mark_ || (now && !(*now == *mark_))) Read().IgnoreError();
  return context_;
}

TlsSocket::TlsSocket(ssl_ctx_st* server, Descriptor socket) : socket_(std::move(socket)), tls_(SSL_new(server)) {
  is_broken_ = tls_ == nullptr || SSL_set_fd(tls_, socket_.get()) != 1;
  if (!is_broken_) SSL_set_accept_state(tls_);
}

TlsSocket::~TlsSocket() { SSL_free(tls_); }

TlsSocket::Went TlsSocket::After(int result) {
  const int error = SSL_get_error(tls_, result);
  if (error == SSL_ERROR_WANT_READ) return Went::kWantsToRead;
  if (error == SSL_ERROR_WANT_WRITE) return Went::kWantsToWrite;
  is_broken_ = true;
  return Went::kOver;
}

TlsSocket::Went TlsSocket::ShakeHands() {
  if (is_broken_) return Went::kOver;
  ERR_clear_error();
  const int result = SSL_do_handshake(tls_);
  return result == 1 ? Went::kOn : After(result);
}

TlsSocket::Went TlsSocket::Read(std::string* text) {
  if (is_broken_) return Went::kOver;
  ERR_clear_error();
  std::array<char, 4096> buffer;
  std::size_t got = 0;
  const int result = SSL_read_ex(tls_, buffer.data(), buffer.size(), &got);
  if (result != 1) return After(result);
  text->append(buffer.data(), got);
  return Went::kOn;
}

TlsSocket::Went TlsSocket::Write(std::string_view* text) {
  if (is_broken_) return Went::kOver;
  ERR_clear_error();
  std::size_t sent = 0;
  const int result = SSL_write_ex(tls_, text->data(), text->size(), &sent);
  if (result != 1) return After(result);
  text->remove_prefix(sent);
  return Went::kOn;
}

void TlsSocket::Close() {
  if (is_broken_) return;
  ERR_clear_error();
  SSL_shutdown(tls_);
}

std::string TlsSocket::PeerCertificatePem() const {
  if (is_broken_) return "";
  const identity::Certificate shown(SSL_get1_peer_certificate(tls_));
  return shown == nullptr ? "" : identity::PemOf(shown.get()).value_or("");
}

std::optional<std::chrono::system_clock::time_point> CertificateEnd(const std::filesystem::path& file) {
  const absl::StatusOr<std::string> pem = identity::ReadFile(file, kMostFile_bytes);
  if (!pem.ok()) return std::nullopt;
  const absl::StatusOr<identity::Certificate> certificate = identity::CertificateOfPem(*pem, /*beside_key=*/true);
  if (!certificate.ok()) return std::nullopt;
  const auto end = identity::TimePointOf(X509_get0_notAfter(certificate->get()));
  return end.ok() ? std::optional(*end) : std::nullopt;
}

}  // namespace sixpoint::runtime
