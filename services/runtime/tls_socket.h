// TLS on sockets that do not block, with this service's own certificate. Whoever connects is asked for his, which is judged by whoever
// reads it, in plain words, as gRPC's side does (credentials.h). Private to runtime.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "identity/files.h"
#include "services/runtime/listening_sockets.h"

struct ssl_ctx_st;
struct ssl_st;

namespace sixpoint::runtime {

// Not thread-safe.
class TlsServer {
 public:
  // INVALID_ARGUMENT where the file holds no key and certificate.
  static absl::StatusOr<std::unique_ptr<TlsServer>> Open(const std::filesystem::path& identity_file);
  ~TlsServer();
  TlsServer(const TlsServer&) = delete;
  TlsServer& operator=(const TlsServer&) = delete;

  // As the file is now; one that cannot be used changes nothing.
  ssl_ctx_st* Current();

 private:
  explicit TlsServer(std::filesystem::path identity_file) : identity_file_(std::move(identity_file)) {}
  absl::Status Read();

  const std::filesystem::path identity_file_;
  std::optional<identity::FileMark> mark_;
  ssl_ctx_st* context_ = nullptr;
};

class TlsSocket {
 public:
  // `server`: of now.
  TlsSocket(ssl_ctx_st* server, Descriptor socket);
  ~TlsSocket();
  TlsSocket(const TlsSocket&) = delete;
  TlsSocket& operator=(const TlsSocket&) = delete;

  enum class Went { kOn, kWantsToRead, kWantsToWrite, kOver };
  Went ShakeHands();
  // Appends what has come.
  Went Read(std::string* text);
  // Takes what was written away from the text's beginning.
  Went Write(std::string_view* text);
  // Says good-bye, without waiting for an answer.
  void Close();

  int fd() const { return socket_.get(); }
  // What the other end has shown; empty: nothing.
  std::string PeerCertificatePem() const;

 private:
  Went After(int result);

  const Descriptor socket_;
  ssl_st* const tls_;
  bool is_broken_ = false;
};

// When the certificate in a file ends; none where there is none that can be read.
std::optional<std::chrono::system_clock::time_point> CertificateEnd(const std::filesystem::path& file);

}  // namespace sixpoint::runtime
