// sixpoint-gateway: the plant for browsers and for whoever has HTTP alone.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <iostream>
#include <map>
#include <thread>

#include "identity/credentials.h"
#include "services/gateway/gateway.h"
#include "services/gateway/http_listener.h"
#include "services/runtime/credentials.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"

namespace sixpoint::gateway {
namespace {

constexpr std::chrono::seconds kDrain{10};

struct Options {
  HttpOptions http;
  std::map<std::string, std::string> addresses;
  std::string certificates, revoked_file, web_folder;
  int threads = 2;
};

Options ReadOptions(int argc, char** argv) {
  Options options;
  std::vector<std::string> peers;
  CLI::App app("The gateway: the plant by the Connect protocol, and its page.", "sixpoint-gateway");
  app.set_version_flag("--version", runtime::SoftwareVersion());
  app.add_option("--listen", options.http.address, "Address to serve HTTP on, such as 127.0.0.1:7480")->required();
  app.add_option("--peer", peers, "A service: area=address; repeated")->required()->check([](const std::string& peer) {
    const std::size_t equals = peer.find('=');
    const bool whole = equals != std::string::npos && equals > 0 && equals + 1 < peer.size();
    return whole ? std::string() : "--peer: " + peer + ", want area=address";
  });
  app.add_option("--certificates", options.certificates, "Folder of the gateway's identity.pem and of authority.pem")
      ->required();
  app.add_option("--revoked", options.revoked_file, "The authority's revocation list")->required();
  app.add_option("--web", options.web_folder, "Folder of the page's files; without it there is no page");
  auto* const certificate =
      app.add_option("--tls-certificate", options.http.certificate_file,
                     "PEM with the chain that browsers believe; without it plain, on loopback alone");
  app.add_option("--tls-key", options.http.key_file, "PEM of its key")->needs(certificate);
  app.add_flag("--behind-proxy", options.http.behind_proxy,
               "A proxy on this computer says where the client is (X-Forwarded-For, X-Forwarded-Proto)");
  app.add_option("--threads", options.threads, "Threads that serve")->check(CLI::Range(1, 64))->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  for (const std::string& peer : peers)
    options.addresses[peer.substr(0, peer.find('='))] = peer.substr(peer.find('=') + 1);
  return options;
}

int Fail(const absl::Status& status) {
  runtime::Log(runtime::LogLevel::kError, std::string(status.message()));
  return 1;
}

int Run(const Options& options) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  if (absl::Status own = runtime::CheckServiceCredentials(options.certificates, "gateway"); !own.ok()) return Fail(own);
  auto credentials = runtime::ChannelCredentialsOf(options.certificates);
  if (!credentials.ok()) return Fail(credentials.status());
  std::optional<Files> files;
  if (!options.web_folder.empty()) {
    absl::StatusOr<Files> read = Files::Read(options.web_folder);
    if (!read.ok()) return Fail(read.status());
    files = *std::move(read);
  }
  Upstream upstream(options.addresses, *credentials);
  identity::Trust trust(std::filesystem::path(options.certificates) / identity::kAuthorityFile, options.revoked_file);
  if (absl::Status readable = trust.CheckFiles(); !readable.ok()) return Fail(readable);
  Gateway gateway(&upstream, &trust, std::move(files));
  auto listener =
      HttpListener::Open(options.http, [&gateway](Exchange& exchange) { return gateway.Handle(&exchange); });
  if (!listener.ok()) return Fail(listener.status());
  runtime::Log(runtime::LogLevel::kInfo, "serving", {{"address", options.http.address}});
  std::thread stopper([&] {
    int signal = 0;
    sigwait(&signals, &signal);
    (*listener)->Stop(kDrain);
  });
  (*listener)->Run(options.threads);
  stopper.join();
  runtime::Log(runtime::LogLevel::kInfo, "stopped");
  return 0;
}

}  // namespace
}  // namespace sixpoint::gateway

int main(int argc, char** argv) {
  sixpoint::runtime::StartLog("gateway");
  return sixpoint::gateway::Run(sixpoint::gateway::ReadOptions(argc, argv));
}
