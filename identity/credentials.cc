#include "identity/credentials.h"

#include <sys/stat.h>
#include <unistd.h>

#include <utility>

#include "identity/authority_folder.h"
#include "identity/certificates.h"
#include "identity/files.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;

constexpr char kRenewed[] = "certificate";

// The key's, the same one's, and no step back.
absl::Status CheckRenews(X509* renewed, const OwnKey& own, const IssuedCertificate& there) {
  if (X509_check_private_key(renewed, own.key.get()) != 1)
    return Refuse(kRenewed, "of another key", "one of the key that lies there");
  const absl::StatusOr<IssuedCertificate> next = IssuedOf(renewed);
  if (!next.ok()) return InFile(kRenewed, next.status());
  if (UrisOf(next->identity) != UrisOf(there.identity))
    return Refuse(kRenewed, "of " + next->identity.Text(),
                  "one of " + there.identity.Text() + " and of the same roles, as the one there");
  if (next->not_after < there.not_after)
    return Refuse(kRenewed, "ends " + TimeText(next->not_after),
                  TimeText(there.not_after) + " or later, as the one there");
  return absl::OkStatus();
}

// Anybody makes a certificate of a known public key: it would lock out whoever takes it for a renewal.
absl::Status CheckAuthorityBeside(X509* renewed, const fs::path& folder) {
  const fs::path file = folder / kAuthorityFile;
  const absl::StatusOr<std::string> pem = ReadFile(file, kMostCertificate_bytes);
  if (absl::IsNotFound(pem.status())) return absl::OkStatus();
  if (!pem.ok()) return pem.status();
  const absl::StatusOr<Certificate> authority = CertificateOfPem(*pem);
  const absl::Status right = authority.ok() ? CheckAuthority(authority->get()) : authority.status();
  if (!right.ok()) return InFile(file, right);
  return InFile(kRenewed, CheckGivenBy(renewed, authority->get()));
}

}  // namespace

absl::Status WriteCredentials(const fs::path& path, const Credentials& credentials) {
  const absl::StatusOr<Folder> folder = Folder::Make(path);
  if (!folder.ok()) return folder.status();
  // In this order: who finds an identity finds the authority, too.
  if (absl::Status written = folder->Write(kAuthorityFile, credentials.authority_pem, kPublic); !written.ok())
    return written;
  return folder->Write(kIdentityFile, credentials.identity_pem, kSecret);
}

absl::StatusOr<IssuedCertificate> CertificateOf(const std::string& pem) {
  const OwnErrors errors;
  if (pem.size() > kMostCertificate_bytes) return Refuse("certificate", "longer", "at most 16 KiB of PEM");
  const absl::StatusOr<Certificate> certificate = CertificateOfPem(pem);  // and no key beside it
  if (!certificate.ok()) return certificate.status();
  return IssuedOf(certificate->get());
}

absl::StatusOr<IssuedCertificate> ReadCertificate(const fs::path& identity_file) {
  const OwnErrors errors;
  absl::StatusOr<std::string> pem = ReadFile(identity_file, kMostKey_bytes + kMostCertificate_bytes);
  if (!pem.ok()) return pem.status();
  const absl::StatusOr<Certificate> certificate = CertificateOfPem(*pem, true);
  OPENSSL_cleanse(pem->data(), pem->size());
  absl::StatusOr<IssuedCertificate> read =
      certificate.ok() ? IssuedOf(certificate->get()) : absl::StatusOr<IssuedCertificate>(certificate.status());
  if (!read.ok()) return InFile(identity_file, read.status());
  return read;
}

absl::StatusOr<IssuedCertificate> CheckBelongTogether(const Credentials& credentials) {
  const OwnErrors errors;
  if (credentials.identity_pem.size() > kMostKey_bytes + kMostCertificate_bytes ||
      credentials.authority_pem.size() > kMostCertificate_bytes)
    return Refuse("certificate", "longer", "at most 16 KiB of PEM");
  const absl::StatusOr<OwnKey> own = OwnKeyOf(credentials.identity_pem);
  if (!own.ok()) return InFile(kIdentityFile, own.status());
  const absl::StatusOr<Certificate> authority = CertificateOfPem(credentials.authority_pem);
  const absl::Status right = authority.ok() ? CheckAuthority(authority->get()) : authority.status();
  if (!right.ok()) return InFile(kAuthorityFile, right);
  const absl::Status given = CheckGivenBy(own->certificate.get(), authority->get());
  if (!given.ok()) return InFile(kIdentityFile, given);
  return IssuedOf(own->certificate.get());
}

absl::Status ReplaceCertificate(const fs::path& identity_file, const std::string& certificate_pem) {
  const OwnErrors errors;
  if (certificate_pem.size() > kMostCertificate_bytes) return Refuse(kRenewed, "longer", "at most 16 KiB of PEM");
  const absl::StatusOr<Certificate> renewed = CertificateOfPem(certificate_pem);
  if (!renewed.ok()) return InFile(kRenewed, renewed.status());
  const fs::path above = identity_file.has_parent_path() ? identity_file.parent_path() : fs::path(".");
  const std::string name = identity_file.filename();
  // The key's file in one folder throughout, and no link followed to it: root does this in folders that are others'.
  const absl::StatusOr<Folder> folder = Folder::Open(above);
  if (!folder.ok()) return folder.status();
  struct stat found {};
  absl::StatusOr<std::string> pem = folder->Read(name, kMostKey_bytes + kMostCertificate_bytes, &found);
  if (!pem.ok()) return pem.status();
  const absl::StatusOr<OwnKey> own = OwnKeyOf(*pem);
  OPENSSL_cleanse(pem->data(), pem->size());
  if (!own.ok()) return InFile(identity_file, own.status());
  const absl::StatusOr<IssuedCertificate> there = IssuedOf(own->certificate.get());
  if (!there.ok()) return InFile(identity_file, there.status());
  if (absl::Status right = CheckRenews(renewed->get(), *own, *there); !right.ok()) return right;
  if (absl::Status ours = CheckAuthorityBeside(renewed->get(), above); !ours.ok()) return ours;
  const absl::StatusOr<std::string> renewed_pem = PemOf(renewed->get());
  if (!renewed_pem.ok()) return renewed_pem.status();
  absl::StatusOr<std::string> key_pem = PemOf(own->key.get());
  if (!key_pem.ok()) return key_pem.status();
  // Of another's file nobody but root becomes the owner unasked: the system refuses him then.
  const bool is_anothers = geteuid() == 0 || found.st_uid != geteuid();
  const std::optional<Owner> owner = is_anothers ? std::optional<Owner>({found.st_uid, found.st_gid}) : std::nullopt;
  std::string content;
  content.reserve(key_pem->size() + renewed_pem->size());  // no copy of the key is left behind
  content.append(*key_pem).append(*renewed_pem);
  const absl::Status written = folder->Write(name, content, kSecret, owner);
  OPENSSL_cleanse(content.data(), content.size());
  OPENSSL_cleanse(key_pem->data(), key_pem->size());
  return written;
}

}  // namespace sixpoint::identity
