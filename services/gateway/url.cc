#include "services/gateway/url.h"

#include <algorithm>

namespace sixpoint::gateway {
namespace {

int DigitOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// plus: a + stands for a blank, as forms have it.
std::optional<std::string> Decoded(std::string_view text, bool plus) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      if (i + 2 >= text.size()) return std::nullopt;
      const int high = DigitOf(text[i + 1]), low = DigitOf(text[i + 2]);
      if (high < 0 || low < 0) return std::nullopt;
      c = static_cast<char>(16 * high + low);
      i += 2;
    } else if (plus && c == '+') {
      c = ' ';
    }
    decoded += c;
  }
  return decoded;
}

bool HasControls(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

template <typename Take>
bool ForEach(std::string_view text, char separator, const Take& take) {
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    if (!take(text.substr(begin, end - begin))) return false;
    begin = end + 1;
  }
  return true;
}

}  // namespace

std::optional<Url> UrlOf(std::string_view target) {
  if (target.empty() || target.front() != '/') return std::nullopt;
  const std::size_t mark = std::min(target.find('?'), target.size());
  Url url;
  const bool has_path = ForEach(target.substr(1, mark - 1), '/', [&url](std::string_view segment) {
    const std::optional<std::string> decoded = Decoded(segment, /*plus=*/false);
    if (!decoded || HasControls(*decoded)) return false;
    url.path += "/" + *decoded;
    url.segments.push_back(*decoded);
    return true;
  });
  if (!has_path) return std::nullopt;
  if (mark + 1 >= target.size()) return url;
  const bool has_query = ForEach(target.substr(mark + 1), '&', [&url](std::string_view pair) {
    if (pair.empty()) return true;
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const auto name = Decoded(pair.substr(0, equals), /*plus=*/true);
    const auto value = Decoded(pair.substr(std::min(equals + 1, pair.size())), /*plus=*/true);
    return name && value && url.query.emplace(*name, *value).second;
  });
  if (!has_query) return std::nullopt;
  return url;
}

std::string ValueOf(const Url& url, const std::string& name) {
  const auto found = url.query.find(name);
  return found == url.query.end() ? "" : found->second;
}

}  // namespace sixpoint::gateway
