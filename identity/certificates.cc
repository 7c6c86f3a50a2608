#include "identity/certificates.h"

#include <arpa/inet.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <utility>

namespace sixpoint::identity {
namespace {

constexpr std::size_t kLongestHost = 253, kLongestLabel = 63;
constexpr long kVersion3 = 2;

struct OneExtension {
  int nid;
  const char* value;
};

using GeneralName = std::unique_ptr<GENERAL_NAME, FreedBy<GENERAL_NAME_free>>;

bool IsLabel(std::string_view label) {
  const auto allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  };
  return !label.empty() && label.size() <= kLongestLabel && label.front() != '-' && label.back() != '-' &&
         std::all_of(label.begin(), label.end(), allowed);
}

// Four or sixteen bytes; empty of what is no address.
std::string AddressOf(const std::string& host) {
  unsigned char bytes[sizeof(in6_addr)];
  std::size_t size = 0;
  if (inet_pton(AF_INET, host.c_str(), bytes) == 1) size = sizeof(in_addr);
  if (inet_pton(AF_INET6, host.c_str(), bytes) == 1) size = sizeof(in6_addr);
  return std::string(reinterpret_cast<const char*>(bytes), size);
}

std::string AddressText(std::string_view bytes) {
  char text[INET6_ADDRSTRLEN] = "";
  if (bytes.size() == sizeof(in_addr)) inet_ntop(AF_INET, bytes.data(), text, sizeof text);
  if (bytes.size() == sizeof(in6_addr)) inet_ntop(AF_INET6, bytes.data(), text, sizeof text);
  return text;
}

std::string BytesOf(const ASN1_STRING* text) {
  return std::string(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
                     static_cast<std::size_t>(ASN1_STRING_length(text)));
}

bool AddName(GENERAL_NAMES* names, int kind, const std::string& bytes) {
  ASN1_STRING* value = ASN1_STRING_type_new(kind == GEN_IPADD ? V_ASN1_OCTET_STRING : V_ASN1_IA5STRING);
  GeneralName name(GENERAL_NAME_new());
  if (value == nullptr || name == nullptr ||
      ASN1_STRING_set(value, bytes.data(), static_cast<int>(bytes.size())) != 1) {
    ASN1_STRING_free(value);
    return false;
  }
  GENERAL_NAME_set0_value(name.get(), kind, value);
  if (sk_GENERAL_NAME_push(names, name.get()) <= 0) return false;
  name.release();  // the names' own now
  return true;
}

// Not as a configuration's text, in which a comma would begin another name.
absl::Status AddAlternativeNames(X509* certificate, const AlternativeNames& alternative) {
  const Names names(GENERAL_NAMES_new());
  bool added = names != nullptr;
  for (const std::string& uri : alternative.uris) added = added && AddName(names.get(), GEN_URI, uri);
  for (const std::string& host : alternative.hosts) {
    const std::string address = AddressOf(host);
    added = added && (address.empty() ? AddName(names.get(), GEN_DNS, host) : AddName(names.get(), GEN_IPADD, address));
  }
  if (added && X509_add1_ext_i2d(certificate, NID_subject_alt_name, names.get(), 0, X509V3_ADD_DEFAULT) == 1)
    return absl::OkStatus();
  return OpenSslError("alternative names");
}

absl::Status AddExtensions(X509* certificate, X509* issuer, std::initializer_list<OneExtension> extensions) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509V3_set_ctx_nodb(&context);
  for (const auto& [nid, value] : extensions) {
    const Extension extension(X509V3_EXT_nconf_nid(nullptr, &context, nid, value));
    if (extension == nullptr || X509_add_ext(certificate, extension.get(), -1) != 1)
      return OpenSslError(OBJ_nid2sn(nid));
  }
  return absl::OkStatus();
}

bool AddText(X509_NAME* name, const char* field, const std::string& text) {
  return X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(text.data()),
                                    static_cast<int>(text.size()), -1, 0) == 1;
}

// Serial, times and key; who it names and by whom is the caller's.
absl::StatusOr<Certificate> Begun(EVP_PKEY* key, const Span& valid) {
  Certificate certificate(X509_new());
  const absl::StatusOr<Integer> serial = NewSerial();
  const absl::StatusOr<Time> not_before = TimeOf(valid.not_before), not_after = TimeOf(valid.not_after);
  for (const absl::Status& status : {serial.status(), not_before.status(), not_after.status()})
    if (!status.ok()) return status;
  if (certificate == nullptr || X509_set_version(certificate.get(), kVersion3) != 1 ||
      X509_set_serialNumber(certificate.get(), serial->get()) != 1 ||
      X509_set1_notBefore(certificate.get(), not_before->get()) != 1 ||
      X509_set1_notAfter(certificate.get(), not_after->get()) != 1 || X509_set_pubkey(certificate.get(), key) != 1)
    return OpenSslError("a certificate");
  return certificate;
}

