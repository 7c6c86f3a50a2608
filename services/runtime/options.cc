#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "services/runtime/named_address.h"
#include "services/runtime/server.h"

namespace sixpoint::runtime {

ServerOptions ParseServerOptions(int argc, char** argv, const std::string& area,
                                 const std::function<void(CLI::App*)>& add_own_flags) {
  ServerOptions options;
  options.area = area;
  std::error_code unknown;
  options.worker_folder = std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path().string();
  std::vector<std::string> peers;

  CLI::App app("The " + area + " service.", "sixpoint-" + area);
  app.set_version_flag("--version", SoftwareVersion());
  app.add_option("--listen", options.listen_address, "Address to serve on, such as 127.0.0.1:7401")->required();
  app.add_option("--database", options.database, "Connection string, as libpq takes it")->required();
  app.add_option("--peer", peers, "Another service: area=address; repeated")->check([](const std::string& peer) {
    return CheckNamedAddress("--peer", peer, "area=address");
  });
  app.add_option("--certificates", options.certificates, "Folder of this service's identity.pem and of authority.pem")
      ->required();
  app.add_option("--revoked", options.revoked_file, "The authority's revocation list")->required();
  app.add_option("--metrics", options.metrics_address,
                 "Address of /metrics and /health, over TLS, such as 127.0.0.1:7421; without it there is none");
  app.add_option("--workers", options.worker_folder, "Folder of the worker programs")->capture_default_str();
  app.add_option("--database-connections", options.database_connections, "Most connections held at once")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "Compute threads of kernels")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_flag("--volatile-database", options.volatile_database,
               "Serves a database too that may lose what was acknowledged (fsync off): for tests")
      ->envname("SIXPOINT_VOLATILE_DATABASE");
  if (add_own_flags) add_own_flags(&app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  for (const std::string& peer : peers) {
    const auto [area_of_peer, address] = NamedAddressOf(peer);
    options.peers[area_of_peer] = address;
  }
  return options;
}

}  // namespace sixpoint::runtime
