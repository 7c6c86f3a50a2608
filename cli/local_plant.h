// A whole plant on one machine. A private PostgreSQL (unix socket, checksums) and all services run as separate processes under
// supervisord, in one data folder, all of them as the service user where root starts them.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/listen_address.h"
#include "cli/plant_settings.h"
#include "cli/progress.h"
#include "identity/authority.h"

namespace sixpoint::cli {

// Areas in the order of their ports: base_port + index.
inline constexpr std::array<const char*, 6> kAreas = {"plant",        "ingest",     "calibration",
                                                      "registration", "correction", "inspection"};
static_assert(kAreas.size() == kPortCount);
inline constexpr char kGateway[] = "gateway";
inline constexpr char kPostgresBin[] = "/usr/lib/postgresql/15/bin/";

// Of a plant in that folder: its authority; what everybody may read of it, beside a folder for each service's certificate; and the
// certificate of the user who started it.
inline std::filesystem::path AuthorityIn(const std::filesystem::path& data) { return data / "authority"; }
inline std::filesystem::path CertificatesIn(const std::filesystem::path& data) { return data / "certificates"; }
inline std::filesystem::path LocalIdentityIn(const std::filesystem::path& data) {
  return CertificatesIn(data) / "local";
}
inline constexpr char kRevokedFile[] = "revoked.pem";

struct LocalPlant {
  std::filesystem::path data;
  std::filesystem::path binaries;    // where the service programs are
  std::filesystem::path migrations;  // where the SQL files are
  std::filesystem::path web;         // the page's files; empty: they are not here
  std::filesystem::path alerts;      // Prometheus' rules; empty: they are not here
  PlantSettings settings;
  ListenAddress address;  // as the settings say

  std::filesystem::path database() const { return data / "postgres"; }
  std::filesystem::path sockets() const { return data / "run"; }
  std::filesystem::path logs() const { return data / "log"; }
  // The ledger's key, its public half, and the heads that are sent out: the service user's alone.
  std::filesystem::path ledger() const { return data / "ledger"; }
  std::filesystem::path ledger_key() const { return ledger() / "key.pem"; }
  std::filesystem::path ledger_heads() const { return ledger() / "heads.jsonl"; }
  std::filesystem::path supervisor_pid() const { return sockets() / "supervisord.pid"; }
  std::filesystem::path supervisor_config() const { return data / "supervisord.conf"; }
  std::filesystem::path prometheus_config() const { return data / "prometheus.yml"; }
  // The authority's folder is out of the service user's reach (cli/plant_certificates.h).
  std::filesystem::path authority() const { return AuthorityIn(data); }
  std::filesystem::path certificates() const { return CertificatesIn(data); }
  std::filesystem::path certificates_of(const std::string& area) const { return certificates() / area; }
  std::filesystem::path revoked() const { return certificates() / kRevokedFile; }
  // As the owner; a service connects as its own role (migrations/V0010).
  std::string conninfo() const { return "host=" + sockets().string() + " dbname=sixpoint user=sixpoint"; }
  std::string ConninfoOf(std::size_t area) const { return conninfo() + "_" + kAreas[area]; }
  // The programs that serve: those of kAreas in their order, then the gateway, where there is one.
  std::vector<std::string> Served() const;
  bool HasGateway() const { return settings.http != HttpAccess::kNone; }
  // Over TLS, by the gateway's own certificate.
  bool IsGatewaySecured() const { return settings.http == HttpAccess::kDirect && !address.IsLoopback(); }
  std::string GatewayHost() const;  // where it binds, at settings.HttpPort()
  std::string GatewayListensAt() const { return HostAndPort(GatewayHost(), settings.HttpPort()); }
  // As this machine reaches it, and as clients do who are not behind the proxy: "http://127.0.0.1:7480".
  std::string OwnGatewayUrl() const;
  std::string AnnouncedGatewayUrl() const;
  // Where people find the page; empty: nowhere.
  std::string PageUrl() const;
  // Where the area's service binds; where this machine reaches it; where clients are told that it is.
  std::string ListensAt(std::size_t area) const { return At(address.listen, area); }
  std::string OwnAddress(std::size_t area) const { return At(address.Own(), area); }
  std::string AnnouncedAt(std::size_t area) const { return At(address.announce, area); }
  // The same of where it is seen, if at all.
  bool IsSeen() const { return settings.MetricsPort() != 0; }
  std::string MetricsAt(std::size_t area) const { return SeenAt(address.listen, area); }
  std::string OwnMetrics(std::size_t area) const { return SeenAt(address.Own(), area); }
  std::string AnnouncedMetrics(std::size_t area) const { return SeenAt(address.announce, area); }

 private:
  std::string At(const std::string& host, std::size_t area) const {
    return HostAndPort(host, settings.base_port + static_cast<int>(area));
  }
  std::string SeenAt(const std::string& host, std::size_t area) const {
    return HostAndPort(host, settings.MetricsPort() + static_cast<int>(area));
  }
};

// What is to be started in a folder, by what it was told before; nothing is changed yet. Refuses a folder that is no plant's.
absl::StatusOr<LocalPlant> PlantIn(const std::filesystem::path& data);
// One that was started there before.
absl::StatusOr<LocalPlant> KnownPlant(const std::filesystem::path& data);
// Until everything serves. Once more on a plant that runs: with the new programs, addresses and schema; the schema comes first. The
// folder, the ports and the programs are looked at before anything is changed.
absl::Status StartPlant(LocalPlant plant, ProgressLine* progress);
// Nothing to do where nothing runs. INVALID_ARGUMENT where the folder holds no plant.
absl::Status StopPlant(const std::filesystem::path& data);

struct ServiceState {
  std::string health;  // SERVING, NOT_SERVING, NOT_REACHED, SILENT or NOT_TRUSTED (cli/service_health.h)
  std::string why;     // it does not serve, in its own words; empty where it says nothing
};
struct PlantHealth {
  LocalPlant plant;
  bool supervised = false;
  bool database = false;               // accepts connections
  std::vector<ServiceState> services;  // by plant.Served(); the same of certificates
  // None where there is none, or none that can be read.
  std::vector<std::optional<identity::IssuedCertificate>> certificates;
  bool AllServe() const;
};
absl::StatusOr<PlantHealth> HealthOf(const std::filesystem::path& data);

// Where `up` puts a plant unless told: /var/lib/sixpoint for root, else ~/.sixpoint.
std::filesystem::path UsualDataFolder();

}  // namespace sixpoint::cli
