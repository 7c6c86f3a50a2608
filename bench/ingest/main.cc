// sixpoint-bench-ingest: the parts of `bench/run ingest` (bench/ingest/measure drives them). Each prints one JSON object.
#include <CLI/CLI.hpp>
#include <iostream>

#include "bench/ingest/block_profile.h"
#include "bench/ingest/faults.h"
#include "bench/ingest/load.h"
#include "bench/ingest/mutants.h"
#include "bench/ingest/peers.h"
#include "bench/ingest/registry.h"
#include "bench/ingest/stored_bytes.h"
#include "services/runtime/credentials.h"

namespace {

void AddEndpoint(CLI::App* part, const std::string& name, sixpoint::bench::Endpoint* endpoint) {
  part->add_option(name, endpoint->address)->required();
  part->add_option_function<std::string>(
      "--identity",
      [endpoint](const std::string& folder) {
        const auto credentials = sixpoint::runtime::ChannelCredentialsOf(folder);
        if (!credentials.ok()) throw CLI::ValidationError("--identity", credentials.status().ToString());
        endpoint->credentials = *credentials;
      },
      "Folder with identity.pem and authority.pem; without it no TLS, as the sink wants it");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sixpoint::bench;
  CLI::App app("What bench/run ingest is made of.", "sixpoint-bench-ingest");
  app.require_subcommand(1);
  int exit_code = 0;
  const auto print = [&exit_code](const nlohmann::json& result) {
    std::cout << result.dump() << std::endl;
    if (result.contains("error")) exit_code = 1;
  };

  Endpoint endpoint;
  std::string conninfo, folder;
  std::uint64_t seed = 1;
  int count = 0, profiles_per_block = 48;
  double seconds = 15;

  CLI::App* registry = app.add_subcommand("register", "Registers machines, a part and a blade");
  AddEndpoint(registry, "--plant", &endpoint);
  registry->add_option("--machines", count)->required();
  registry->callback([&] {
    const absl::Status registered = Register(endpoint, count);
    print(registered.ok() ? nlohmann::json{{"machines", count}} : nlohmann::json{{"error", registered.ToString()}});
  });

  LoadOptions load;
  CLI::App* stream = app.add_subcommand("stream", "Machines that stream raw profiles");
  AddEndpoint(stream, "--ingest", &load.ingest);
  stream->add_option("--machines", load.machine_count)->required();
  stream->add_option("--seconds", load.seconds);
  stream->add_option("--profiles-per-s", load.profiles_per_s, "Of one machine; 0: as fast as it goes");
  stream->add_option("--profiles-per-block", load.profiles_per_block);
  stream->add_option("--blocks-per-scan", load.blocks_per_scan);
  stream->add_option("--seed", load.seed);
  stream->callback([&] { print(StreamScans(load)); });

  CLI::App* small = app.add_subcommand("small-scans", "Many small scans");
  AddEndpoint(small, "--ingest", &endpoint);
  small->add_option("--count", count)->required();
  small->add_option("--seed", seed);
  small->callback([&] { print(StreamSmallScans(endpoint, count, seed)); });

  std::string scan_id;
  CLI::App* bodies = app.add_subcommand("upload-bodies", "Whole request streams of small scans, one a file");
  bodies->add_option("--folder", folder)->required();
  bodies->add_option("--count", count)->required();
  bodies->add_option("--scan-id", scan_id)->required();
  bodies->callback([&] { print(WriteUploadBodies(folder, count, scan_id)); });

  CLI::App* profile = app.add_subcommand("block-profile", "Where the time of a block goes");
  profile->add_option("--database", conninfo)->required();
  profile->add_option("--profiles-per-block", profiles_per_block);
  profile->add_option("--blocks", count)->required();
  profile->callback([&] { print(ProfileBlocks(conninfo, profiles_per_block, count)); });

  std::vector<std::string> scan_files;
  double error_bound_um = 0.25;
  CLI::App* stored = app.add_subcommand("stored-bytes", "What a point costs when it is stored");
  stored->add_option("--folder", folder, "Where raw.bin and xyz.bin go")->required();
  stored->add_option("--profiles-per-block", profiles_per_block);
  stored->add_option("--error-bound-um", error_bound_um);
  stored->add_option("scans", scan_files, "Draco files; none: a scan of its own");
  stored->callback([&] { print(CompareStoredBytes(scan_files, profiles_per_block, error_bound_um, folder)); });

  bool compressible = false;
  CLI::App* insert = app.add_subcommand("insert-blocks", "Raw blocks as bytea by libpq");
  insert->add_option("--database", conninfo)->required();
  insert->add_option("--connections", count)->required();
  insert->add_option("--seconds", seconds);
  insert->add_option("--profiles-per-block", profiles_per_block);
  insert->add_flag("--compressible", compressible, "Let PostgreSQL try to compress");
  insert->callback([&] { print(InsertBlocks(conninfo, count, seconds, profiles_per_block, compressible)); });

  CLI::App* sink = app.add_subcommand("sink", "A gRPC server that stores nothing, until standard input ends");
  sink->add_option("--listen", endpoint.address)->required();
  auto sink_credentials = grpc::InsecureServerCredentials();
  sink->add_option_function<std::string>(
      "--certificates",
      [&](const std::string& own) {
        const auto credentials = sixpoint::runtime::ServerCredentialsOf(own);
        if (!credentials.ok()) throw CLI::ValidationError("--certificates", credentials.status().ToString());
        sink_credentials = *credentials;
      },
      "Folder with identity.pem and authority.pem; without it no TLS");
  sink->callback([&] { exit_code = ServeSink(endpoint.address, sink_credentials); });

  FaultOptions faults;
  CLI::App* fault =
      app.add_subcommand("faults", "Clients that resume, until standard input ends; then checks the record");
  AddEndpoint(fault, "--ingest", &faults.ingest);
  fault->add_option("--database", faults.conninfo)->required();
  fault->add_option("--clients", faults.client_count);
  fault->add_option("--seed", faults.seed);
  fault->add_option("--acks", faults.acks_file, "Gets the times of all acknowledgements")->required();
  fault->callback([&] { print(UploadThroughFaults(faults)); });

  MutantOptions mutants;
  CLI::App* mutant = app.add_subcommand("mutants", "Mutated uploads");
  AddEndpoint(mutant, "--ingest", &mutants.ingest);
  mutant->add_option("--ingest-pid", mutants.ingest_pid)->required();
  mutant->add_option("--encoding", mutants.encoding, "DRACO, XYZ_F64 or RAW_PROFILES")->required();
  mutant->add_option("--count", mutants.count)->required();
  mutant->add_option("--seed", mutants.seed);
  mutant->callback([&] { print(UploadMutants(mutants)); });

  CLI11_PARSE(app, argc, argv);
  return exit_code;
}
