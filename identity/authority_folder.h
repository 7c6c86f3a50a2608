// The folder of an authority: what its files are called, who may see them, and that each is what it should be. Private to the room.
//   key.pem            0600
//   certificate.pem    its own
//   issued/SERIAL.pem  each certificate that it gave; never a key
//   revoked.pem        what it took back
//   lock               whoever changes one of these holds it
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>

#include "identity/certificates.h"
#include "identity/files.h"
#include "identity/revocation_list.h"

namespace sixpoint::identity {

inline constexpr char kKeyFile[] = "key.pem", kCertificateFile[] = "certificate.pem", kRevokedFile[] = "revoked.pem";
inline constexpr char kIssuedFolder[] = "issued";
inline constexpr mode_t kSecret = 0600, kPublic = 0644;
// How far the clocks of a plant's computers may lie apart, or be set back: what is given now holds for one that is late, too. An hour
// is what a control's clock is off that knows nothing of summer.
inline constexpr auto kClockDifference = std::chrono::hours(3);

// Of an identity.pem (credentials.h), whose text is wiped once it was read.
absl::StatusOr<OwnKey> ReadOwnKey(const std::filesystem::path& identity_file);

// The same failure, saying of which file.
absl::Status InFile(const std::filesystem::path& file, const absl::Status& status);

// OK of an empty folder, or of what is left of a Create that was cut off: one that somebody else uses is not taken.
absl::Status CheckFree(const Folder& folder);

// PERMISSION_DENIED where others may write in it, or the key is not its owner's alone.
absl::StatusOr<Folder> OpenFolder(const std::filesystem::path& path);
absl::StatusOr<AuthorityKey> ReadAuthority(const Folder& folder);
absl::StatusOr<Certificate> ReadAuthorityCertificate(const Folder& folder);

// `pem_read`: where not null, the list as it stands there.
absl::StatusOr<RevocationList> ReadRevoked(const Folder& folder, X509* authority, std::string* pem_read = nullptr);
absl::Status WriteRevoked(const Folder& folder, const AuthorityKey& authority, const RevocationList& list);

}  // namespace sixpoint::identity
