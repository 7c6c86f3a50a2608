#include <sys/stat.h>

#include "cli/doctor/gather.h"
#include "cli/plant_certificates.h"
#include "cli/plant_folder.h"
#include "cli/service_user.h"
#include "identity/trust.h"
#include "refusal/message_text.h"

namespace sixpoint::cli::doctor {
namespace {

namespace fs = std::filesystem;

std::string Sentence(const absl::Status& status) { return Tame(std::string(status.message()), 300); }

// The certificate without the key beside it: what is shown to others.
std::string CertificatePart(const std::string& identity_pem) {
  const std::string begin = "-----BEGIN CERTIFICATE-----", end = "-----END CERTIFICATE-----";
  const std::size_t from = identity_pem.find(begin), to = identity_pem.find(end);
  return from == std::string::npos || to == std::string::npos || to < from
             ? ""
             : identity_pem.substr(from, to + end.size() - from) + "\n";
}

CertificateFile FileIn(const std::string& whose, const fs::path& folder, uid_t owner,
                       const std::string& plants_authority, identity::Trust* trust) {
  CertificateFile file;
  file.whose = whose;
  const fs::path path = folder / identity::kIdentityFile;
  file.path = path.string();
  const absl::StatusOr<std::string> own = ReadFileOf(owner, path),
                                    authority = ReadFileOf(owner, folder / identity::kAuthorityFile);
  for (const absl::Status& status : {own.status(), authority.status()})
    if (!status.ok() && file.why_not.empty()) file.why_not = Sentence(status);
  if (!file.why_not.empty()) return file;
  struct stat found {};
  file.others_read = lstat(path.c_str(), &found) == 0 && (found.st_mode & 077) != 0;
  file.is_other_authoritys = !plants_authority.empty() && *authority != plants_authority;
  absl::StatusOr<identity::IssuedCertificate> checked = identity::CheckBelongTogether({*own, *authority});
  if (!checked.ok()) {
    file.why_not = Sentence(checked.status());
    return file;
  }
  const std::string wanted = "services/" + whose;
  if (whose != "you" && checked->identity.Text() != wanted)
    file.why_not = "of " + checked->identity.Text() + ", want one of " + wanted;
  file.certificate = *std::move(checked);
  const identity::Judgement judged = trust->Judge(CertificatePart(*own));
  if (judged.standing != identity::Standing::kGood && judged.standing != identity::Standing::kUndecidable)
    file.standing = Tame(judged.why_not, 300);
  if (judged.standing == identity::Standing::kRevoked) file.certificate->revoked_at = std::chrono::system_clock::now();
  return file;
}

}  // namespace

std::vector<CertificateFile> GatherCertificates(const LocalPlant& plant, std::string* revocation_why_not) {
  std::vector<CertificateFile> files;
  const fs::path authority_file = plant.certificates() / identity::kAuthorityFile;
  identity::Trust trust(authority_file, plant.revoked());
  if (const absl::Status read = trust.CheckFiles(); !read.ok()) *revocation_why_not = Sentence(read);
  const absl::StatusOr<std::string> plants = ReadFileOf(geteuid(), authority_file);
  const std::string plants_authority = plants.ok() ? *plants : "";

  CertificateFile authority;
  authority.is_authority = true;
  authority.whose = "authority";
  authority.path = (plant.authority() / "key.pem").string();
  if (plants.ok()) {
    const absl::Status opened = OpenAuthority(plant.authority()).status();
    struct stat key {};
    if (lstat(authority.path.c_str(), &key) == 0) {
      authority.others_read = (key.st_mode & 077) != 0;
      if (!opened.ok() && !authority.others_read) authority.why_not = Sentence(opened);
    } else {
      authority.is_missing = true;
    }
    files.push_back(authority);
  }
  for (const std::string& area : plant.Served())
    files.push_back(FileIn(area, plant.certificates_of(area), FindServiceUser().uid, plants_authority, &trust));
  files.push_back(FileIn("you", LocalIdentityIn(plant.data), geteuid(), plants_authority, &trust));
  return files;
}

}  // namespace sixpoint::cli::doctor
