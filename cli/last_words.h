// Why a service does not serve, as it wrote into its log.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace sixpoint::cli {

// The last warning or error since it listened or served; empty where there is none. Text that is no log line is what a program says
// that ends before it has a log.
std::string LastWordsOf(std::string_view log);
// Of the log's end, read as the service user, whose file it is.
std::string LastWords(const std::filesystem::path& log);

}  // namespace sixpoint::cli
