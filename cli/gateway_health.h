// What the gateway says of itself, asked from outside.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

namespace sixpoint::cli {

// In the words of service_health.h. url: "http://127.0.0.1:7480"; certificates: the folder of the plant's authority.pem, by which one
// that is reached by https is known.
std::string GatewayHealth(const std::string& url, const std::filesystem::path& certificates,
                          std::chrono::milliseconds patience);

}  // namespace sixpoint::cli
