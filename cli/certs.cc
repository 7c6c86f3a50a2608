// `sixpoint certs`: the certificates by which the plant and those who call it know each other.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/certificate_text.h"
#include "cli/certs_handover.h"
#include "cli/commands.h"
#include "cli/document.h"
#include "cli/identity_folder.h"
#include "cli/plant_certificates.h"
#include "identity/certificate_token.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using identity::Authority;
using identity::Identity;
using identity::IssuedCertificate;

constexpr int kLongest_days = 397;
constexpr std::uint64_t kGreatestPem_bytes = 65536;

struct CertsArguments {
  std::string authority;  // empty: the plant's own
  std::string plant;
  std::string who;  // also a serial, where one is revoked
  std::string folder;
  std::string code;
  std::vector<std::string> roles, hosts, holders;
  int valid_days = 90, offer_hours = 24, token_minutes = 15, limit = 0;
  bool all = false;
};

fs::path AuthorityFolder(const Session& session, const CertsArguments& arguments) {
  return arguments.authority.empty() ? AuthorityIn(session.data) : fs::path(arguments.authority);
}

// "serial     4f0a..." and so on: one certificate for people.
std::string CertificateText(const IssuedCertificate& certificate) {
  std::string hosts;
  for (const std::string& host : certificate.hosts) hosts += (hosts.empty() ? "" : ", ") + host;
  return "who           " + certificate.identity.Text() + "\nroles         " + certificate.identity.RolesText() +
         "\nserial        " + certificate.serial + "\nfrom          " + TimeText(certificate.not_before) +
         "\nuntil         " + TimeText(certificate.not_after) + "  " + StateText(certificate) + "\n" +
         (hosts.empty() ? "" : "hosts         " + hosts + "\n");
}

void PrintCertificate(const Session& session, const IssuedCertificate& certificate, const fs::path& folder) {
  if (session.json) {
    nlohmann::json json = CertificateToJson(certificate);
    json["folder"] = folder.string();
    PrintJson(json);
  } else {
    std::cout << CertificateText(certificate) << "folder        " << folder.string() << "\n";
  }
}

absl::Status Init(Session* session, const CertsArguments& arguments) {
  const std::string plant = arguments.plant.empty() ? HostName() : arguments.plant;
  if (absl::Status status = Authority::Create(arguments.authority, plant); !status.ok()) return status;
  if (session->json) {
    PrintJson({{"authority", arguments.authority}, {"plant", plant}});
  } else {
    std::cout << "made the authority of " << plant << " in " << arguments.authority
              << "; who reads its key.pem can be anybody to the plant\n";
  }
  return absl::OkStatus();
}

absl::StatusOr<Identity> WishedIdentity(const CertsArguments& arguments) {
  std::vector<identity::Role> roles;
  for (const std::string& text : arguments.roles) {
    const absl::StatusOr<identity::Role> role = identity::RoleOf("--role", text);
    if (!role.ok()) return role.status();
    roles.push_back(*role);
  }
  absl::StatusOr<Identity> wished = identity::IdentityOf(arguments.who, roles);
  if (!wished.ok() || wished->kind != identity::Kind::kService) return wished;
  std::string areas;
  for (const char* area : kAreas) {
    if (wished->name == area) return wished;
    areas += (areas.empty() ? "" : ", ") + std::string(area);
  }
  if (wished->Has(identity::Role::kGateway)) return wished;
  return runtime::Refuse("NAME", arguments.who, "services/ and one of " + areas + ", " + kGateway);
}

// Empty, or what is to be renewed: nobody's credentials are lost by a wrong folder's name.
absl::Status CheckCredentialsFolder(const fs::path& folder, const Identity& wished, const std::string& authority_pem) {
  const absl::StatusOr<IssuedCertificate> there = identity::ReadCertificate(folder / identity::kIdentityFile);
  if (absl::IsNotFound(there.status())) return absl::OkStatus();
  if (!there.ok()) return there.status();
  const auto refused = [&](const std::string& what) {
    return runtime::Refuse("--folder", folder.string() + " (" + what + ")",
                           "a folder without identity.pem, or with that of " + wished.Text());
  };
  if (there->identity.Text() != wished.Text()) return refused("of " + there->identity.Text());
  const absl::StatusOr<std::string> pem = ReadFile((folder / identity::kAuthorityFile).string(), kGreatestPem_bytes);
  return pem.ok() && *pem != authority_pem ? refused("of another plant") : absl::OkStatus();
}

