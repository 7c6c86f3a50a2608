// An identity provider's keys and tokens for tests of the plant service, made by tests/identity/make_id_tokens.
#pragma once

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace sixpoint::plant {

// A folder that goes with it.
class ProviderTokens {
 public:
  ProviderTokens() {
    std::string pattern = (std::filesystem::temp_directory_path() / "sixpoint-provider-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~ProviderTokens() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  ProviderTokens(const ProviderTokens&) = delete;
  ProviderTokens& operator=(const ProviderTokens&) = delete;

  static bool MayBeMade() { return std::system("/usr/bin/python3 -c 'import jwt, cryptography' 2>/dev/null") == 0; }
  // New keys, and tokens of now.
  bool Make() const {
    return std::system((Source("tests/identity/make_id_tokens") + " " + folder_.string() + " " +
                        std::to_string(std::time(nullptr)))
                           .c_str()) == 0;
  }
  static std::string Source(const std::string& path) {
    return std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/" + path;
  }
  std::filesystem::path folder() const { return folder_; }
  std::string Text(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name, std::ios::binary).rdbuf();
    return text.str();
  }
  // A configuration file with these lines.
  std::string Config(const std::string& lines) const {
    std::ofstream(folder_ / "oidc.yaml") << lines;
    return (folder_ / "oidc.yaml").string();
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace sixpoint::plant
