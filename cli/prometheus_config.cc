#include "cli/prometheus_config.h"

#include <nlohmann/json.hpp>

#include "identity/credentials.h"

namespace sixpoint::cli {
namespace {

// A text of JSON is one of YAML too, whatever a path holds.
std::string YamlText(const std::string& text) { return nlohmann::json(text).dump(); }

}  // namespace

std::string PrometheusConfig(const LocalPlant& plant) {
  const std::string own = (LocalIdentityIn(plant.data) / identity::kIdentityFile).string();
  std::string text =
      "# Written by `sixpoint up`, each time. Another user's Prometheus needs a certificate of its own:\n"
      "#   sixpoint certs issue users/prometheus --role mes-reader --folder DIR\n"
      "global:\n  scrape_interval: 15s\n  evaluation_interval: 15s\n";
  if (!plant.alerts.empty()) text += "rule_files:\n  - " + YamlText(plant.alerts.string()) + "\n";
  text += "scrape_configs:\n  - job_name: sixpoint\n    scheme: https\n    tls_config:\n      ca_file: " +
          YamlText((plant.certificates() / identity::kAuthorityFile).string()) +
          "\n      # Key and certificate are in one file.\n      cert_file: " + YamlText(own) +
          "\n      key_file: " + YamlText(own) +
          "\n    static_configs:" + (plant.IsSeen() ? "\n" : " []  # --metrics-port 0\n");
  const std::vector<std::string> served = plant.Served();
  for (std::size_t i = 0; i < served.size() && plant.IsSeen(); ++i)
    text += "      - targets: [" + YamlText(plant.OwnMetrics(i)) + "]\n        labels: {area: " + served[i] + "}\n";
  return text;
}

}  // namespace sixpoint::cli
