// What a plant was told when it was started, kept in its folder (plant.json), so that it starts again in the same way.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "cli/listen_address.h"

namespace sixpoint::cli {

// How a plant's folder is laid out; a release that lays it out anew counts one on.
inline constexpr int kFolderLayout = 1;
inline constexpr int kLowestPort = 1024, kHighestBasePort = 65000, kHighestPort = 65535;
// A port for each service, one after another; where it is seen (services/runtime/observation.h), so far above unless told otherwise, and
// the gateway after them.
inline constexpr int kPortCount = 6, kSeenCount = kPortCount + 1, kMetricsAbove = 20;
// The gateway's port, so far above unless told otherwise.
inline constexpr int kHttpAbove = 80;

// How the gateway (services/gateway) is reached: kDirect where the services are, over TLS by the plant's own certificate unless that is
// loopback; kProxied on loopback alone, by a proxy on this computer; kNone: there is no gateway.
enum class HttpAccess { kDirect, kProxied, kNone };
// "direct", "proxied", "none"; none of another text.
std::optional<HttpAccess> HttpAccessOf(const std::string& text);
std::string HttpAccessText(HttpAccess access);

struct PlantSettings {
  int base_port = 7400;
  std::optional<int> metrics_port;             // of the plant service; 0: none is seen from outside
  std::string listen = "127.0.0.1", announce;  // an empty `announce` is `listen`
  std::string blob_store = "postgresql";
  HttpAccess http = HttpAccess::kDirect;
  std::optional<int> http_port;
  std::string page_url;         // where people find the page behind a proxy; empty: at the gateway itself
  std::string oidc;             // the identity provider's file (docs/access.md); empty: none
  std::string database_system;  // of the plant's own PostgreSQL cluster (cli/plant_checks.h); empty: not known yet

  int HttpPort() const { return http_port.value_or(base_port + kHttpAbove); }
  int MetricsPort() const { return metrics_port.value_or(base_port + kMetricsAbove); }
  absl::StatusOr<ListenAddress> Address() const { return ListenAddressOf(listen, announce); }
};

// OK, or what is wrong with them, whether they come from the file or from the command line.
absl::Status CheckSettings(const PlantSettings& settings);
// Of the file's text; `name` is what a refusal calls the file.
absl::StatusOr<PlantSettings> ParseSettings(const std::string& name, const std::string& text);
std::string SettingsText(const PlantSettings& settings);

// What is a word of supervisord's configuration as it stands: letters, digits and /._-+@, beginning with /.
bool IsPlainPath(const std::string& path);

}  // namespace sixpoint::cli
