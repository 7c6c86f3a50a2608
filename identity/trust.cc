#include "identity/trust.h"

#include <openssl/x509_vfy.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "identity/certificates.h"
#include "identity/files.h"
#include "identity/revocation_list.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {

// Named, for Trust::State has them.

// What is wrong with one of the files, and what is wanted of it.
struct Trouble {
  std::filesystem::path file;
  std::string what, wanted;
};

// An authority that was read. Never changed, for several threads verify with it.
struct KnownAuthority {
  Certificate certificate;
  Span valid;
  std::string plant;
  std::unique_ptr<X509_STORE, FreedBy<X509_STORE_free>> store;
};

// What no time changes of a certificate: whose it is, and whether the authority gave it; kGood where it did.
struct Finding {
  Judgement judgement;
  Span valid;
};

namespace {

namespace fs = std::filesystem;

using Verification = std::unique_ptr<X509_STORE_CTX, FreedBy<X509_STORE_CTX_free>>;

constexpr std::size_t kMostFindings = 1024;

std::string Sentence(const std::string& field, const std::string& value, const std::string& wanted) {
  return std::string(Refuse(field, value, wanted).message());
}

absl::StatusOr<std::shared_ptr<const KnownAuthority>> KnownAuthorityOf(std::string_view pem) {
  auto known = std::make_shared<KnownAuthority>();
  absl::StatusOr<Certificate> certificate = CertificateOfPem(pem);
  if (!certificate.ok()) return certificate.status();
  known->certificate = *std::move(certificate);
  X509* const authority = known->certificate.get();
  if (absl::Status right = CheckAuthority(authority); !right.ok()) return right;
  const absl::StatusOr<Span> valid = ValidityOf(authority);
  if (!valid.ok()) return valid.status();
  known->valid = *valid;
  known->plant = PlantOf(authority);
  known->store.reset(X509_STORE_new());
  X509_STORE* const store = known->store.get();
  // The authority itself signs every certificate: nobody between. Of time and revocation Trust says more than OpenSSL.
  if (store == nullptr || X509_STORE_add_cert(store, authority) != 1 || X509_STORE_set_depth(store, 0) != 1 ||
      X509_STORE_set_purpose(store, X509_PURPOSE_SSL_CLIENT) != 1 ||
      X509_STORE_set_flags(store, X509_V_FLAG_NO_CHECK_TIME | X509_V_FLAG_X509_STRICT) != 1)
    return OpenSslError("the authority's store");
  return known;
}

Finding Unreadable(const std::string& value, const std::string& wanted) {
  Finding finding;
  finding.judgement.why_not = Sentence("certificate", value, wanted);
  return finding;
}

// `error`: of OpenSSL's verification.
Finding NotOurs(int error, const std::string& plant) {
  Finding finding;
  finding.judgement.standing = Standing::kNotOurs;
  finding.judgement.why_not =
      error == X509_V_ERR_INVALID_PURPOSE
          ? Sentence("certificate", "given for something else", "one to call a service with")
          : Sentence("certificate", "of another authority", "one that the authority of the plant " + plant + " gave");
  return finding;
}

Finding FindingOf(std::string_view pem, const KnownAuthority& authority) {
  constexpr char kWanted[] = "one certificate in PEM, of the plant's authority";
  const absl::StatusOr<Certificate> certificate = CertificateOfPem(pem);
  if (!certificate.ok()) return Unreadable("not one that can be read", kWanted);
  const Verification verification(X509_STORE_CTX_new());
  if (verification == nullptr ||
      X509_STORE_CTX_init(verification.get(), authority.store.get(), certificate->get(), nullptr) != 1)
    return Unreadable("no memory to read it", kWanted);
  if (X509_verify_cert(verification.get()) != 1)
    return NotOurs(X509_STORE_CTX_get_error(verification.get()), authority.plant);

  const absl::StatusOr<AlternativeNames> names = AlternativeNamesOf(certificate->get());
  const absl::StatusOr<Span> valid = ValidityOf(certificate->get());
  absl::StatusOr<std::string> serial = SerialOf(certificate->get());
  if (!names.ok() || !valid.ok() || !serial.ok()) return Unreadable("not one that can be read", kWanted);
  absl::StatusOr<Identity> identity = IdentityOfUris(names->uris);
  if (!identity.ok()) {
    const Violation why = ViolationsOf(identity.status()).at(0);
    return Unreadable("with " + why.field + " " + why.value, "one that names one machine, user or service");
  }
  Finding finding;
  finding.judgement = {Standing::kGood, *std::move(identity), *std::move(serial), ""};
  finding.valid = {std::max(valid->not_before, authority.valid.not_before),
                   std::min(valid->not_after, authority.valid.not_after)};
  return finding;
}

}  // namespace

struct Trust::State {
  State(fs::path its_authority_file, fs::path its_revoked_file, std::function<TimePoint()> its_now)
      : authority_file(std::move(its_authority_file)),
        revoked_file(std::move(its_revoked_file)),
        now(std::move(its_now)) {}

  const fs::path authority_file, revoked_file;
  const std::function<TimePoint()> now;

  std::mutex mutex;  // over all that follows
  // Of the files as they were read; none: they are to be read.
  std::optional<FileMark> authority_mark, revoked_mark;
  std::shared_ptr<const KnownAuthority> authority;
  std::shared_ptr<const RevocationList> revoked;
  std::optional<Trouble> trouble;
  // The newest list's number, and whose lists it counts: an older one would make good what was taken back.
  std::uint64_t newest = 0;
  std::shared_ptr<const KnownAuthority> counted;
  std::map<std::string, Finding, std::less<>> findings;

