// "ingest=127.0.0.1:7401": what programs are told of each other on their command lines.
#pragma once

#include <string>
#include <utility>

namespace sixpoint::runtime {

// A validator of CLI11's: empty of a text that has both, else what is wanted. option: "--peer"; wanted: "area=address".
std::string CheckNamedAddress(const std::string& option, const std::string& text, const std::string& wanted);
// Of one that was checked.
std::pair<std::string, std::string> NamedAddressOf(const std::string& text);

}  // namespace sixpoint::runtime
