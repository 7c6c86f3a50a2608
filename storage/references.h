// Certificates and expansions of what the plant measures with, as columns of whatever has one (proto: plant/v1/reference.proto).
#pragma once

#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

// Columns: number, calibrated_at, expires_at; all NULL where there is none.
struct CertificateRow {
  std::string number;
  Instant calibrated_at, expires_at;
};
inline void Add(const std::optional<CertificateRow>& certificate, Params* params) {
  certificate ? params->Text(certificate->number).Time(certificate->calibrated_at).Time(certificate->expires_at)
              : params->Null().Null().Null();
}
inline std::optional<CertificateRow> CertificateAt(const Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return std::nullopt;
  return CertificateRow{rows.Text(row, column), rows.Time(row, column + 1), rows.Time(row, column + 2)};
}

// Columns: um_per_m_k, standard_uncertainty_um_per_m_k; both NULL where there is none.
struct ExpansionRow {
  double um_per_m_k = 0, standard_uncertainty_um_per_m_k = 0;
};
inline void Add(const std::optional<ExpansionRow>& expansion, Params* params) {
  expansion ? params->Real(expansion->um_per_m_k).Real(expansion->standard_uncertainty_um_per_m_k)
            : params->Null().Null();
}
inline std::optional<ExpansionRow> ExpansionAt(const Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return std::nullopt;
  return ExpansionRow{rows.Real(row, column), rows.Real(row, column + 1)};
}

}  // namespace sixpoint::storage
