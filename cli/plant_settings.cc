#include "cli/plant_settings.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/document.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

constexpr int kMostLayout = 1'000'000;
constexpr std::pair<HttpAccess, const char*> kHttpAccess[] = {
    {HttpAccess::kDirect, "direct"}, {HttpAccess::kProxied, "proxied"}, {HttpAccess::kNone, "none"}};

bool Overlap(int first, int count, int other_first, int other_count) {
  return first < other_first + other_count && other_first < first + count;
}

// One word of supervisord's configuration, and a link.
bool IsPageUrl(const std::string& url) {
  const std::size_t host = url.rfind("https://", 0) == 0 ? 8 : url.rfind("http://", 0) == 0 ? 7 : url.size();
  return host < url.size() && url.size() <= 200 &&
         std::all_of(url.begin() + static_cast<std::ptrdiff_t>(host), url.end(), [](unsigned char c) {
           return std::isalnum(c) || std::string("/._-:[]").find(static_cast<char>(c)) != std::string::npos;
         });
}

}  // namespace

std::optional<HttpAccess> HttpAccessOf(const std::string& text) {
  for (const auto& [access, word] : kHttpAccess)
    if (text == word) return access;
  return std::nullopt;
}

std::string HttpAccessText(HttpAccess access) {
  for (const auto& [each, word] : kHttpAccess)
    if (access == each) return word;
  return "";
}

bool IsPlainPath(const std::string& path) {
  return !path.empty() && path[0] == '/' && std::all_of(path.begin(), path.end(), [](unsigned char c) {
    return std::isalnum(c) || std::string("/._-+@").find(static_cast<char>(c)) != std::string::npos;
  });
}

absl::Status CheckSettings(const PlantSettings& settings) {
  if (const auto address = settings.Address(); !address.ok()) return address.status();
  const int metrics = settings.MetricsPort();
  if (metrics != 0 && (metrics < kLowestPort || Overlap(metrics, kSeenCount, settings.base_port, kPortCount)))
    return runtime::Refuse("--metrics-port", std::to_string(metrics),
                           "0 for none, or the first of seven ports from " + std::to_string(kLowestPort) +
                               " on that are not those of the calls");
  const int http = settings.HttpPort();
  if (settings.http != HttpAccess::kNone &&
      (http < kLowestPort || http > kHighestPort || Overlap(http, 1, settings.base_port, kPortCount) ||
       (metrics != 0 && Overlap(http, 1, metrics, kSeenCount))))
    return runtime::Refuse("--http-port", std::to_string(http),
                           "a port from " + std::to_string(kLowestPort) +
                               " on that is neither one of the calls nor one where the plant is seen");
  if (!settings.page_url.empty() && !IsPageUrl(settings.page_url))
    return runtime::Refuse("--page", settings.page_url,
                           "none, or http:// or https:// with a host, such as https://plant.example");
  const std::string s3 = "s3://";
  if (!settings.oidc.empty() && !IsPlainPath(settings.oidc))
    return runtime::Refuse("--oidc", settings.oidc, "none, or a path from / on of letters, digits and /._-+@");
  const bool in_s3 = settings.blob_store.rfind(s3, 0) == 0 && IsPlainPath(settings.blob_store.substr(s3.size()));
  if (in_s3 || settings.blob_store == "postgresql") return absl::OkStatus();
  return runtime::Refuse("--blob-store", settings.blob_store,
                         "postgresql, or s3:// and a path from / on of letters, digits and /._-+@");
}

absl::StatusOr<PlantSettings> ParseSettings(const std::string& name, const std::string& text) {
  const absl::StatusOr<nlohmann::json> document = ParseJson(name, text);
  if (!document.ok()) return document.status();
  Problems problems(/*strict=*/true);
  const Field root(&*document, "", &problems);
  if (!document->is_object()) root.Refuse("an object");
  // `insecure` is of a release before mutual TLS: its files are read, whatever it says there, and written without it.
  root.OnlyKeys({"base_port", "metrics_port", "listen", "announce", "insecure", "http", "http_port", "page",
                 "blob_store", "oidc", "layout", "database_system"});
  PlantSettings settings;
  if (const auto field = root.Find("layout"); field && field->Whole(1, kMostLayout) > kFolderLayout)
    field->Refuse(std::to_string(kFolderLayout) + " or less: a newer release made this folder");
  if (const auto field = root.Find("database_system")) settings.database_system = field->Text();
  if (const auto field = root.Find("base_port"))
    settings.base_port = static_cast<int>(field->Whole(kLowestPort, kHighestBasePort));
  if (const auto field = root.Find("metrics_port"))
    settings.metrics_port = static_cast<int>(field->Whole(0, kHighestBasePort));
  if (const auto field = root.Find("listen")) settings.listen = field->Text();
  if (const auto field = root.Find("announce")) settings.announce = field->Text();
  if (const auto field = root.Find("http")) {
    const std::optional<HttpAccess> access = HttpAccessOf(field->Text());
    if (!access) field->Refuse("direct, proxied or none");
    settings.http = access.value_or(settings.http);
  }
  if (const auto field = root.Find("http_port"))
    settings.http_port = static_cast<int>(field->Whole(kLowestPort, kHighestPort));
  if (const auto field = root.Find("page")) settings.page_url = field->Text();
  if (const auto field = root.Find("blob_store")) settings.blob_store = field->Text();
  if (const auto field = root.Find("oidc")) settings.oidc = field->Text();
  const absl::Status wrong = problems.empty() ? CheckSettings(settings) : problems.ToStatus();
  if (!wrong.ok()) return absl::InvalidArgumentError(name + ": " + std::string(wrong.message()));
  return settings;
}

std::string SettingsText(const PlantSettings& settings) {
  nlohmann::ordered_json text = {
      {"base_port", settings.base_port}, {"listen", settings.listen}, {"blob_store", settings.blob_store}};
  if (settings.metrics_port) text["metrics_port"] = *settings.metrics_port;
  if (settings.http != HttpAccess::kDirect) text["http"] = HttpAccessText(settings.http);
  if (settings.http_port) text["http_port"] = *settings.http_port;
  if (!settings.page_url.empty()) text["page"] = settings.page_url;
  if (!settings.announce.empty()) text["announce"] = settings.announce;
  if (!settings.oidc.empty()) text["oidc"] = settings.oidc;
  text["layout"] = kFolderLayout;
  if (!settings.database_system.empty()) text["database_system"] = settings.database_system;
  return text.dump(2) + "\n";
}

}  // namespace sixpoint::cli
