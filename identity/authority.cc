#include "identity/authority.h"

#include <sys/stat.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include "identity/authority_folder.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using std::chrono::hours;
using std::chrono::system_clock;

constexpr char kPem[] = ".pem";
constexpr auto kAuthorityLife = hours(24 * 14610);  // forty years: as long as a plant answers for its parts
constexpr hours kShortest{1}, kLongest{24 * 397};
// What Trust reads (kMostCertificate_bytes) holds so many of the longest.
constexpr std::size_t kMostHosts = 16;
constexpr std::size_t kLongestPlant = 64, kLongestSerialShown = 100;

bool IsPlant(const std::string& plant) {
  std::size_t count = 0;
  const auto* at = reinterpret_cast<const unsigned char*>(plant.data());
  for (int left = static_cast<int>(std::min<std::size_t>(plant.size(), 4 * kLongestPlant + 1)); left > 0; ++count) {
    unsigned long character = 0;
    const int size = UTF8_getc(at, left, &character);
    if (size <= 0 || character < 0x20 || (character >= 0x7f && character < 0xa0)) return false;
    at += size;
    left -= size;
  }
  return count >= 1 && count <= kLongestPlant;
}

// Lower-case, and none of what would name another file.
std::optional<std::string> PlainSerial(std::string text) {
  constexpr std::size_t kLongestSerial = 40;
  for (char& c : text) {
    if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) return std::nullopt;
  }
  if (text.empty() || text.size() > kLongestSerial) return std::nullopt;
  return text;
}

// The serial of an issued certificate's file.
std::optional<std::string> SerialOfFile(const std::string& name) {
  const std::string ending = kPem;
  if (name.size() <= ending.size() || name.substr(name.size() - ending.size()) != ending) return std::nullopt;
  return PlainSerial(name.substr(0, name.size() - ending.size()));
}

// Where a certificate that was given lies.
struct GivenFile {
  Folder issued;
  std::string name;
};

absl::StatusOr<GivenFile> FileOfSerial(const Folder& folder, const std::string& given) {
  absl::StatusOr<Folder> issued = folder.OpenInside(kIssuedFolder);
  if (!issued.ok()) return issued.status();
  const std::optional<std::string> serial = PlainSerial(given);
  const absl::StatusOr<bool> known = serial ? issued->Holds(*serial + kPem) : false;
  if (!known.ok()) return known.status();
  if (*known) return GivenFile{*std::move(issued), *serial + kPem};
  return absl::NotFoundError("serial: " + Tame(given, kLongestSerialShown) +
                             ", want that of a certificate which this authority gave");
}

// One that it gave, as it was kept.
struct Given {
  Certificate certificate;
  IssuedCertificate issued;
  // The certificate's own time knows seconds only; its file's tells which of a second came later.
  TimePoint kept_at;
};

absl::StatusOr<Given> ReadGiven(const Folder& issued, const std::string& name) {
  struct stat file {};
  const absl::StatusOr<std::string> pem = issued.Read(name, kMostCertificate_bytes, &file);
  if (!pem.ok()) return pem.status();
  absl::StatusOr<Certificate> certificate = CertificateOfPem(*pem);
  absl::StatusOr<IssuedCertificate> one =
      certificate.ok() ? IssuedOf(certificate->get()) : absl::StatusOr<IssuedCertificate>(certificate.status());
  if (one.ok() && one->serial != SerialOfFile(name)) one = Misread("holds another certificate", "that of its name");
  if (!one.ok()) return InFile(issued.path() / name, one.status());
  return Given{*std::move(certificate), *std::move(one),
               TimePoint(std::chrono::seconds(file.st_mtim.tv_sec) + std::chrono::nanoseconds(file.st_mtim.tv_nsec))};
}

// Its PEM. Kept before it is handed out: what nobody knows of cannot be taken back.
absl::StatusOr<std::string> Keep(const Folder& issued, X509* certificate) {
  const absl::StatusOr<std::string> serial = SerialOf(certificate);
  if (!serial.ok()) return serial.status();
  absl::StatusOr<std::string> pem = PemOf(certificate);
  if (!pem.ok()) return pem.status();
  if (absl::Status kept = issued.Write(*serial + kPem, *pem, kPublic); !kept.ok()) return kept;
  return pem;
}