absl::Status Issue(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<Identity> wished = WishedIdentity(arguments);
  if (!wished.ok()) return wished.status();
  absl::StatusOr<Authority> authority = OpenAuthority(AuthorityFolder(*session, arguments));
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<std::string> authority_pem = authority->CertificatePem();
  if (!authority_pem.ok()) return authority_pem.status();
  const fs::path folder = arguments.folder;
  if (absl::Status status = CheckCredentialsFolder(folder, *wished, *authority_pem); !status.ok()) return status;
  const absl::StatusOr<identity::Credentials> credentials =
      authority->Issue({*wished, arguments.hosts, std::chrono::hours(24 * arguments.valid_days)});
  if (!credentials.ok()) return credentials.status();
  if (absl::Status status = identity::WriteCredentials(folder, *credentials); !status.ok()) return status;
  const absl::StatusOr<IssuedCertificate> issued = identity::ReadCertificate(folder / identity::kIdentityFile);
  if (!issued.ok()) return issued.status();
  PrintCertificate(*session, *issued, folder);
  return absl::OkStatus();
}

absl::Status Offer(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<Identity> wished = WishedIdentity(arguments);
  if (!wished.ok()) return wished.status();
  if (wished->Has(identity::Role::kService))
    return runtime::Refuse("NAME", arguments.who,
                           "machines/ID, users/NAME or services/gateway; another service is given its folder");
  absl::StatusOr<Authority> authority = OpenAuthority(AuthorityFolder(*session, arguments));
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<identity::Credentials> credentials =
      authority->Issue({*wished, {}, std::chrono::hours(24 * arguments.valid_days)});
  if (!credentials.ok()) return credentials.status();
  return OfferCredentials(session, *wished, *credentials, arguments.offer_hours);
}

absl::Status Take(Session* session, const CertsArguments& arguments) {
  return TakeCredentials(session, arguments.code, arguments.folder);
}

absl::Status Fetch(Session* session, const CertsArguments&) { return FetchRenewal(session); }

bool CountsStill(const IssuedCertificate& certificate) {
  const CertificateState state = StateOf(certificate, std::chrono::system_clock::now());
  return state == CertificateState::kValid || state == CertificateState::kExpiresSoon;
}

absl::Status List(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<Authority> authority = OpenAuthority(AuthorityFolder(*session, arguments));
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<std::vector<IssuedCertificate>> issued = authority->Issued();
  if (!issued.ok()) return issued.status();
  nlohmann::json json = nlohmann::json::array();
  Table table = CertificateTable();
  for (const IssuedCertificate& certificate : *issued) {
    if (!WantsMore(arguments.limit, static_cast<int>(json.size()))) break;
    if (!arguments.all && !CountsStill(certificate)) continue;
    json.push_back(CertificateToJson(certificate));
    table.AddRow(CertificateCells(certificate));
  }
  if (session->json) {
    PrintJson(json);
  } else {
    std::cout << table.ToText();
  }
  return absl::OkStatus();
}

// A serial, or all of an identity's that count still.
absl::StatusOr<std::vector<std::string>> SerialsOf(const std::vector<IssuedCertificate>& issued,
                                                   const std::string& who) {
  if (who.find('/') == std::string::npos) {
    std::string serial = who;  // with colons, as openssl prints it too
    serial.erase(std::remove(serial.begin(), serial.end(), ':'), serial.end());
    return std::vector<std::string>{serial};
  }
  std::vector<std::string> serials;
  bool known = false;
  for (const IssuedCertificate& certificate : issued) {
    if (certificate.identity.Text() != who) continue;
    known = true;
    if (CountsStill(certificate)) serials.push_back(certificate.serial);
  }
  if (!known) return runtime::Refuse("SERIAL|NAME", who, "a serial or a name that `sixpoint certs list --all` shows");
  return serials;
}

