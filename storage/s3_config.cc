#include "storage/s3_config.h"

#include <sys/stat.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <regex>
#include <set>

#include "refusal/refusal.h"
#include "storage/s3_object_store.h"

namespace sixpoint::storage {
namespace {

absl::Status Refused(const std::string& path, const std::string& key, const std::string& value,
                     const std::string& wanted) {
  return Refuse(path + ": " + key, value, wanted);
}

// Every key a known one with one text: a misspelt timeout must not pass for the default.
absl::StatusOr<std::map<std::string, std::string>> ReadKeys(const std::string& path) {
  static const std::set<std::string> kKnown = {"endpoint",         "bucket",    "region",  "access_key",
                                               "secret_key",       "new_blobs", "ca_file", "connect_timeout_s",
                                               "request_timeout_s"};
  std::map<std::string, std::string> keys;
  try {
    const YAML::Node file = YAML::LoadFile(path);
    if (!file.IsMap()) return absl::InvalidArgumentError(path + ": want keys and values (endpoint, bucket, ...)");
    for (const auto& entry : file) {
      const std::string key = entry.first.as<std::string>();
      if (kKnown.count(key) == 0) return Refused(path, key, "unknown", "a key that storage/s3_config.h lists");
      if (!entry.second.IsScalar()) return Refused(path, key, "not one value", "one text or number");
      keys[key] = entry.second.as<std::string>();
    }
  } catch (const YAML::Exception&) {  // its message may quote the file
    return absl::InvalidArgumentError(path + ": cannot be read as YAML");
  }
  for (const auto& [key, variable] :
       {std::pair("access_key", "SIXPOINT_S3_ACCESS_KEY"), std::pair("secret_key", "SIXPOINT_S3_SECRET_KEY")}) {
    if (const char* value = std::getenv(variable)) keys[key] = value;
  }
  return keys;
}

absl::Status ReadSeconds(const std::string& path, const std::map<std::string, std::string>& keys,
                         const std::string& key, std::chrono::milliseconds* duration) {
  const auto found = keys.find(key);
  if (found == keys.end()) return absl::OkStatus();
  char* end = nullptr;
  const double seconds = std::strtod(found->second.c_str(), &end);
  if (found->second.empty() || *end != '\0' || !(seconds >= 0.05 && seconds <= 3600)) {
    return Refused(path, key, found->second, "0.05 to 3600");
  }
  *duration = std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<S3Config> ReadS3Config(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) return absl::InvalidArgumentError("--blob-store: no file " + path);
  if ((file.st_mode & S_IRWXO) != 0) {
    return Refuse(path, "holds a secret and everybody may read it", "mode 0600 or 0640");
  }
  absl::StatusOr<std::map<std::string, std::string>> keys = ReadKeys(path);
  if (!keys.ok()) return keys.status();
  S3Config config;
  const auto take = [&keys](const char* key, std::string* value) {
    if (const auto found = keys->find(key); found != keys->end()) *value = found->second;
  };
  take("endpoint", &config.endpoint);
  take("bucket", &config.bucket);
  take("region", &config.region);
  take("access_key", &config.access_key);
  take("secret_key", &config.secret_key);
  take("new_blobs", &config.new_blobs);
  take("ca_file", &config.ca_file);
  static const std::regex kEndpoint("https?://[A-Za-z0-9.-]+(:[0-9]{1,5})?|https?://\\[[0-9a-fA-F:]+\\](:[0-9]{1,5})?");
  if (!std::regex_match(config.endpoint, kEndpoint)) {
    return Refused(path, "endpoint", config.endpoint, "http(s)://host[:port], nothing after it");
  }
  if (!std::regex_match(config.bucket, std::regex("[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]"))) {
    return Refused(path, "bucket", config.bucket, "3 to 63 of a-z, 0-9, '.', '-'");
  }
  if (!std::regex_match(config.region, std::regex("[A-Za-z0-9-]{1,64}"))) {
    return Refused(path, "region", config.region, "letters, digits and '-', such as us-east-1");
  }
  if (config.access_key.empty()) return Refused(path, "access_key", "", "it here or in SIXPOINT_S3_ACCESS_KEY");
  if (config.secret_key.empty()) return Refused(path, "secret_key", "", "it here or in SIXPOINT_S3_SECRET_KEY");
  if (config.new_blobs != "s3" && config.new_blobs != "postgresql") {
    return Refused(path, "new_blobs", config.new_blobs, "s3 or postgresql");
  }
  for (const auto& [key, duration] : {std::pair("connect_timeout_s", &config.connect_timeout),
                                      std::pair("request_timeout_s", &config.request_timeout)}) {
    if (absl::Status read = ReadSeconds(path, *keys, key, duration); !read.ok()) return read;
  }
  return config;
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenBlobStore(const std::string& configuration,
                                                         std::int64_t most_postgresql_bytes) {
  constexpr char kS3[] = "s3://";
  if (configuration == "postgresql") return MakePostgresqlBlobStore(nullptr, most_postgresql_bytes);
  if (configuration.rfind(kS3, 0) != 0) {
    return Refuse("--blob-store", configuration, "postgresql or s3:// and a file's path");
  }
  const absl::StatusOr<S3Config> config = ReadS3Config(configuration.substr(sizeof kS3 - 1));
  if (!config.ok()) return config.status();
  std::unique_ptr<ObjectStore> objects = MakeS3ObjectStore(*config);
  return config->new_blobs == "s3" ? MakeObjectBlobStore(std::move(objects))
                                   : MakePostgresqlBlobStore(std::move(objects), most_postgresql_bytes);
}

}  // namespace sixpoint::storage
