// The last fence: nothing secret is given to the log, and what another program's message brings along is hidden here.
#include <algorithm>
#include <cctype>
#include <cstring>

#include "services/runtime/log.h"

namespace sixpoint::runtime {
namespace {

constexpr char kHidden[] = "[hidden]";

std::size_t FindAnyCase(const std::string& text, const char* wanted, std::size_t from) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  const auto found = std::search(text.begin() + static_cast<std::ptrdiff_t>(std::min(from, text.size())), text.end(),
                                 wanted, wanted + std::strlen(wanted), same);
  return found == text.end() ? std::string::npos : static_cast<std::size_t>(found - text.begin());
}

void HidePrivateKeys(std::string* text) {
  const std::string begin = "-----BEGIN ", kind = "PRIVATE KEY-----", end = "-----END ";
  for (std::size_t at = 0; (at = text->find(begin, at)) != std::string::npos;) {
    const std::size_t named = text->find(kind, at);
    const std::size_t line_end = text->find("-----", at + begin.size());
    if (named == std::string::npos || line_end == std::string::npos || named + kind.size() != line_end + 5) {
      at += begin.size();
      continue;
    }
    const std::size_t last = text->find(end, named);
    const std::size_t closed = last == std::string::npos ? last : text->find("-----", last + end.size());
    text->replace(at, closed == std::string::npos ? closed : closed + 5 - at, kHidden);
  }
}

// The value after `name`, as libpq, YAML, JSON and headers write it: quoted, or up to a blank; a header's to the end of its line.
void HideValues(const char* name, bool to_line_end, std::string* text) {
  for (std::size_t at = 0; (at = FindAnyCase(*text, name, at)) != std::string::npos;) {
    std::size_t value = at + std::strlen(name);
    at = value;
    if (value < text->size() && ((*text)[value] == '"' || (*text)[value] == '\'')) ++value;  // the name's own
    while (value < text->size() && (*text)[value] == ' ') ++value;
    if (value >= text->size() || ((*text)[value] != '=' && (*text)[value] != ':')) continue;
    ++value;
    while (value < text->size() && (*text)[value] == ' ') ++value;
    const char quote = value < text->size() ? (*text)[value] : ' ';
    std::size_t last = value;
    if (quote == '\'' || quote == '"') {
      ++last;
      while (last < text->size() && (*text)[last] != quote) last += (*text)[last] == '\\' ? 2 : 1;
      last = std::min(last + 1, text->size());
    } else {
      const char* const ends = to_line_end ? "\r\n" : " \t\n,;&";
      while (last < text->size() && std::strchr(ends, (*text)[last]) == nullptr) ++last;
    }
    text->replace(value, last - value, kHidden);
    at = value;
  }
}

// postgresql://user:password@host
void HideInUrls(std::string* text) {
  for (std::size_t at = 0; (at = text->find("://", at)) != std::string::npos;) {
    at += 3;
    const std::size_t end = std::min(text->find_first_of(" \t\n/\"'", at), text->size());
    const std::size_t sign = text->rfind('@', end - 1);
    if (end <= at || sign == std::string::npos || sign < at) continue;
    const std::size_t colon = text->find(':', at);
    if (colon < sign) text->replace(colon + 1, sign - colon - 1, kHidden);
  }
}

}  // namespace

std::string WithoutSecrets(std::string text) {
  // Names, ids and methods, which most texts are, have nothing that a secret stands behind.
  if (text.find_first_of(":=") == std::string::npos && text.find("-----BEGIN ") == std::string::npos) return text;
  HidePrivateKeys(&text);
  for (const char* name : {"password", "passwd", "secret_key", "secret-key", "access_key", "client_secret", "id_token",
                           "access_token", "session_token"})
    HideValues(name, /*to_line_end=*/false, &text);
  for (const char* name : {"authorization", "cookie", "sixpoint-session"})
    HideValues(name, /*to_line_end=*/true, &text);
  HideInUrls(&text);
  return text;
}

}  // namespace sixpoint::runtime
