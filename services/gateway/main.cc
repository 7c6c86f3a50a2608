// sixpoint-gateway: the plant for browsers and for whoever has HTTP alone.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <thread>

#include "identity/credentials.h"
#include "services/gateway/directory_client.h"
#include "services/gateway/gateway.h"
#include "services/gateway/http_listener.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/credentials.h"
#include "services/runtime/log.h"
#include "services/runtime/metrics_listener.h"
#include "services/runtime/named_address.h"
#include "services/runtime/process_metrics.h"
#include "services/runtime/server.h"

namespace sixpoint::gateway {
namespace {

constexpr std::chrono::seconds kDrain{10};

struct Options {
  HttpOptions http;
  std::map<std::string, std::string> addresses;
  std::string certificates, revoked_file, web_folder, metrics_address, oidc_file, page_url;
  int threads = 2;
};

Options ReadOptions(int argc, char** argv) {
  Options options;
  std::vector<std::string> peers;
  CLI::App app("The gateway: the plant by the Connect protocol, and its page.", "sixpoint-gateway");
  app.set_version_flag("--version", runtime::SoftwareVersion());
  app.add_option("--listen", options.http.address, "Address to serve HTTP on, such as 127.0.0.1:7480")->required();
  app.add_option("--peer", peers, "A service: area=address; repeated")->required()->check([](const std::string& peer) {
    return runtime::CheckNamedAddress("--peer", peer, "area=address");
  });
  app.add_option("--certificates", options.certificates, "Folder of the gateway's identity.pem and of authority.pem")
      ->required();
  app.add_option("--revoked", options.revoked_file, "The authority's revocation list")->required();
  app.add_option("--metrics", options.metrics_address,
                 "Address of /metrics and /health, over TLS, such as 127.0.0.1:7426; without it there is none");
  app.add_option("--web", options.web_folder, "Folder of the page's files; without it there is no page");
  auto* const certificate =
      app.add_option("--tls-certificate", options.http.certificate_file,
                     "PEM with the chain that browsers believe; without it plain, on loopback alone");
  app.add_option("--tls-key", options.http.key_file, "PEM of its key")->needs(certificate);
  app.add_flag("--behind-proxy", options.http.behind_proxy,
               "A proxy on this computer says where the client is (X-Forwarded-For, X-Forwarded-Proto)");
  app.add_option("--page", options.page_url, "Where people find the page, such as https://plant.example");
  app.add_option(
      "--oidc", options.oidc_file,
      "The identity provider by which people sign in, a YAML file (docs/access.md); it sends them back to --page");
  app.add_option("--threads", options.threads, "Threads that serve")->check(CLI::Range(1, 64))->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error));
  }
  for (const std::string& peer : peers) {
    const auto [area, address] = runtime::NamedAddressOf(peer);
    options.addresses[area] = address;
  }
  return options;
}

int Fail(const absl::Status& status) {
  runtime::Log(runtime::LogLevel::kError, std::string(status.message()));
  return 1;
}

// What the contract says, written beside this program when it was built; empty where it is not there.
std::string OpenApiBeside() {
  std::error_code error;
  std::ifstream file(std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "sixpoint-openapi.json");
  return {std::istreambuf_iterator<char>(file), {}};
}

// Whoever was refused stands in the log: the gateway has no database.
runtime::MetricsListener::Ask SeenBy(identity::Trust* trust) {
  return {[trust](const std::string& certificate_pem) { return runtime::BelievedIdentity(trust, certificate_pem); },
          [] { return true; },
          [](const runtime::HttpRequest& request, const std::string& caller, const absl::Status& why) {
            runtime::Log(runtime::LogLevel::kWarning, std::string(why.message()),
                         {{"caller", caller}, {"peer", request.peer}});
          }};
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
  Files files;
  if (!options.web_folder.empty()) {
    absl::StatusOr<Files> read = Files::Read(options.web_folder);
    if (!read.ok()) return Fail(read.status());
    files = *std::move(read);
  }
  Upstream upstream(options.addresses, *credentials);
  identity::Trust trust(std::filesystem::path(options.certificates) / identity::kAuthorityFile, options.revoked_file);
  if (absl::Status readable = trust.CheckFiles(); !readable.ok()) return Fail(readable);
  const runtime::ProcessMetrics process("gateway", options.certificates);
  std::unique_ptr<runtime::MetricsListener> metrics;
  if (!options.metrics_address.empty()) {
    auto opened = runtime::MetricsListener::Open(options.metrics_address, options.certificates, SeenBy(&trust));
    if (!opened.ok()) return Fail(opened.status());
    metrics = *std::move(opened);
  }
  if (std::string open_api = OpenApiBeside(); !open_api.empty()) files.Add("/openapi.json", std::move(open_api));
  std::optional<DirectoryClient> directory;
  if (!options.oidc_file.empty()) {
    absl::StatusOr<std::optional<DirectoryClient>> read = ReadDirectoryClient(options.oidc_file, options.page_url);
    if (!read.ok()) return Fail(read.status());
    directory = *std::move(read);
  }
  Gateway gateway(&upstream, &trust, std::move(files), std::move(directory));
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
  gateway.Stop();
  runtime::Log(runtime::LogLevel::kInfo, "stopped");
  return 0;
}

}  // namespace
}  // namespace sixpoint::gateway

int main(int argc, char** argv) {
  sixpoint::runtime::StartLog("gateway");
  return sixpoint::gateway::Run(sixpoint::gateway::ReadOptions(argc, argv));
}
