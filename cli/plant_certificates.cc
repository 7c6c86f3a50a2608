#include "cli/plant_certificates.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <set>

#include "cli/document.h"
#include "cli/plant_folder.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using identity::Authority;
using identity::CertificateWish;
using identity::Credentials;
using identity::IssuedCertificate;
using identity::Kind;
using identity::Role;

// The longest that an authority gives. A service cannot ask for its own: its authority's key is kept out of its reach, so that who
// breaks into a service cannot make identities. So it must last from one `sixpoint up` or `sixpoint certs renew` to another.
constexpr std::chrono::hours kValidFor{24 * 397};
constexpr std::chrono::seconds kLockPatience{10};
constexpr std::size_t kLongestCommonName = 64;

// Whose a folder below certificates/ is.
struct Holder {
  CertificateWish wish;
  fs::path folder;
  bool is_service = false;
};

// A login may hold what an identity's name may not.
std::string LocalName() {
  std::string name = UserName(geteuid()).substr(0, kLongestCommonName);
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && std::strchr("._-", c) == nullptr) c = '-';
  if (name.empty() || name[0] == '.') name.insert(name.begin(), '-');
  return name.substr(0, kLongestCommonName);
}

std::vector<Holder> HoldersOf(const LocalPlant& plant) {
  std::vector<Holder> holders;
  for (const std::string& name : plant.Served())
    holders.push_back({{{Kind::kService, name, {name == kGateway ? Role::kGateway : Role::kService}},
                        ServiceHosts(plant.address),
                        kValidFor},
                       plant.certificates_of(name),
                       /*is_service=*/true});
  holders.push_back({{{Kind::kUser, LocalName(), {Role::kEngineer, Role::kQuality, Role::kAdmin}}, {}, kValidFor},
                     LocalIdentityIn(plant.data),
                     /*is_service=*/false});
  return holders;
}

// What lies in a service's folder may be anything, so that only a file of the service's own is looked into.
absl::StatusOr<IssuedCertificate> CertificateIn(const fs::path& folder, uid_t owner) {
  const absl::StatusOr<Descriptor> file = OpenFileOf(owner, folder / identity::kIdentityFile);
  if (!file.ok()) return file.status();
  return identity::ReadCertificate("/proc/self/fd/" + std::to_string(file->number()));
}

bool IsDue(const IssuedCertificate& has, const CertificateWish& wish,
           const std::map<std::string, IssuedCertificate>& issued) {
  const auto set = [](const std::vector<std::string>& hosts) { return std::set(hosts.begin(), hosts.end()); };
  const auto given = issued.find(has.serial);
  const auto left = has.not_after - std::chrono::system_clock::now();
  return given == issued.end() || given->second.revoked_at.has_value() || has.identity.Text() != wish.identity.Text() ||
         has.identity.roles != wish.identity.roles || set(has.hosts) != set(wish.hosts) ||
         left < (has.not_after - has.not_before) / 3;
}

// Written where only its maker reaches and then put into place: in the service's own folder root follows nothing and creates nothing.
absl::Status GiveToServiceUser(const fs::path& folder, const Credentials& credentials, const ServiceUser& user) {
  const fs::path beside = folder.string() + ".part";
  if (absl::Status status = identity::WriteCredentials(beside, credentials); !status.ok()) return status;
  for (const char* name : {identity::kAuthorityFile, identity::kIdentityFile}) {
    const fs::path file = beside / name;
    if (lchown(file.c_str(), user.uid, user.gid) != 0 || rename(file.c_str(), (folder / name).c_str()) != 0)
      return absl::PermissionDeniedError((folder / name).string() + ": " + std::strerror(errno));
  }
  std::error_code ignored;
  fs::remove(beside, ignored);
  return absl::OkStatus();
}

// For everybody to read, whatever the umask of who runs this.
absl::Status Publish(const Authority& authority, const fs::path& certificates) {
  const absl::StatusOr<std::string> pem = authority.CertificatePem(), revoked = authority.RevokedPem();
  if (!pem.ok()) return pem.status();
  if (!revoked.ok()) return revoked.status();
  const mode_t before = umask(022);
  absl::Status status = WriteFile((certificates / identity::kAuthorityFile).string(), *pem);
  if (status.ok()) status = WriteFile((certificates / kRevokedFile).string(), *revoked);
  umask(before);
  return status;
}

absl::StatusOr<std::map<std::string, IssuedCertificate>> IssuedBySerial(const Authority& authority) {
  absl::StatusOr<std::vector<IssuedCertificate>> all = authority.Issued();
  if (!all.ok()) return all.status();
  std::map<std::string, IssuedCertificate> by_serial;
  for (IssuedCertificate& one : *all) by_serial.emplace(one.serial, std::move(one));
  return by_serial;
}

}  // namespace

std::string HostName() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "";
  return name.data();
}

std::vector<std::string> ServiceHosts(const ListenAddress& address) {
  std::vector<std::string> hosts = {"localhost", "127.0.0.1", "::1"};
  for (const std::string& host : {HostName(), address.listen, address.announce})
    if (IsHost(host) && !IsEveryAddress(host) && std::find(hosts.begin(), hosts.end(), host) == hosts.end())
      hosts.push_back(host);
  return hosts;
}

absl::StatusOr<Authority> OpenAuthority(const fs::path& folder) {
  absl::StatusOr<Authority> authority = Authority::Open(folder);
  if (!absl::IsNotFound(authority.status())) return authority;
  return absl::NotFoundError("authority: none in " + folder.string() +
                             ", want one that `sixpoint up` or `sixpoint certs init` made");
}