// Of SubjectPublicKeyInfo, as `openssl pkey -pubin -outform DER` writes it.
absl::StatusOr<std::string> PublicKeySha256Of(const X509* certificate) {
  unsigned char* bytes = nullptr;
  const int size = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(certificate), &bytes);
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned digest_bytes = 0;
  const bool done =
      size > 0 && EVP_Digest(bytes, static_cast<std::size_t>(size), digest, &digest_bytes, EVP_sha256(), nullptr) == 1;
  OPENSSL_free(bytes);
  if (!done) return OpenSslError("a public key's digest");
  return HexOf(std::string_view(reinterpret_cast<const char*>(digest), digest_bytes));
}

absl::StatusOr<Certificate> Signed(Certificate certificate, EVP_PKEY* key) {
  if (X509_sign(certificate.get(), key, EVP_sha256()) <= 0) return OpenSslError("a certificate's signature");
  return certificate;
}

}  // namespace

absl::StatusOr<Certificate> NewAuthorityCertificate(EVP_PKEY* key, const std::string& plant, const Span& valid) {
  absl::StatusOr<Certificate> certificate = Begun(key, valid);
  if (!certificate.ok()) return certificate;
  X509* const made = certificate->get();
  X509_NAME* const subject = X509_get_subject_name(made);
  // The plant alone in the common name, which holds no more than 64 characters.
  if (!AddText(subject, "O", "Sixpoint plant") || !AddText(subject, "CN", plant) ||
      X509_set_issuer_name(made, subject) != 1)
    return OpenSslError("the authority's name");
  if (absl::Status added = AddExtensions(made, made,
                                         {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
                                          {NID_key_usage, "critical,keyCertSign,cRLSign"},
                                          {NID_subject_key_identifier, "hash"}});
      !added.ok())
    return added;
  return Signed(*std::move(certificate), key);
}

absl::StatusOr<Certificate> NewCertificate(const AuthorityKey& authority, EVP_PKEY* key, const Identity& identity,
                                           const std::vector<std::string>& hosts, const Span& valid) {
  absl::StatusOr<Certificate> certificate = Begun(key, valid);
  if (!certificate.ok()) return certificate;
  X509* const made = certificate->get();
  X509* const issuer = authority.certificate.get();
  const std::string text = identity.Text();
  // For people who list certificates. What counts are the alternative names.
  X509_NAME* const subject = X509_get_subject_name(made);
  if (!AddText(subject, "OU", text.substr(0, text.find('/'))) || !AddText(subject, "CN", identity.name) ||
      X509_set_issuer_name(made, X509_get_subject_name(issuer)) != 1)
    return OpenSslError("a certificate's names");
  const bool serves = !hosts.empty();  // and calls other services
  if (absl::Status added = AddExtensions(made, issuer,
                                         {{NID_basic_constraints, "critical,CA:FALSE"},
                                          {NID_key_usage, "critical,digitalSignature"},
                                          {NID_ext_key_usage, serves ? "clientAuth,serverAuth" : "clientAuth"},
                                          {NID_subject_key_identifier, "hash"},
                                          {NID_authority_key_identifier, "keyid:always"}});
      !added.ok())
    return added;
  if (absl::Status added = AddAlternativeNames(made, {UrisOf(identity), hosts}); !added.ok()) return added;
  return Signed(*std::move(certificate), authority.key.get());
}

bool IsHost(const std::string& host) {
  if (host.find('\0') != std::string::npos) return false;  // where inet_pton would stop
  if (!AddressOf(host).empty()) return true;
  if (host.size() > kLongestHost) return false;
  std::string_view rest = host, label;
  for (bool more = true; more;) {
    const std::size_t dot = rest.find('.');
    label = rest.substr(0, dot);
    if (!IsLabel(label)) return false;
    more = dot != std::string_view::npos;
    if (more) rest.remove_prefix(dot + 1);
  }
  // 10.0.0.256 is no name, but an address with a mistake.
  return !std::all_of(label.begin(), label.end(), [](char c) { return c >= '0' && c <= '9'; });
}

