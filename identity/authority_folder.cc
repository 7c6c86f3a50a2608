#include "identity/authority_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <utility>
#include <vector>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestFileNameShown = 100;

absl::Status Denied(const fs::path& path, const struct stat& found, const std::string& wanted_mode) {
  char mode[8];
  std::snprintf(mode, sizeof mode, "%04o", static_cast<unsigned>(found.st_mode & 07777));
  return absl::PermissionDeniedError(path.string() + ": mode " + mode + " of user " + std::to_string(found.st_uid) +
                                     ", want " + wanted_mode + " of user " + std::to_string(geteuid()) +
                                     ", so that its owner alone has the authority");
}

// Of another's folder the system says no more than that.
absl::Status Unseen(const absl::Status& status) {
  if (!absl::IsPermissionDenied(status)) return status;
  return absl::PermissionDeniedError(std::string(status.message()) + ", want one of user " + std::to_string(geteuid()));
}

// Beside a key there is one: NOT_FOUND would mean that there is no authority.
absl::Status Missing(const fs::path& file, const absl::Status& status) {
  return absl::IsNotFound(status) ? Refuse(file.string(), "missing", "it, from a copy") : status;
}

}  // namespace

absl::Status InFile(const fs::path& file, const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  for (Violation& v : violations) v.field = file.string() + (v.field.empty() ? "" : ": " + v.field);
  if (!violations.empty()) return Refuse(violations);
  if (status.ok()) return status;
  return absl::Status(status.code(), file.string() + ": " + std::string(status.message()));
}

absl::StatusOr<OwnKey> ReadOwnKey(const fs::path& identity_file) {
  absl::StatusOr<std::string> pem = ReadFile(identity_file, kMostKey_bytes + kMostCertificate_bytes);
  if (!pem.ok()) return pem.status();
  absl::StatusOr<OwnKey> own = OwnKeyOf(*pem);
  OPENSSL_cleanse(pem->data(), pem->size());
  if (!own.ok()) return InFile(identity_file, own.status());
  return own;
}

absl::Status CheckFree(const Folder& folder) {
  const absl::StatusOr<std::vector<std::string>> names = folder.Names();
  if (!names.ok()) return names.status();
  for (const std::string& name : *names) {
    const bool ours = name == kLockFile || name == kKeyFile || name == kCertificateFile || name == kRevokedFile ||
                      name == kIssuedFolder || name.rfind(kUnfinished, 0) == 0;
    if (!ours) return Refuse(folder.path().string(), "holds " + Tame(name, kLongestFileNameShown), "an empty folder");
  }
  const absl::StatusOr<struct stat> found = folder.Look();
  if (!found.ok()) return found.status();
  return found->st_uid == geteuid() ? absl::OkStatus() : Denied(folder.path(), *found, "0700");
}

absl::StatusOr<Folder> OpenFolder(const fs::path& path) {
  absl::StatusOr<Folder> folder = Folder::Open(path);
  if (!folder.ok()) return Unseen(folder.status());
  const absl::StatusOr<struct stat> found = folder->Look();
  if (!found.ok()) return found.status();
  // Who writes in it puts another's certificate beside the key.
  if (found->st_uid != geteuid() || (found->st_mode & (S_IWGRP | S_IWOTH)) != 0) return Denied(path, *found, "0700");
  return folder;
}

absl::StatusOr<Certificate> ReadAuthorityCertificate(const Folder& folder) {
  const absl::StatusOr<std::string> pem = folder.Read(kCertificateFile, kMostCertificate_bytes);
  if (!pem.ok()) return Missing(folder.path() / kCertificateFile, pem.status());
  absl::StatusOr<Certificate> certificate = CertificateOfPem(*pem);
  const absl::Status right = certificate.ok() ? CheckAuthority(certificate->get()) : certificate.status();
  if (!right.ok()) return InFile(folder.path() / kCertificateFile, right);
  return certificate;
}

absl::StatusOr<AuthorityKey> ReadAuthority(const Folder& folder) {
  struct stat found {};
  absl::StatusOr<std::string> pem = folder.Read(kKeyFile, kMostKey_bytes, &found);
  if (!pem.ok()) return Unseen(pem.status());
  absl::StatusOr<Key> key = KeyOfPem(*pem);
  OPENSSL_cleanse(pem->data(), pem->size());
  if (found.st_uid != geteuid() || (found.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Denied(folder.path() / kKeyFile, found, "0600");
  if (!key.ok()) return InFile(folder.path() / kKeyFile, key.status());
  absl::StatusOr<Certificate> certificate = ReadAuthorityCertificate(folder);
  if (!certificate.ok()) return certificate.status();
  if (X509_check_private_key(certificate->get(), key->get()) != 1)
    return Refuse((folder.path() / kCertificateFile).string(), "of another key", std::string("that of ") + kKeyFile);
  return AuthorityKey{*std::move(key), *std::move(certificate)};
}

absl::StatusOr<RevocationList> ReadRevoked(const Folder& folder, X509* authority, std::string* pem_read) {
  absl::StatusOr<std::string> pem = folder.Read(kRevokedFile, kMostRevoked_bytes);
  if (!pem.ok()) return Missing(folder.path() / kRevokedFile, pem.status());
  absl::StatusOr<RevocationList> list = RevocationListOf(*pem, authority);
  if (!list.ok()) return InFile(folder.path() / kRevokedFile, list.status());
  if (pem_read != nullptr) *pem_read = *std::move(pem);
  return list;
}

absl::Status WriteRevoked(const Folder& folder, const AuthorityKey& authority, const RevocationList& list) {
  const absl::StatusOr<std::string> pem =
      RevocationListPem(authority, list, std::chrono::system_clock::now() - kClockDifference);
  if (!pem.ok()) return pem.status();
  if (pem->size() > kMostRevoked_bytes)
    return absl::ResourceExhaustedError((folder.path() / kRevokedFile).string() + ": full, want a new authority");
  return folder.Write(kRevokedFile, *pem, kPublic);
}

}  // namespace sixpoint::identity