absl::Status Revoke(Session* session, const CertsArguments& arguments) {
  const fs::path folder = AuthorityFolder(*session, arguments);
  const absl::StatusOr<Authority> authority = OpenAuthority(folder);
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<std::vector<IssuedCertificate>> issued = authority->Issued();
  if (!issued.ok()) return issued.status();
  const absl::StatusOr<std::vector<std::string>> serials = SerialsOf(*issued, arguments.who);
  if (!serials.ok()) return serials.status();
  const absl::StatusOr<bool> told = RevokeCertificates(folder, *serials, session->data);
  if (!told.ok()) return told.status();
  if (session->json) {
    PrintJson({{"revoked_count", serials->size()}, {"serials", *serials}, {"plant_told", *told}});
    return absl::OkStatus();
  }
  std::cout << serials->size() << (serials->size() == 1 ? " certificate" : " certificates") << " revoked ("
            << arguments.who << "); "
            << (*told ? "the plant refuses the next call by it\n"
                      : "no plant was told: that in " + session->data + " is not of this authority\n");
  return absl::OkStatus();
}

absl::Status ShowCertificate(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<fs::path> folder = arguments.folder.empty() ? IdentityFolder(session->identity, session->data)
                                                                   : absl::StatusOr<fs::path>(arguments.folder);
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<IssuedCertificate> certificate = identity::ReadCertificate(*folder / identity::kIdentityFile);
  if (!certificate.ok()) return certificate.status();
  PrintCertificate(*session, *certificate, *folder);
  return absl::OkStatus();
}

// For who calls the gateway by HTTP.
absl::Status PrintToken(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<fs::path> folder = IdentityFolder(session->identity, session->data);
  if (!folder.ok()) return folder.status();
  const auto now = std::chrono::system_clock::now();
  const absl::StatusOr<std::string> token = identity::SignCertificateToken(
      *folder / identity::kIdentityFile, now, now + std::chrono::minutes(arguments.token_minutes));
  if (!token.ok()) return token.status();
  if (session->json) {
    PrintJson({{"token", *token}});
  } else {
    std::cout << *token << "\n";
  }
  return absl::OkStatus();
}