absl::Status MakeAuthority(const LocalPlant& plant, const ServiceUser& user) {
  // A new one would shut out everybody whom the old one let in.
  const fs::path told = plant.certificates() / identity::kAuthorityFile;
  std::error_code unreadable;
  if (fs::exists(told, unreadable) && !fs::exists(plant.authority() / "key.pem", unreadable))
    return runtime::Refuse("--data", plant.authority().string() + " (no key.pem)",
                           "the authority that " + told.string() +
                               " is of, restored; or that file gone too, and everybody's "
                               "certificates made anew");
  if (absl::Status status = MakeOwnFolder(plant.authority(), 0700); !status.ok()) return status;
  if (absl::Status status = MakeOwnFolder(plant.certificates(), 0755); !status.ok()) return status;
  for (const std::string& name : plant.Served())
    if (absl::Status status = MakeServiceFolder(plant.certificates_of(name), user); !status.ok()) return status;
  if (absl::Status status = MakeOwnFolder(LocalIdentityIn(plant.data), 0700); !status.ok()) return status;
  const std::string host = HostName().substr(0, kLongestCommonName);
  const absl::Status made = Authority::Create(plant.authority(), host.empty() ? "sixpoint" : host);
  if (!made.ok() && !absl::IsAlreadyExists(made)) return made;
  const absl::StatusOr<Authority> authority = OpenAuthority(plant.authority());
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<DataFolderLock> lock = DataFolderLock::Take(plant.authority(), kLockPatience);
  if (!lock.ok()) return lock.status();
  return Publish(*authority, plant.certificates());
}

absl::StatusOr<std::vector<Renewed>> RenewCertificates(const LocalPlant& plant, const ServiceUser& user,
                                                       Renewal which) {
  absl::StatusOr<Authority> authority = OpenAuthority(plant.authority());
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<DataFolderLock> lock = DataFolderLock::Take(plant.authority(), kLockPatience);
  if (!lock.ok()) return lock.status();
  const auto issued = IssuedBySerial(*authority);
  if (!issued.ok()) return issued.status();
  const absl::StatusOr<std::string> authority_pem = authority->CertificatePem();
  if (!authority_pem.ok()) return authority_pem.status();
  std::vector<Renewed> renewed;
  for (const Holder& holder : HoldersOf(plant)) {
    const uid_t owner = holder.is_service ? user.uid : geteuid();
    absl::StatusOr<IssuedCertificate> has = CertificateIn(holder.folder, owner);
    const absl::StatusOr<std::string> has_authority = ReadFileOf(owner, holder.folder / identity::kAuthorityFile);
    const absl::StatusOr<std::string> has_pem = ReadFileOf(owner, holder.folder / identity::kIdentityFile);
    const bool belong_together =
        has_pem.ok() && has_authority.ok() && identity::CheckBelongTogether({*has_pem, *has_authority}).ok();
    const bool is_due = !belong_together || which == Renewal::kAll || !has.ok() || IsDue(*has, holder.wish, *issued) ||
                        !has_authority.ok() || *has_authority != *authority_pem;
    if (is_due) {
      const absl::StatusOr<Credentials> credentials = authority->Issue(holder.wish);
      if (!credentials.ok()) return credentials.status();
      const absl::Status written = holder.is_service ? GiveToServiceUser(holder.folder, *credentials, user)
                                                     : identity::WriteCredentials(holder.folder, *credentials);
      if (!written.ok()) return written;
      has = CertificateIn(holder.folder, owner);
      if (!has.ok()) return has.status();
    }
    renewed.push_back({*std::move(has), is_due});
  }
  if (absl::Status status = Publish(*authority, plant.certificates()); !status.ok()) return status;
  return renewed;
}

std::vector<std::optional<IssuedCertificate>> ServiceCertificates(const LocalPlant& plant, const ServiceUser& user) {
  std::map<std::string, IssuedCertificate> issued;
  if (const auto authority = Authority::Open(plant.authority()); authority.ok())
    issued = IssuedBySerial(*authority).value_or(issued);
  std::vector<std::optional<IssuedCertificate>> certificates;
  for (const std::string& name : plant.Served()) {
    const absl::StatusOr<IssuedCertificate> has = CertificateIn(plant.certificates_of(name), user.uid);
    certificates.push_back(has.ok() ? std::optional(*has) : std::nullopt);
    if (!has.ok()) continue;
    if (const auto given = issued.find(has->serial); given != issued.end())
      certificates.back()->revoked_at = given->second.revoked_at;
  }
  return certificates;
}

absl::StatusOr<bool> RevokeCertificates(const fs::path& folder, const std::vector<std::string>& serials,
                                        const fs::path& data) {
  absl::StatusOr<Authority> authority = OpenAuthority(folder);
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<DataFolderLock> lock = DataFolderLock::Take(folder, kLockPatience);
  if (!lock.ok()) return lock.status();
  for (const std::string& serial : serials)
    if (absl::Status status = authority->Revoke(serial); !status.ok()) return status;
  const absl::StatusOr<std::string> own = authority->CertificatePem();
  if (!own.ok()) return own.status();
  const fs::path certificates = CertificatesIn(data);
  const absl::StatusOr<std::string> plants = ReadFileOf(geteuid(), certificates / identity::kAuthorityFile);
  if (!plants.ok() || *plants != *own) return false;
  if (absl::Status status = Publish(*authority, certificates); !status.ok()) return status;
  return true;
}

}  // namespace sixpoint::cli