absl::Status CheckAuthority(X509* certificate) {
  const bool signs = (X509_get_key_usage(certificate) & (KU_KEY_CERT_SIGN | KU_CRL_SIGN)) ==
                     static_cast<std::uint32_t>(KU_KEY_CERT_SIGN | KU_CRL_SIGN);
  EVP_PKEY* const key = X509_get0_pubkey(certificate);
  if (X509_check_ca(certificate) != 1 || !signs || key == nullptr || X509_verify(certificate, key) != 1)
    return Misread("not an authority's certificate", "one that its own key signed");
  return absl::OkStatus();
}

absl::Status CheckGivenBy(X509* certificate, X509* authority) {
  EVP_PKEY* const key = X509_get0_pubkey(authority);
  if (key == nullptr || X509_check_issued(authority, certificate) != X509_V_OK || X509_verify(certificate, key) != 1)
    return Misread("not signed by the authority", "one that the plant's authority gave");
  return absl::OkStatus();
}

absl::StatusOr<OwnKey> OwnKeyOf(std::string_view identity_pem) {
  absl::StatusOr<Certificate> certificate = CertificateOfPem(identity_pem, /*beside_key=*/true);
  if (!certificate.ok()) return certificate.status();
  absl::StatusOr<Key> key = KeyOfPem(identity_pem, /*beside_certificate=*/true);
  if (!key.ok()) return key.status();
  if (X509_check_private_key(certificate->get(), key->get()) != 1)
    return Misread("a certificate of another key", "that of the key beside it");
  return OwnKey{*std::move(key), *std::move(certificate)};
}

std::string PlantOf(X509* authority) {
  X509_NAME* const name = X509_get_subject_name(authority);
  const int at = X509_NAME_get_index_by_NID(name, NID_commonName, -1);
  if (at < 0) return "";
  unsigned char* text = nullptr;
  const int size = ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at)));
  if (size < 0) return "";
  std::string plant(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
  OPENSSL_free(text);
  return plant;
}

absl::StatusOr<Span> ValidityOf(const X509* certificate) {
  const absl::StatusOr<TimePoint> not_before = TimePointOf(X509_get0_notBefore(certificate));
  if (!not_before.ok()) return not_before.status();
  const absl::StatusOr<TimePoint> not_after = TimePointOf(X509_get0_notAfter(certificate));
  if (!not_after.ok()) return not_after.status();
  return Span{*not_before, *not_after};
}

absl::StatusOr<std::string> SerialOf(const X509* certificate) { return HexOf(X509_get0_serialNumber(certificate)); }

absl::StatusOr<AlternativeNames> AlternativeNamesOf(const X509* certificate) {
  constexpr int kAbsent = -1;
  int critical = 0;
  const Names names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, &critical, nullptr)));
  if (names == nullptr && critical == kAbsent) return AlternativeNames();
  if (names == nullptr) return Misread("alternative names that cannot be read", "URIs, DNS names and addresses");
  AlternativeNames found;
  for (int i = 0; i < sk_GENERAL_NAME_num(names.get()); ++i) {
    int kind = 0;
    const void* const value = GENERAL_NAME_get0_value(sk_GENERAL_NAME_value(names.get(), i), &kind);
    if (kind != GEN_URI && kind != GEN_DNS && kind != GEN_IPADD) continue;
    const std::string bytes = BytesOf(static_cast<const ASN1_STRING*>(value));
    if (kind == GEN_URI) found.uris.push_back(bytes);
    if (kind == GEN_DNS) found.hosts.push_back(bytes);
    if (kind == GEN_IPADD) found.hosts.push_back(AddressText(bytes));
  }
  return found;
}

absl::StatusOr<IssuedCertificate> IssuedOf(const X509* certificate) {
  absl::StatusOr<std::string> serial = SerialOf(certificate), public_key = PublicKeySha256Of(certificate);
  const absl::StatusOr<Span> valid = ValidityOf(certificate);
  absl::StatusOr<AlternativeNames> names = AlternativeNamesOf(certificate);
  for (const absl::Status& status : {serial.status(), public_key.status(), valid.status(), names.status()})
    if (!status.ok()) return status;
  absl::StatusOr<Identity> identity = IdentityOfUris(names->uris);
  if (!identity.ok()) return identity.status();
  return IssuedCertificate{*std::move(serial), *std::move(identity), std::move(names->hosts), valid->not_before,
                           valid->not_after,   std::nullopt,         *std::move(public_key)};
}

}  // namespace sixpoint::identity