// Whether it holds still: who lost his certificate is given no other for it.
absl::Status CheckHolds(const IssuedCertificate& certificate, const RevocationList& revoked) {
  std::string what;
  if (const auto entry = revoked.revoked_at.find(certificate.serial); entry != revoked.revoked_at.end())
    what = "taken back " + TimeText(entry->second);
  else if (system_clock::now() > certificate.not_after)
    what = "expired " + TimeText(certificate.not_after);
  else
    return absl::OkStatus();
  return absl::FailedPreconditionError("serial: " + certificate.serial + " of " + certificate.identity.Text() + ", " +
                                       what + ", want a certificate that holds still");
}

// As whoever wrote it can only have meant it: its roles those of its kind.
absl::StatusOr<Identity> CheckIdentity(const Identity& wished) {
  if (wished.kind == Kind::kUser) return IdentityOf(wished.Text(), wished.roles);
  absl::StatusOr<Identity> own = IdentityOf(wished.Text(), {});
  return !own.ok() || wished.roles.empty() || wished.roles == own->roles ? own
                                                                         : IdentityOf(wished.Text(), wished.roles);
}

absl::Status CheckHosts(const CertificateWish& wish) {
  const bool is_service = wish.identity.kind == Kind::kService;
  if (!is_service && !wish.hosts.empty()) return Refuse("hosts", wish.hosts[0], "none but of a service");
  // The gateway may do without: a proxy in front has its own certificate.
  const std::size_t fewest = is_service && wish.identity.name != kGatewayName ? 1 : 0;
  if (wish.hosts.size() < fewest || wish.hosts.size() > kMostHosts)
    return Refuse("hosts", static_cast<double>(wish.hosts.size()), "1 to 16 of a service");
  Refusals refusals;
  for (std::size_t i = 0; i < wish.hosts.size(); ++i) {
    if (!IsHost(wish.hosts[i]))
      refusals.Add(Refuse("hosts[" + std::to_string(i) + "]", wish.hosts[i],
                          "a host's name (letters, digits, '.' and '-', at most 253) or its address"));
  }
  return refusals.status();
}

absl::Status CheckLife(hours valid_for) {
  if (valid_for >= kShortest && valid_for <= kLongest) return absl::OkStatus();
  return Refuse("valid_for", std::to_string(valid_for.count()) + " h", "1 h to 9528 h (397 days)");
}

// From now on, within the authority's own time.
absl::StatusOr<Span> LifeFromNow(hours valid_for, X509* authority) {
  const absl::StatusOr<Span> its = ValidityOf(authority);
  if (!its.ok()) return its.status();
  const TimePoint now = system_clock::now();
  if (now < its->not_before || now >= its->not_after)
    return absl::FailedPreconditionError("authority: valid from " + TimeText(its->not_before) + " to " +
                                         TimeText(its->not_after) + ", want one that is valid now");
  return Span{std::max(now - kClockDifference, its->not_before), std::min(now + valid_for, its->not_after)};
}

}  // namespace

