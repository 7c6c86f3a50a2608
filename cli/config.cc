#include "cli/config.h"

#include <cstdlib>
#include <filesystem>

#include "cli/document.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestDeadline_s = 86400;

std::string Environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

fs::path UsualFile() { return ConfigFolder() / "config.yaml"; }

}  // namespace

fs::path ConfigFolder() {
  const std::string configs = Environment("XDG_CONFIG_HOME");
  return (configs.empty() ? fs::path(Environment("HOME")) / ".config" : fs::path(configs)) / "sixpoint";
}

std::string ConfigFileOf(int argc, const char* const* argv) {
  const std::string option = "--config";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == option && i + 1 < argc) return argv[i + 1];
    if (word.rfind(option + "=", 0) == 0) return word.substr(option.size() + 1);
  }
  const std::string by_environment = Environment("SIXPOINT_CONFIG");
  if (!by_environment.empty()) return by_environment;
  std::error_code unreadable;
  return fs::exists(UsualFile(), unreadable) ? UsualFile().string() : "";
}

absl::Status ApplyConfig(const std::string& file, Session* session) {
  if (file.empty()) return absl::OkStatus();
  const absl::StatusOr<nlohmann::json> document = LoadDocument(file);
  if (!document.ok()) return document.status();
  if (document->is_null()) return absl::OkStatus();  // an empty file
  Problems problems(/*strict=*/true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"server", "data", "identity", "json", "deadline_s"});
  if (const auto field = root.Find("server")) session->server = field->Text();
  if (const auto field = root.Find("data")) session->data = field->Text();
  if (const auto field = root.Find("identity")) session->identity = field->Text();
  if (const auto field = root.Find("json")) session->json = field->Flag();
  if (const auto field = root.Find("deadline_s")) session->deadline_s = field->Positive(kLongestDeadline_s);
  if (problems.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(file + "\n" + std::string(problems.ToStatus().message()));
}

}  // namespace sixpoint::cli
