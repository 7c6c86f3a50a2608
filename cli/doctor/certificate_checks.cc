#include "cli/certificate_text.h"
#include "cli/doctor/checks.h"
#include "cli/output.h"

namespace sixpoint::cli::doctor {
namespace {

constexpr char kRenew[] = "sixpoint certs renew";

// Of one that is ours to read, beside its key.
Finding FindingOf(const CertificateFile& file, Time now) {
  const std::string name = "certificate: " + file.whose;
  const std::string renew =
      file.whose == "you" ? "sixpoint certs renew, or have one made: sixpoint certs issue" : kRenew;
  if (!file.why_not.empty()) return {name, Grade::kWrong, file.path + ": " + file.why_not, renew};
  // What runs goes on without: services need the authority's certificate alone.
  if (file.is_missing)
    return {name, Grade::kWarning,
            file.path + ": not there, so that `sixpoint up` refuses and no certificate can be made or taken back",
            "put it back from where it is kept; where it is lost, everybody's certificates have to be made anew"};
  if (file.others_read)
    return {name, Grade::kWrong, file.path + ": others than its owner may read the private key",
            "chmod 600 " + file.path + ", and a new key, for this one may be known: " +
                (file.whose == "you" ? "sixpoint certs issue" : "sixpoint certs renew --all")};
  if (file.is_other_authoritys)
    return {name, Grade::kWrong, file.path + ": of another authority than the plant's", renew};
  if (file.is_authority) return {name, Grade::kOk, "its key is its owner's alone", ""};
  if (!file.certificate) return {name, Grade::kUnknown, file.path + ": not looked at", ""};
  const std::string until = "until " + TimeText(file.certificate->not_after);
  switch (StateOf(*file.certificate, now)) {
    case CertificateState::kExpired:
      return {name, Grade::kWrong, "has expired: it held " + until, renew};
    case CertificateState::kRevoked:
      return {name, Grade::kWrong, "was taken back", renew};
    case CertificateState::kExpiresSoon:
      if (file.standing.empty()) return {name, Grade::kWarning, "expires soon: it holds " + until, renew};
      break;
    case CertificateState::kValid:
      break;
  }
  if (!file.standing.empty()) return {name, Grade::kWrong, file.standing, renew};
  return {name, Grade::kOk, file.certificate->identity.Text() + ", holds " + until, ""};
}

}  // namespace

void JudgeCertificates(const Facts& facts, Findings* findings) {
  if (!facts.revocation_why_not.empty())
    findings->push_back(
        {"revocation list", Grade::kWrong, facts.revocation_why_not + ": services believe nobody", kRenew});
  for (const CertificateFile& file : facts.certificates) findings->push_back(FindingOf(file, facts.now));
  // What a port shows counts for clients, whatever lies in the folder.
  for (const Service& service : facts.services) {
    if (!service.shown) continue;
    const CertificateState state = StateOf(*service.shown, facts.now);
    if (state == CertificateState::kValid) continue;
    findings->push_back({"certificate shown: " + service.area,
                         state == CertificateState::kExpired ? Grade::kWrong : Grade::kWarning,
                         StateText(*service.shown) + ", until " + TimeText(service.shown->not_after),
                         facts.is_local ? kRenew : "on the plant's computer: sixpoint certs renew"});
  }
}

}  // namespace sixpoint::cli::doctor
