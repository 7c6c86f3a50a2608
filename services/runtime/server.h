// What every server needs once: flags, limits, who is let in, health, graceful stop.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/service_type.h>

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "services/runtime/sampler.h"
#include "storage/database.h"

namespace CLI {
class App;
}

namespace sixpoint::runtime {

struct RefusedSignIn {
  std::string method, account, peer_address, reason, sentence;
};

// Read from the command line by ParseServerOptions; every server has these flags.
struct ServerOptions {
  std::string area;                          // ingest, calibration, ...
  std::string listen_address;                // --listen 127.0.0.1:7401
  std::string database;                      // --database 'host=/... dbname=sixpoint'
  std::map<std::string, std::string> peers;  // --peer plant=127.0.0.1:7400 (repeated): the other services
  std::string certificates;      // --certificates DIR: this service's own, and the authority's (credentials.h)
  std::string metrics_address;   // --metrics 127.0.0.1:7421; empty: nobody sees it from outside
  std::string revoked_file;      // --revoked FILE: the authority's revocation list
  std::string worker_folder;     // --workers DIR: where sixpoint-cad-worker and sixpoint-decode-worker are
  int database_connections = 8;  // --database-connections
  int threads = 2;               // --threads: compute threads of kernels
  std::shared_ptr<grpc::ChannelCredentials> credentials;  // by which it calls the others; set by Serve
  // Counts a sign-in that was refused (denials.h), under the account that it named where there is one; set by Serve.
  std::function<void(const RefusedSignIn&)> count_refused_sign_in;
  bool volatile_database = false;  // --volatile-database: one that may lose what was acknowledged is served
  std::chrono::milliseconds write_patience{60'000};  // of a message that its client does not take (write_watch.h)
};

// `add_own_flags`: where one server has flags beside these.
ServerOptions ParseServerOptions(int argc, char** argv, const std::string& area,
                                 const std::function<void(CLI::App*)>& add_own_flags = nullptr);

struct ServedService {
  std::string full_name;  // sixpoint.plant.v1.PlantService
  std::unique_ptr<grpc::Service> service;
  std::unique_ptr<Sampled> sampled = nullptr;  // what the database knows of its work; none: nothing
  std::function<void()> on_stop = nullptr;  // ends calls that would last for ever, before those that run are waited for
};

// Builds the services from their options, serves those whom the plant's authority gave a certificate (access.h) until SIGTERM or SIGINT, then: NOT_SERVING, drain, stop. Health ("" and each
// service's name) turns SERVING once the database is reachable and its schema is at least the one this binary knows: the
// next release's migrations come before its binaries, and change nothing that these read. Until then every method answers
// UNAVAILABLE, SERVICE_NOT_READY.
using ServiceFactory = std::function<std::vector<ServedService>(const ServerOptions&, storage::Database*)>;
int Serve(const ServerOptions& options, const ServiceFactory& factory);

// version+git hash, as stored with every result.
const std::string& SoftwareVersion();

// Number of the newest migration when this binary was built.
int NewestMigration();

}  // namespace sixpoint::runtime
