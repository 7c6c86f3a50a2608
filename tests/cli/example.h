// A file of docs/examples.
#pragma once

#include <cstdlib>
#include <string>

namespace sixpoint::cli {

inline std::string Example(const std::string& name) {
  const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
  return std::string(source == nullptr ? "." : source) + "/docs/examples/" + name;
}

}  // namespace sixpoint::cli
