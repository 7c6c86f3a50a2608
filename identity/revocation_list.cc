#include "identity/revocation_list.h"

#include <limits>
#include <memory>
#include <utility>

namespace sixpoint::identity {
namespace {

constexpr long kVersion2 = 1;

using Entry = std::unique_ptr<X509_REVOKED, FreedBy<X509_REVOKED_free>>;
using KeyId = std::unique_ptr<AUTHORITY_KEYID, FreedBy<AUTHORITY_KEYID_free>>;

absl::Status AddEntry(X509_CRL* list, const std::string& serial, TimePoint revoked_at) {
  const absl::StatusOr<Integer> number = NumberOfHex(serial);
  if (!number.ok()) return number.status();
  const absl::StatusOr<Time> time = TimeOf(revoked_at);
  if (!time.ok()) return time.status();
  Entry entry(X509_REVOKED_new());
  if (entry == nullptr || X509_REVOKED_set_serialNumber(entry.get(), number->get()) != 1 ||
      X509_REVOKED_set_revocationDate(entry.get(), time->get()) != 1 || X509_CRL_add0_revoked(list, entry.get()) != 1)
    return OpenSslError("an entry of the revocation list");
  entry.release();  // the list's own now
  return absl::OkStatus();
}

absl::Status AddExtensions(X509_CRL* list, X509* authority, std::uint64_t number) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, authority, nullptr, nullptr, list, 0);
  X509V3_set_ctx_nodb(&context);
  const Extension key_id(X509V3_EXT_nconf_nid(nullptr, &context, NID_authority_key_identifier, "keyid:always"));
  const Integer value(ASN1_INTEGER_new());
  if (key_id == nullptr || X509_CRL_add_ext(list, key_id.get(), -1) != 1 || value == nullptr ||
      ASN1_INTEGER_set_uint64(value.get(), number) != 1 ||
      X509_CRL_add1_ext_i2d(list, NID_crl_number, value.get(), 0, X509V3_ADD_DEFAULT) != 1)
    return OpenSslError("the revocation list's number");
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> NumberOf(const X509_CRL* list) {
  const Integer value(static_cast<ASN1_INTEGER*>(X509_CRL_get_ext_d2i(list, NID_crl_number, nullptr, nullptr)));
  std::uint64_t number = 0;
  if (value == nullptr || ASN1_INTEGER_get_uint64(&number, value.get()) != 1) return Misread("without a number", "one");
  return number;
}

// What is critical changes what a list means (RFC 5280, 5.2): it holds for some certificates only, or adds to another list.
absl::Status CheckNothingCritical(const X509_CRL* list) {
  if (X509_CRL_get_ext_by_critical(list, 1, -1) >= 0) return Misread("of a kind of its own", "a full list");
  return absl::OkStatus();
}

absl::Status ReadEntry(const X509_REVOKED* entry, RevocationList* list) {
  if (X509_REVOKED_get_ext_by_critical(entry, 1, -1) >= 0) return Misread("of a kind of its own", "a full list");
  const absl::StatusOr<std::string> serial = HexOf(X509_REVOKED_get0_serialNumber(entry));
  if (!serial.ok()) return serial.status();
  const absl::StatusOr<TimePoint> time = TimePointOf(X509_REVOKED_get0_revocationDate(entry));
  if (!time.ok()) return time.status();
  list->revoked_at.emplace(*serial, *time);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> RevocationListPem(const AuthorityKey& authority, const RevocationList& list,
                                              TimePoint made_at) {
  const SignedList made(X509_CRL_new());
  X509* const issuer = authority.certificate.get();
  const absl::StatusOr<Time> last_update = TimeOf(made_at);
  if (!last_update.ok()) return last_update.status();
  if (made == nullptr || X509_CRL_set_version(made.get(), kVersion2) != 1 ||
      X509_CRL_set_issuer_name(made.get(), X509_get_subject_name(issuer)) != 1 ||
      X509_CRL_set1_lastUpdate(made.get(), last_update->get()) != 1 ||
      X509_CRL_set1_nextUpdate(made.get(), X509_get0_notAfter(issuer)) != 1)
    return OpenSslError("a revocation list");
  for (const auto& [serial, revoked_at] : list.revoked_at)
    if (absl::Status added = AddEntry(made.get(), serial, revoked_at); !added.ok()) return added;
  if (absl::Status added = AddExtensions(made.get(), issuer, list.number); !added.ok()) return added;
  if (X509_CRL_sort(made.get()) != 1 || X509_CRL_sign(made.get(), authority.key.get(), EVP_sha256()) <= 0)
    return OpenSslError("the revocation list's signature");
  return PemOf(made.get());
}

absl::StatusOr<RevocationList> RevocationListOf(std::string_view pem, X509* authority) {
  const absl::StatusOr<SignedList> read = ListOfPem(pem);
  if (!read.ok()) return read.status();
  X509_CRL* const signed_list = read->get();
  if (X509_NAME_cmp(X509_CRL_get_issuer(signed_list), X509_get_subject_name(authority)) != 0 ||
      X509_CRL_verify(signed_list, X509_get0_pubkey(authority)) != 1)
    return Misread("not signed by the authority", "its own revocation list");
  if (absl::Status plain = CheckNothingCritical(signed_list); !plain.ok()) return plain;
  const absl::StatusOr<std::uint64_t> number = NumberOf(signed_list);
  if (!number.ok()) return number.status();
  RevocationList list;
  list.number = *number;
  STACK_OF(X509_REVOKED)* const entries = X509_CRL_get_REVOKED(signed_list);
  for (int i = 0; i < sk_X509_REVOKED_num(entries); ++i)
    if (absl::Status entry = ReadEntry(sk_X509_REVOKED_value(entries, i), &list); !entry.ok()) return entry;
  return list;
}

}  // namespace sixpoint::identity
