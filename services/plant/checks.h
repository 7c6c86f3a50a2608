// What the checks of machines, artefacts and parts share. Each refusal names the field, its value and what was wanted.
#pragma once

#include <absl/status/status.h>

#include <optional>
#include <string>
#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/stored_geometry.h"
#include "sixpoint/plant/v1/reference.pb.h"
#include "storage/blobs.h"
#include "storage/references.h"

namespace sixpoint::plant {

// One range check; lower and upper limits are inside.
inline absl::Status CheckRange(const std::string& field, double value, double least, double greatest,
                               const std::string& wanted) {
  return value >= least && value <= greatest ? absl::OkStatus() : runtime::Refuse(field, value, wanted);
}
inline absl::Status CheckPositive(const std::string& field, double value, double greatest) {
  if (value > 0 && value <= greatest) return absl::OkStatus();
  return runtime::Refuse(field, value, "> 0 and <= " + NumberText(greatest));
}

// Reads a point or direction into `out`.
template <typename Message>
absl::Status Read(const std::string& field, bool given, const Message& in, std::vector<double>* out) {
  if (!given) return runtime::Refuse(field, "", "a value");
  const absl::StatusOr<Eigen::Vector3d> value = runtime::FromProto(field, in);
  if (!value.ok()) return value.status();
  if (!(value->cwiseAbs().maxCoeff() < 1e7))
    return runtime::Refuse(field, value->cwiseAbs().maxCoeff(), "within 1e7 mm");
  *out = runtime::RowMajor(*value);
  return absl::OkStatus();
}

// Of the description alone, so that the same description again is the same revision.
template <typename Message>
std::string ContentSha256(Message message, const std::string& more = "") {
  message.clear_name();
  message.clear_revision();
  message.clear_created_at();
  return storage::Sha256Hex(message.SerializeAsString() + more);
}

// Where it is given.
absl::Status ReadCertificate(const std::string& field, bool given, const v1::Certificate& in,
                             std::optional<storage::CertificateRow>* out);
absl::Status ReadExpansion(const std::string& field, bool given, const v1::ThermalExpansion& in,
                           std::optional<storage::ExpansionRow>* out);

}  // namespace sixpoint::plant