absl::Status Authority::Create(const fs::path& path, const std::string& plant) {
  const OwnErrors errors;
  if (!IsPlant(plant)) return Refuse("plant", plant, "1 to 64 printable characters");
  const absl::StatusOr<Folder> folder = Folder::Make(path);
  if (!folder.ok()) return folder.status();
  // What lies beside an authority that is there is nobody's trouble.
  if (const absl::StatusOr<bool> is_there = folder->Holds(kKeyFile); !is_there.ok() || !*is_there)
    if (absl::Status is_free = CheckFree(*folder); !is_free.ok()) return is_free;
  if (absl::Status made = folder->MakePrivate(); !made.ok()) return made;
  const absl::StatusOr<Descriptor> turn = folder->Lock();
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<bool> exists = folder->Holds(kKeyFile);
  if (!exists.ok()) return exists.status();
  const absl::StatusOr<Folder> issued = folder->MakeInside(kIssuedFolder);
  if (!issued.ok()) return issued.status();
  const absl::StatusOr<std::vector<std::string>> given = issued->Names();
  if (!given.ok()) return given.status();
  // Without its key it can give no more, but what it gave counts still.
  if (*exists || !given->empty())
    return absl::AlreadyExistsError(path.string() + ": holds an authority, want a folder without one");

  const TimePoint now = system_clock::now();
  AuthorityKey authority;
  absl::StatusOr<Key> key = NewKey();
  if (!key.ok()) return key.status();
  authority.key = *std::move(key);
  absl::StatusOr<Certificate> certificate =
      NewAuthorityCertificate(authority.key.get(), plant, {now - kClockDifference, now + kAuthorityLife});
  if (!certificate.ok()) return certificate.status();
  authority.certificate = *std::move(certificate);
  const absl::StatusOr<std::string> certificate_pem = PemOf(authority.certificate.get());
  if (!certificate_pem.ok()) return certificate_pem.status();
  absl::StatusOr<std::string> key_pem = PemOf(authority.key.get());
  if (!key_pem.ok()) return key_pem.status();
  // The key last: with it the authority is there. Until then another Create begins anew.
  absl::Status written = WriteRevoked(*folder, authority, {});
  if (written.ok()) written = folder->Write(kCertificateFile, *certificate_pem, kPublic);
  if (written.ok()) written = folder->Write(kKeyFile, *key_pem, kSecret);
  OPENSSL_cleanse(key_pem->data(), key_pem->size());
  return written;
}

absl::StatusOr<Authority> Authority::Open(const fs::path& path) {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(path);
  if (!folder.ok()) return folder.status();
  if (const auto authority = ReadAuthority(*folder); !authority.ok()) return authority.status();
  std::error_code error;
  const fs::path whole = fs::absolute(path, error);
  if (error) return absl::ErrnoToStatus(error.value(), path.string());
  return Authority(whole);
}

absl::StatusOr<Credentials> Authority::Issue(const CertificateWish& wish) {
  const OwnErrors errors;
  const absl::StatusOr<Identity> identity = CheckIdentity(wish.identity);
  const absl::Status asked =
      Refusals().Add(identity.status()).Add(CheckHosts(wish)).Add(CheckLife(wish.valid_for)).status();
  if (!asked.ok()) return asked;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Descriptor> turn = folder->Lock();
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<AuthorityKey> authority = ReadAuthority(*folder);
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<Span> valid = LifeFromNow(wish.valid_for, authority->certificate.get());
  if (!valid.ok()) return valid.status();

  const absl::StatusOr<Key> key = NewKey();
  if (!key.ok()) return key.status();
  const absl::StatusOr<Certificate> certificate = NewCertificate(*authority, key->get(), *identity, wish.hosts, *valid);
  if (!certificate.ok()) return certificate.status();
  const absl::StatusOr<std::string> key_pem = PemOf(key->get()), authority_pem = PemOf(authority->certificate.get());
  for (const absl::Status& status : {key_pem.status(), authority_pem.status()})
    if (!status.ok()) return status;
  const absl::StatusOr<Folder> issued = folder->OpenInside(kIssuedFolder);
  if (!issued.ok()) return issued.status();
  const absl::StatusOr<std::string> pem = Keep(*issued, certificate->get());
  if (!pem.ok()) return pem.status();
  return Credentials{*key_pem + *pem, *authority_pem};
}

