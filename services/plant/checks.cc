#include "services/plant/checks.h"

#include "services/runtime/request_checks.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {

absl::Status ReadCertificate(const std::string& field, bool given, const v1::Certificate& in,
                             std::optional<storage::CertificateRow>* out) {
  if (!given) return absl::OkStatus();
  runtime::Refusals refusals;
  if (in.number().empty()) refusals.Add(runtime::Refuse(field + ".number", "", "what is printed on it"));
  refusals.Add(runtime::CheckMoment(field + ".calibrated_at", in.calibrated_at()))
      .Add(runtime::CheckMoment(field + ".expires_at", in.expires_at()));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  *out = {in.number(), runtime::MomentOf(in.calibrated_at()), runtime::MomentOf(in.expires_at())};
  if ((*out)->calibrated_at < (*out)->expires_at) return absl::OkStatus();
  return runtime::Refuse(field + ".expires_at", std::to_string(in.expires_at().seconds()) + " s",
                         "later than calibrated_at");
}

absl::Status ReadExpansion(const std::string& field, bool given, const v1::ThermalExpansion& in,
                           std::optional<storage::ExpansionRow>* out) {
  if (!given) return absl::OkStatus();
  *out = {in.um_per_m_k(), in.standard_uncertainty_um_per_m_k()};
  return runtime::Refusals()
      .Add(CheckRange(field + ".um_per_m_k", in.um_per_m_k(), -5, 50, "-5 to 50"))
      .Add(CheckPositive(field + ".standard_uncertainty_um_per_m_k", in.standard_uncertainty_um_per_m_k(), 10))
      .status();
}

}  // namespace sixpoint::plant
