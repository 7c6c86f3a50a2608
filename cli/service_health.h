// What a service says of itself, asked from outside.
#pragma once

#include <chrono>
#include <string>

namespace sixpoint::cli {

// SERVING or NOT_SERVING as it answers; NOT_REACHED where nothing listens; SILENT where something listens and says nothing. By a
// connection of its own: one that stands may answer long after a service accepts no other.
std::string ServiceHealth(const std::string& address, std::chrono::milliseconds patience);

}  // namespace sixpoint::cli
