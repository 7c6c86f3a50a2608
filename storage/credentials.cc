#include "storage/credentials.h"

#include <utility>

#include "storage/each_row.h"
#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

constexpr char kForgetOffers[] = "DELETE FROM credential_offers WHERE expires_at <= clock_timestamp()";
constexpr char kCountOffers[] = "SELECT count(*) FROM credential_offers";
constexpr char kKeepOffer[] =
    "INSERT INTO credential_offers (pickup_sha256, sealed, identity, offered_by, expires_at) VALUES ($1, $2, $3, $4, "
    "clock_timestamp() + make_interval(hours => $5::integer)) "
    "ON CONFLICT (pickup_sha256) DO NOTHING";
constexpr char kOfferEnds[] = "SELECT expires_at FROM credential_offers WHERE pickup_sha256 = $1";
// Of two at once one gets it: the other waits for its commit and finds nothing.
constexpr char kTake[] =
    "DELETE FROM credential_offers WHERE pickup_sha256 = $1 AND expires_at > clock_timestamp() "
    "RETURNING identity, offered_by, sealed";
constexpr char kKeepRenewal[] =
    "INSERT INTO certificate_renewals (public_key_sha256, serial, identity, certificate_pem, not_after, offered_by) "
    "VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT (public_key_sha256, serial) DO NOTHING";
constexpr char kFindRenewals[] =
    "SELECT serial, identity, certificate_pem, not_after, offered_by FROM certificate_renewals "
    "WHERE public_key_sha256 = $1 ORDER BY not_after DESC, serial LIMIT 10";
constexpr std::int64_t kMostOffers = 1000;

class PostgresCredentials final : public CredentialStore {
 public:
  explicit PostgresCredentials(Database* database) : database_(database) {}

  absl::StatusOr<std::vector<CertificateRenewal>> FindRenewals(const std::string& public_key_sha256,
                                                               Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::FindRenewals(t, public_key_sha256); });
  }
  absl::StatusOr<Instant> KeepOffer(const CredentialOffer& offer, const StillWanted& still_wanted,
                                    Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return storage::KeepOffer(t, offer); });
  }
  absl::StatusOr<std::optional<CredentialOffer>> TakeOffer(const std::string& pickup_sha256,
                                                           const StillWanted& still_wanted,
                                                           Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted,
                    [&](Transaction& t) { return storage::TakeOffer(t, pickup_sha256); });
  }
  absl::Status KeepRenewal(const CertificateRenewal& renewal, const StillWanted& still_wanted,
                           Deadline deadline) override {
    const auto keep = [&](Transaction& t) -> absl::StatusOr<bool> {
      if (absl::Status status = storage::KeepRenewal(t, renewal); !status.ok()) return status;
      return true;
    };
    return OneWrite(*database_, deadline, still_wanted, keep).status();
  }

 private:
  Database* const database_;
};

}  // namespace

absl::StatusOr<Instant> KeepOffer(Transaction& transaction, const CredentialOffer& offer) {
  if (const auto forgotten = transaction.Execute(kForgetOffers); !forgotten.ok()) return forgotten.status();
  const absl::StatusOr<Rows> waiting = transaction.Execute(kCountOffers);
  if (!waiting.ok()) return waiting.status();
  if (waiting->Int(0, 0) >= kMostOffers)
    return absl::ResourceExhaustedError("credentials: " + std::to_string(kMostOffers) +
                                        " wait to be taken, want fewer");
  Params params;
  params.Digest(offer.pickup_sha256).Bytes(offer.sealed).Text(offer.identity).Text(offer.offered_by);
  params.Int(offer.valid_hours);
  if (const auto kept = transaction.Execute(kKeepOffer, params); !kept.ok()) return kept.status();
  const absl::StatusOr<Rows> ends = transaction.Execute(kOfferEnds, Params().Digest(offer.pickup_sha256));
  if (!ends.ok()) return ends.status();
  if (ends->count() != 1) return absl::InternalError("credentials: kept and not there");
  return ends->Checked(ends->Time(0, 0));
}

absl::StatusOr<std::optional<CredentialOffer>> TakeOffer(Transaction& transaction, const std::string& pickup_sha256) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kTake, Params().Digest(pickup_sha256));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  CredentialOffer offer{pickup_sha256, rows->Bytes(0, 2), rows->Text(0, 0), rows->Text(0, 1)};
  return rows->Checked(std::optional(std::move(offer)));
}

absl::Status KeepRenewal(Transaction& transaction, const CertificateRenewal& renewal) {
  Params params;
  params.Digest(renewal.public_key_sha256).Text(renewal.serial).Text(renewal.identity).Text(renewal.certificate_pem);
  params.Time(renewal.not_after).Text(renewal.offered_by);
  return transaction.Execute(kKeepRenewal, params).status();
}

absl::StatusOr<std::vector<CertificateRenewal>> FindRenewals(Transaction& transaction,
                                                             const std::string& public_key_sha256) {
  return AllRows(transaction, kFindRenewals, Params().Digest(public_key_sha256),
                 [&](const Rows& rows, int row) -> CertificateRenewal {
                   return {public_key_sha256, rows.Text(row, 0), rows.Text(row, 1),
                           rows.Text(row, 2), rows.Time(row, 3), rows.Text(row, 4)};
                 });
}

std::shared_ptr<CredentialStore> CredentialsIn(Database* database) {
  return std::make_shared<PostgresCredentials>(database);
}

}  // namespace sixpoint::storage
