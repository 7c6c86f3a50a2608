#include "cli/certificate_text.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "cli/output.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::cli {
namespace {

using identity::IssuedCertificate;
using identity::TimePoint;

constexpr std::chrono::hours kSoon{24 * 30};

std::string JsonTime(TimePoint moment) {
  google::protobuf::Timestamp time;
  runtime::ToProto(moment, &time);
  return google::protobuf::util::TimeUtil::ToString(time);
}

}  // namespace

CertificateState StateOf(const IssuedCertificate& certificate, TimePoint now) {
  if (certificate.revoked_at) return CertificateState::kRevoked;
  if (now >= certificate.not_after) return CertificateState::kExpired;
  const TimePoint::duration third = (certificate.not_after - certificate.not_before) / 3;
  const bool soon = certificate.not_after - now < std::min<TimePoint::duration>(kSoon, third);
  return soon ? CertificateState::kExpiresSoon : CertificateState::kValid;
}

std::string StateText(const IssuedCertificate& certificate) {
  switch (StateOf(certificate, std::chrono::system_clock::now())) {
    case CertificateState::kValid:
      return "valid";
    case CertificateState::kExpiresSoon:
      return "expires soon";
    case CertificateState::kExpired:
      return "expired";
    case CertificateState::kRevoked:
      return "revoked";
  }
  return "";
}

nlohmann::json CertificateToJson(const IssuedCertificate& certificate) {
  nlohmann::json roles = nlohmann::json::array();
  for (const identity::Role role : certificate.identity.roles) roles.push_back(identity::RoleText(role));
  nlohmann::json json = {{"serial", certificate.serial},
                         {"who", certificate.identity.Text()},
                         {"roles", std::move(roles)},
                         {"hosts", certificate.hosts},
                         {"from", JsonTime(certificate.not_before)},
                         {"until", JsonTime(certificate.not_after)},
                         {"state", StateText(certificate)}};
  if (certificate.revoked_at) json["revoked_at"] = JsonTime(*certificate.revoked_at);
  return json;
}

Table CertificateTable() { return Table({"serial", "who", "roles", "from", "until", "state"}); }

Cells CertificateCells(const IssuedCertificate& certificate) {
  return {certificate.serial,
          certificate.identity.Text(),
          certificate.identity.RolesText(),
          TimeText(certificate.not_before),
          TimeText(certificate.not_after),
          StateText(certificate)};
}

}  // namespace sixpoint::cli
