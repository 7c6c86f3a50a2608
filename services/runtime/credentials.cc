#include "services/runtime/credentials.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "identity/credentials.h"
#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

namespace fs = std::filesystem;
using grpc::experimental::FileWatcherCertificateProvider;

// How soon a renewed file counts for new connections.
constexpr unsigned kLook_s = 1;

// gRPC says nothing of a file that it cannot use, and connects to nobody.
absl::Status CheckAuthority(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  if (text.str().find("-----BEGIN CERTIFICATE-----") != std::string::npos) return absl::OkStatus();
  return Refuse("certificates", file.string(), "the certificate of the plant's authority");
}

absl::Status CheckIdentity(const fs::path& file) {
  const auto own = identity::ReadCertificate(file);
  if (own.ok()) return absl::OkStatus();
  return Refuse("certificates", file.string() + " (" + std::string(own.status().message()) + ")",
                "a key and its certificate");
}

// Of a file that is looked at for its form elsewhere.
std::string TextOf(const fs::path& file) {
  constexpr std::streamsize kMost_bytes = 65536;
  std::string text(kMost_bytes, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(text.data(), kMost_bytes);
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

// Of two channels that begin to connect at once by one watcher of files, gRPC 1.51 lets the second go on before the files are read, and its
// connection fails ("Failed to create security handshaker"): each channel has a watcher of its own.
class WatchedByEachChannel final : public grpc::ChannelCredentials {
 public:
  // `own` is empty where one connects as nobody.
  WatchedByEachChannel(const fs::path& authority, const fs::path& own)
      : authority_(authority.string()), own_(own.string()) {}

 protected:
  grpc::SecureChannelCredentials* AsSecureCredentials() override { return nullptr; }

 private:
  std::shared_ptr<grpc::ChannelCredentials> Make() const {
    grpc::experimental::TlsChannelCredentialsOptions options;
    if (own_.empty()) {
      options.set_certificate_provider(std::make_shared<FileWatcherCertificateProvider>(authority_, kLook_s));
    } else {
      options.set_certificate_provider(
          std::make_shared<FileWatcherCertificateProvider>(own_, own_, authority_, kLook_s));
      options.watch_identity_key_cert_pairs();
    }
    options.watch_root_certs();
    return grpc::experimental::TlsCredentials(options);
  }

  std::shared_ptr<grpc::Channel> CreateChannelImpl(const grpc::string& target,
                                                   const grpc::ChannelArguments& arguments) override {
    return grpc::CreateCustomChannel(target, Make(), arguments);
  }

  std::shared_ptr<grpc::Channel> CreateChannelWithInterceptors(
      const grpc::string& target, const grpc::ChannelArguments& arguments,
      std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors) override {
    return grpc::experimental::CreateCustomChannelWithInterceptors(target, Make(), arguments, std::move(interceptors));
  }

  const std::string authority_, own_;
};

}  // namespace

absl::Status CheckServiceCredentials(const fs::path& folder, const std::string& area) {
  const identity::Credentials found = {TextOf(folder / identity::kIdentityFile),
                                       TextOf(folder / identity::kAuthorityFile)};
  const auto own = identity::CheckBelongTogether(found);
  if (!own.ok())
    return absl::InvalidArgumentError("certificates: " + folder.string() + ": " + std::string(own.status().message()));
  const std::string wanted = "services/" + area;
  if (own->identity.Text() == wanted) return absl::OkStatus();
  return Refuse("certificates", (folder / identity::kIdentityFile).string() + " (of " + own->identity.Text() + ")",
                "one of " + wanted);
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> ChannelCredentialsOf(const fs::path& folder) {
  const fs::path authority = folder / identity::kAuthorityFile, own = folder / identity::kIdentityFile;
  if (absl::Status status = CheckAuthority(authority); !status.ok()) return status;
  std::error_code unreadable;
  if (!fs::exists(own, unreadable) && !unreadable) return std::make_shared<WatchedByEachChannel>(authority, fs::path());
  if (absl::Status status = CheckIdentity(own); !status.ok()) return status;
  return std::make_shared<WatchedByEachChannel>(authority, own);
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsForAStranger() {
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  options.set_check_call_host(false);
  return grpc::experimental::TlsCredentials(options);
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> ServerCredentialsOf(const fs::path& folder) {
  const fs::path own = folder / identity::kIdentityFile;
  if (absl::Status status = CheckIdentity(own); !status.ok()) return status;
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<FileWatcherCertificateProvider>(own.string(), own.string(), kLook_s));
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_BUT_DONT_VERIFY);
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace sixpoint::runtime
