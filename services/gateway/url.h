// Paths and queries of URLs.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sixpoint::gateway {

struct Url {
  std::string path;                          // decoded; its slashes are those that stood there
  std::vector<std::string> segments;         // of the path, each decoded
  std::map<std::string, std::string> query;  // decoded
};

// None of a target that is no path, decodes to control characters, or names a parameter twice.
std::optional<Url> UrlOf(std::string_view target);

// Of the query's parameter of that name; empty where there is none.
std::string ValueOf(const Url& url, const std::string& name);

}  // namespace sixpoint::gateway