absl::StatusOr<std::string> Authority::Renew(const std::string& serial, hours valid_for) {
  const OwnErrors errors;
  if (absl::Status asked = CheckLife(valid_for); !asked.ok()) return asked;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Descriptor> turn = folder->Lock();
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<GivenFile> file = FileOfSerial(*folder, serial);
  if (!file.ok()) return file.status();
  const absl::StatusOr<AuthorityKey> authority = ReadAuthority(*folder);
  if (!authority.ok()) return authority.status();
  X509* const own = authority->certificate.get();
  const absl::StatusOr<RevocationList> revoked = ReadRevoked(*folder, own);
  if (!revoked.ok()) return revoked.status();
  const absl::StatusOr<Given> old = ReadGiven(file->issued, file->name);
  if (!old.ok()) return old.status();
  // Of a file that somebody laid there the authority's word is not given anew.
  if (absl::Status ours = CheckGivenBy(old->certificate.get(), own); !ours.ok())
    return InFile(file->issued.path() / file->name, ours);
  if (absl::Status holds = CheckHolds(old->issued, *revoked); !holds.ok()) return holds;
  const absl::StatusOr<Span> valid = LifeFromNow(valid_for, own);
  if (!valid.ok()) return valid.status();
  const absl::StatusOr<Certificate> certificate = NewCertificate(*authority, X509_get0_pubkey(old->certificate.get()),
                                                                 old->issued.identity, old->issued.hosts, *valid);
  if (!certificate.ok()) return certificate.status();
  return Keep(file->issued, certificate->get());
}

absl::StatusOr<std::string> Authority::CertificatePemOf(const std::string& serial) const {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<GivenFile> file = FileOfSerial(*folder, serial);
  if (!file.ok()) return file.status();
  const absl::StatusOr<Given> given = ReadGiven(file->issued, file->name);
  if (!given.ok()) return given.status();
  return PemOf(given->certificate.get());
}

absl::StatusOr<std::vector<IssuedCertificate>> Authority::Issued() const {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Certificate> authority = ReadAuthorityCertificate(*folder);
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<Folder> issued = folder->OpenInside(kIssuedFolder);
  if (!issued.ok()) return issued.status();
  const absl::StatusOr<std::vector<std::string>> names = issued->Names();
  if (!names.ok()) return names.status();
  // After the names: of each of them it says whether it was taken back by then.
  const absl::StatusOr<RevocationList> revoked = ReadRevoked(*folder, authority->get());
  if (!revoked.ok()) return revoked.status();

  std::vector<std::pair<TimePoint, IssuedCertificate>> found;
  for (const std::string& name : *names) {
    if (!SerialOfFile(name)) continue;  // one that is being written
    absl::StatusOr<Given> one = ReadGiven(*issued, name);
    if (!one.ok()) return one.status();
    if (const auto entry = revoked->revoked_at.find(one->issued.serial); entry != revoked->revoked_at.end())
      one->issued.revoked_at = entry->second;
    found.emplace_back(one->kept_at, std::move(one->issued));
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::tie(a.second.not_before, a.first, a.second.serial) >
           std::tie(b.second.not_before, b.first, b.second.serial);
  });
  std::vector<IssuedCertificate> newest_first;
  for (auto& [written_at, one] : found) newest_first.push_back(std::move(one));
  return newest_first;
}

absl::Status Authority::Revoke(const std::string& serial) {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Descriptor> turn = folder->Lock();
  if (!turn.ok()) return turn.status();
  const absl::StatusOr<GivenFile> file = FileOfSerial(*folder, serial);
  if (!file.ok()) return file.status();
  const absl::StatusOr<AuthorityKey> authority = ReadAuthority(*folder);
  if (!authority.ok()) return authority.status();
  // A list that cannot be read is not begun anew: what it took back would count again.
  absl::StatusOr<RevocationList> list = ReadRevoked(*folder, authority->certificate.get());
  if (!list.ok()) return list.status();
  if (!list->revoked_at.emplace(*SerialOfFile(file->name), system_clock::now()).second) return absl::OkStatus();
  ++list->number;
  return WriteRevoked(*folder, *authority, *list);
}

absl::StatusOr<std::string> Authority::CertificatePem() const {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Certificate> authority = ReadAuthorityCertificate(*folder);
  if (!authority.ok()) return authority.status();
  return PemOf(authority->get());
}

absl::StatusOr<std::string> Authority::RevokedPem() const {
  const OwnErrors errors;
  const absl::StatusOr<Folder> folder = OpenFolder(folder_);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<Certificate> authority = ReadAuthorityCertificate(*folder);
  if (!authority.ok()) return authority.status();
  std::string pem;
  if (const auto list = ReadRevoked(*folder, authority->get(), &pem); !list.ok()) return list.status();
  return pem;
}

}  // namespace sixpoint::identity
