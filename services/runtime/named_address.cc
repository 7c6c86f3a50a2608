#include "services/runtime/named_address.h"

namespace sixpoint::runtime {

std::string CheckNamedAddress(const std::string& option, const std::string& text, const std::string& wanted) {
  const std::size_t equals = text.find('=');
  const bool is_whole = equals != std::string::npos && equals > 0 && equals + 1 < text.size();
  return is_whole ? std::string() : option + ": " + text + ", want " + wanted;
}

std::pair<std::string, std::string> NamedAddressOf(const std::string& text) {
  const std::size_t equals = text.find('=');
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace sixpoint::runtime