  void Refresh();
  void ReadAuthority();
  void ReadRevoked();
  void Fail(const fs::path& file, const absl::Status& why) {
    const std::vector<Violation> violations = ViolationsOf(why);
    trouble = Trouble{file, violations.empty() ? "cannot be read" : violations[0].value,
                      violations.empty() ? "a file that can be read" : violations[0].wanted};
  }
  std::optional<Finding> Known(std::string_view pem) {
    const auto known = findings.find(pem);
    return known == findings.end() ? std::nullopt : std::optional<Finding>(known->second);
  }
};

void Trust::State::Refresh() {
  const std::optional<FileMark> authority_now = MarkOf(authority_file), revoked_now = MarkOf(revoked_file);
  if (!authority_now || !(authority_mark == authority_now)) {
    ReadAuthority();
    revoked_mark.reset();  // whose list it should be has changed
  }
  if (authority != nullptr && (!revoked_now || !(revoked_mark == revoked_now))) ReadRevoked();
}

void Trust::State::ReadAuthority() {
  authority.reset();
  revoked.reset();
  findings.clear();
  const absl::StatusOr<std::string> pem = ReadFile(authority_file, kMostCertificate_bytes, &authority_mark);
  if (!pem.ok()) return Fail(authority_file, pem.status());
  absl::StatusOr<std::shared_ptr<const KnownAuthority>> read = KnownAuthorityOf(*pem);
  if (!read.ok()) return Fail(authority_file, read.status());
  authority = *std::move(read);
  if (counted != nullptr && X509_cmp(counted->certificate.get(), authority->certificate.get()) == 0) return;
  counted = authority;
  newest = 0;
}

void Trust::State::ReadRevoked() {
  revoked.reset();
  const absl::StatusOr<std::string> pem = ReadFile(revoked_file, kMostRevoked_bytes, &revoked_mark);
  if (!pem.ok()) return Fail(revoked_file, pem.status());
  absl::StatusOr<RevocationList> list = RevocationListOf(*pem, authority->certificate.get());
  if (!list.ok()) return Fail(revoked_file, list.status());
  if (list->number < newest)
    return Fail(revoked_file, Misread("number " + std::to_string(list->number) + ", older than what stood there before",
                                      "number " + std::to_string(newest) + " or later, or a restart"));
  newest = list->number;
  revoked = std::make_shared<const RevocationList>(*std::move(list));
  trouble.reset();
}

Trust::Trust(fs::path authority_file, fs::path revoked_file, std::function<TimePoint()> now)
    : state_(std::make_unique<State>(std::move(authority_file), std::move(revoked_file), std::move(now))) {}

Trust::~Trust() = default;

absl::Status Trust::CheckFiles() {
  const OwnErrors errors;
  const std::lock_guard<std::mutex> lock(state_->mutex);
  state_->Refresh();
  if (state_->revoked != nullptr) return absl::OkStatus();
  const Trouble& trouble = *state_->trouble;
  return Refuse(trouble.file.string(), trouble.what, trouble.wanted);
}

Judgement Trust::Judge(std::string_view pem) {
  const OwnErrors errors;
  std::shared_ptr<const KnownAuthority> authority;
  std::shared_ptr<const RevocationList> revoked;
  std::optional<Finding> finding;
  {
    const std::lock_guard<std::mutex> lock(state_->mutex);
    state_->Refresh();
    if (state_->revoked == nullptr) {
      // Not where the file lies: who asks may be anybody.
      const Trouble& trouble = *state_->trouble;
      return {Standing::kUndecidable, {}, "", Sentence(trouble.file.filename().string(), trouble.what, trouble.wanted)};
    }
    authority = state_->authority;
    revoked = state_->revoked;
    if (pem.empty()) return Unreadable("", "one of the plant's authority").judgement;
    if (pem.size() > kMostCertificate_bytes) return Unreadable("longer", "at most 16 KiB of PEM").judgement;
    finding = state_->Known(pem);
  }
  if (!finding) {
    finding = FindingOf(pem, *authority);
    // Others' are not kept: who shows many of them would push out the plant's.
    if (finding->judgement.standing != Standing::kGood) return finding->judgement;
    const std::lock_guard<std::mutex> lock(state_->mutex);
    if (state_->findings.size() >= kMostFindings) state_->findings.clear();
    if (state_->authority == authority) state_->findings.emplace(pem, *finding);
  }
  Judgement& judgement = finding->judgement;
  const auto because = [&judgement](Standing standing, const std::string& what, const std::string& wanted) {
    judgement.standing = standing;
    judgement.why_not = Sentence("certificate", "of " + judgement.identity.Text() + ", " + what, wanted);
    return judgement;
  };
  if (const auto entry = revoked->revoked_at.find(judgement.serial); entry != revoked->revoked_at.end())
    return because(Standing::kRevoked, "taken back " + TimeText(entry->second), "one that was not");
  const TimePoint now = state_->now();
  if (now < finding->valid.not_before)
    return because(Standing::kNotYetValid, "from " + TimeText(finding->valid.not_before) + " on",
                   "one that is valid now, " + TimeText(now) + " by this clock");
  if (now > finding->valid.not_after)
    return because(Standing::kExpired, "expired " + TimeText(finding->valid.not_after), "one that is valid now");
  return judgement;
}

}  // namespace sixpoint::identity
