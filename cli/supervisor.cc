#include "cli/supervisor.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "cli/service_user.h"
#include "identity/credentials.h"

namespace sixpoint::cli {
namespace {

std::string PeersText(const LocalPlant& plant, std::string (LocalPlant::*address)(std::size_t) const) {
  std::string peers;
  for (std::size_t i = 0; i < kAreas.size(); ++i)
    peers += std::string(" --peer ") + kAreas[i] + "=" + (plant.*address)(i);
  return peers;
}

// The plant service tells clients where the others are; the others call each other on this machine.
std::string ServiceCommand(const LocalPlant& plant, std::size_t area) {
  const std::string name = kAreas[area];
  std::string command = (plant.binaries / ("sixpoint-" + name)).string() + " --listen " + plant.ListensAt(area) +
                        (plant.IsSeen() ? " --metrics " + plant.MetricsAt(area) : "") + " --database \"" +
                        plant.ConninfoOf(area) + "\" --workers " + plant.binaries.string() + " --certificates " +
                        plant.certificates_of(kAreas[area]).string() + " --revoked " + plant.revoked().string() +
                        PeersText(plant, name == "plant" ? &LocalPlant::AnnouncedAt : &LocalPlant::OwnAddress);
  if (name == "ingest") command += " --blob-store " + plant.settings.blob_store;
  if (name == "plant")
    command += " --ledger-key " + plant.ledger_key().string() + " --ledger-heads " + plant.ledger_heads().string();
  if (name == "plant" && plant.HasGateway()) command += " --page " + plant.PageUrl();
  if (name == "plant" && !plant.settings.oidc.empty()) command += " --oidc " + plant.settings.oidc;
  return command;
}

// It has no database: what it may is what the services let a caller do.
std::string GatewayCommand(const LocalPlant& plant) {
  const std::string own = (plant.certificates_of(kGateway) / identity::kIdentityFile).string();
  return (plant.binaries / "sixpoint-gateway").string() + " --listen " + plant.GatewayListensAt() +
         (plant.IsSeen() ? " --metrics " + plant.MetricsAt(kAreas.size()) : "") + " --certificates " +
         plant.certificates_of(kGateway).string() + " --revoked " + plant.revoked().string() +
         PeersText(plant, &LocalPlant::OwnAddress) + (plant.web.empty() ? "" : " --web " + plant.web.string()) +
         (plant.IsGatewaySecured() ? " --tls-certificate " + own + " --tls-key " + own : "") +
         (plant.settings.http == HttpAccess::kProxied ? " --behind-proxy" : "") +
         (plant.settings.oidc.empty() ? "" : " --oidc " + plant.settings.oidc + " --page " + plant.PageUrl());
}

// A superuser of the database can have it read whatever its user can, which is the services', too: so the services' keys and the ledger's
// are kept out of its reach, and what it writes within its own folders. The program that does it is beside the data where the plant's own cannot be reached (CopyMigrations).
std::string PostgresCommand(const LocalPlant& plant) {
  const std::filesystem::path copied = plant.data / "bin" / "sixpoint-migrate";
  const std::filesystem::path runner = std::filesystem::exists(copied) ? copied : plant.binaries / "sixpoint-migrate";
  return runner.string() + " --run-without " + plant.ledger().string() + " " + plant.certificates().string() + " " +
         plant.authority().string() + " --writing /dev " + plant.database().string() + " " + plant.sockets().string() +
         " -- " + kPostgresBin + "postgres -D " + plant.database().string() + " -k " + plant.sockets().string() +
         " -c listen_addresses='' -c log_timezone=UTC -c max_connections=100 -c shared_buffers=128MB -c "
         "wal_compression=on"
         // After a crash one flush of the file system, not one of each file: seconds less until it is back.
         " -c recovery_init_sync_method=syncfs";
}

// Asks each service from outside, where one that is stuck cannot hide it.
std::string WatchdogCommand(const LocalPlant& plant) {
  std::string command = (plant.binaries / "sixpoint-watchdog").string() + " --supervisor " +
                        plant.supervisor_config().string() + " --certificates " + plant.certificates().string();
  for (std::size_t i = 0; i < kAreas.size(); ++i)
    command += std::string(" --service ") + kAreas[i] + "=" + plant.OwnAddress(i);
  if (plant.HasGateway()) command += std::string(" --http ") + kGateway + "=" + plant.OwnGatewayUrl();
  return command;
}

}  // namespace

std::string SupervisorConfig(const LocalPlant& plant, Programs programs) {
  std::ostringstream out;
  const auto program = [&](const std::string& name, const std::string& command, int priority,
                           const std::string& stop_signal) {
    // startretries: after a crash PostgreSQL refuses to start for some seconds; a killed service always comes back.
    out << "\n[program:" << name << "]\ncommand=" << command << "\npriority=" << priority
        << "\nautorestart=true\nstartsecs=1\nstartretries=1000\nstopsignal=" << stop_signal
        << "\nstopwaitsecs=30\nstdout_logfile=/dev/null\nstderr_logfile=" << (plant.logs() / (name + ".log")).string()
        << "\nstderr_logfile_maxbytes=16MB\nstderr_logfile_backups=4\n";
  };
  const std::string socket = (plant.sockets() / "supervisor.sock").string();
  out << "; Written by `sixpoint up`.\n[supervisord]\nnodaemon=false\nminfds=4096\ndirectory=/\npidfile="
      << plant.supervisor_pid().string() << "\nlogfile=" << (plant.logs() / "supervisord.log").string()
      << "\nchildlogdir=" << plant.logs().string() << "\n\n[unix_http_server]\nfile=" << socket
      << "\nchmod=0700\n\n[rpcinterface:supervisor]\n"
         "supervisor.rpcinterface_factory=supervisor.rpcinterface:make_main_rpcinterface\n\n[supervisorctl]\nserverurl="
         "unix://"
      << socket << "\n";
  program("postgres", PostgresCommand(plant), 1, "INT");
  if (programs == Programs::kDatabase) return out.str();
  for (std::size_t i = 0; i < kAreas.size(); ++i) program(kAreas[i], ServiceCommand(plant, i), 10, "TERM");
  if (plant.HasGateway()) program(kGateway, GatewayCommand(plant), 15, "TERM");
  program("watchdog", WatchdogCommand(plant), 20, "TERM");
  return out.str();
}

Finished Supervisorctl(const std::filesystem::path& config, std::vector<std::string> words) {
  const std::vector<std::string> program = {"supervisorctl", "-c", config.string()};
  words.insert(words.begin(), program.begin(), program.end());
  return RunProgram(AsServiceUser(std::move(words)));
}

bool SupervisorRuns(const LocalPlant& plant) {
  return std::filesystem::exists(plant.supervisor_config()) &&
         Supervisorctl(plant.supervisor_config(), {"pid"}).exit_code == 0;
}

std::map<std::string, std::string> ProgramStates(const LocalPlant& plant) {
  std::map<std::string, std::string> states;
  std::istringstream lines(Supervisorctl(plant.supervisor_config(), {"status"}).output);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, state;
    words >> name >> state;
    const auto capital = [](unsigned char c) { return std::isupper(c) != 0; };
    if (!state.empty() && std::all_of(state.begin(), state.end(), capital)) states[name] = state;
  }
  return states;
}

}  // namespace sixpoint::cli