// What machines and users hold lies with them: the plant keeps what follows until they fetch it. What was made before and could not be
// brought to the plant is brought now.
absl::Status RenewForHolders(Session* session, const CertsArguments& arguments, nlohmann::json* json, Table* table) {
  absl::StatusOr<Authority> authority = OpenAuthority(AuthorityIn(session->data));
  if (!authority.ok()) return authority.status();
  const absl::StatusOr<std::vector<IssuedCertificate>> issued = authority->Issued();
  if (!issued.ok()) return issued.status();
  const HandedOver over = HandOver(*issued, arguments.holders, std::chrono::system_clock::now());
  for (const IssuedCertificate& due : over.due) {
    // Whole days: what it was dated back by for late clocks is not added each time.
    const auto lasts = std::max(std::chrono::hours(1),
                                (due.not_after - due.not_before) / std::chrono::hours(24) * std::chrono::hours(24));
    const absl::StatusOr<std::string> renewed = authority->Renew(due.serial, lasts);
    if (!renewed.ok()) return renewed.status();
    if (absl::Status status = OfferRenewal(session, *renewed); !status.ok()) return status;
    const absl::StatusOr<IssuedCertificate> next = identity::CertificateOf(*renewed);
    if (!next.ok()) return next.status();
    json->push_back(CertificateToJson(*next));
    json->back()["renewed"] = true;
    table->AddRow({next->identity.Text(), TimeText(next->not_after), "waits for `certs fetch`"});
  }
  for (const IssuedCertificate& made : over.to_offer) {
    const absl::StatusOr<std::string> pem = authority->CertificatePemOf(made.serial);
    if (!pem.ok()) return pem.status();
    if (absl::Status status = OfferRenewal(session, *pem); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Renew(Session* session, const CertsArguments& arguments) {
  const absl::StatusOr<LocalPlant> plant = KnownPlant(session->data);
  if (!plant.ok()) return plant.status();
  session->server = plant->OwnAddress(0);  // this folder's own plant, whatever is usual
  const absl::StatusOr<std::vector<Renewed>> renewed =
      RenewCertificates(*plant, FindServiceUser(), arguments.all ? Renewal::kAll : Renewal::kWhereDue);
  if (!renewed.ok()) return renewed.status();
  nlohmann::json json = nlohmann::json::array();
  Table table({"who", "until", "renewed"});
  for (const auto& [certificate, is_new] : *renewed) {
    json.push_back(CertificateToJson(certificate));
    json.back()["renewed"] = is_new;
    table.AddRow({certificate.identity.Text(), TimeText(certificate.not_after), is_new ? "yes" : "not due"});
  }
  if (absl::Status status = RenewForHolders(session, arguments, &json, &table); !status.ok()) return status;
  if (session->json) {
    PrintJson(json);
  } else {
    std::cout << table.ToText();
  }
  return absl::OkStatus();
}

}  // namespace

void AddCertsCommands(Command* app, Session* session) {
  Command* certs = app->AddCommand("certs", "Certificates: who may call the plant, and until when");
  certs->RequireCommand();
  const auto arguments = std::make_shared<CertsArguments>();
  const auto add = [&](const char* name, const char* help, absl::Status (*action)(Session*, const CertsArguments&)) {
    Command* const command = certs->AddCommand(name, help);
    session->OnCommand(command, [session, arguments, action] { return action(session, *arguments); });
    return command;
  };
  Command* init = add("init", "Makes an authority where none is; `sixpoint up` makes a plant's own by itself", Init);
  Command* issue = add("issue", "A certificate for a machine, a user or a service", Issue);
  Command* offer = add("offer", "The same for a user or a machine elsewhere, by a code that is good once", Offer);
  Command* take = add("take", "On that machine: takes what the code opens", Take);
  add("fetch", "The certificate that follows one's own, once `certs renew` has made it; the key stays", Fetch);
  Command* list = add("list", "What the authority gave, newest first", List);
  Command* revoke = add("revoke", "Takes certificates back; the plant refuses the next call by them", Revoke);
  Command* show =
      add("show", "What a folder of credentials holds; without DIR, the one shown to the plant", ShowCertificate);
  Command* token =
      add("token", "A bearer token for the gateway, signed by one's own key: who has HTTP alone", PrintToken);
  token->AddOption("--minutes", &arguments->token_minutes, "How long it is good")->Within(1, 15)->ShowDefault();
  Command* renew = add(
      "renew",
      "The services' certificates and this user's own, and for others to fetch, where they are due; no restart", Renew);

  const std::string authority_help = "The authority's folder; without it the plant's own, in --data";
  init->AddOption("--authority", &arguments->authority, "Folder to make it in")->Required();
  init->AddOption("--plant", &arguments->plant,
                  "What its certificate calls the plant; without it, this computer's name");
  for (Command* command : {issue, offer, list, revoke})
    command->AddOption("--authority", &arguments->authority, authority_help);
  issue->AddOption("NAME", &arguments->who, "machines/ID, users/NAME, services/AREA or services/gateway")->Required();
  offer->AddOption("NAME", &arguments->who, "machines/ID, users/NAME or services/gateway")->Required();
  offer->AddOption("--hours", &arguments->offer_hours, "How long the code is good")->Within(1, 720)->ShowDefault();
  take->AddOption("--code", &arguments->code, "As `certs offer` printed it")->Required();
  take->AddOption("--folder", &arguments->folder, "Folder for identity.pem and authority.pem")->Required();
  issue
      ->AddOption("--folder", &arguments->folder,
                  "Folder for identity.pem and authority.pem; what is there of NAME is renewed")
      ->Required();
  for (Command* command : {issue, offer}) {
    command->AddOption("--role", &arguments->roles, "Of a user: engineer, quality, mes-reader, admin; repeatable")
        ->Repeat();
    command->AddOption("--valid-days", &arguments->valid_days, "How long it holds")
        ->Within(1, kLongest_days)
        ->ShowDefault();
  }
  issue->AddOption("--host", &arguments->hosts, "Of a service: by which clients reach it; repeatable")->Repeat();
  list->AddFlag("--all", &arguments->all, "Also what has expired or was revoked");
  AddLimitOption(list, &arguments->limit);
  revoke
      ->AddOption("SERIAL|NAME", &arguments->who, "One certificate, or all that still count of users/NAME or the like")
      ->Required();
  show->AddOption("DIR", &arguments->folder, "Folder with identity.pem");
  renew->AddFlag("--all", &arguments->all, "Also what is not due");
  renew
      ->AddOption("--holder", &arguments->holders,
                  "A user, or services/gateway, whose certificate is followed as machines' are; repeatable")
      ->Repeat();
}

}  // namespace sixpoint::cli
